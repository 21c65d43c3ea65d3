"""Common parts of all figures: disc, model and launches of the paper, and sampled curves.

The paper uses the constant-spin model unless its text says otherwise, and so do the figures. Each
flight is computed with the printed roll and pitch damping and with a tenth of it, with which the
figures were drawn (docs/deviations.md). Moment coefficients act in axes 3.

Two readings of printed launches are needed before the curves follow: the angle of attack "0" of
Figs. 6c, d, 7 and 8 is that of no lift (`glide`), and the advance ratio "0.5" of Figs. 6e to h and
9 is r c / V, half as much by eqn 63 (`ADV_R_PRINTED_AS_0_5`).
"""

from collections.abc import Iterable, Mapping, Sequence
import csv
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
import io
from typing import Any

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics import disc_file, theory
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.environment import Air
from disc_sim_ros.physics.flight import NO_CONTROL, Flight, Setup, fly
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.trajectory import Trajectory

MODEL = 'constant_spin'
PRINTED, TENTH, HUNDREDTH = 1.0, 0.1, 0.01  # shares of the printed C_Lp and C_Mq
SHARES = (PRINTED, TENTH)
ADV_R_PRINTED_AS_0_5 = 0.25  # Figs. 6e to h and 9 print r c / V
RATE = 100.0  # Hz, sample rate of the curves
CONDITIONS = (
    'Constant-spin model, moments in axes 3 (body); roll and pitch damping as printed '
    'and 10 % of it.'
)


@dataclass(frozen=True, eq=False)
class Curve:
    """One flight of a figure.

    Attributes:
        label: Its name in the legend, with the unit.
        share: Share of the printed roll and pitch damping.
        flight: The flight, sampled at `RATE`.
        value: Value of the varied quantity, in the unit of the label; 0 if none is varied.
    """

    label: str
    share: float
    flight: Flight
    value: float = 0.0

    @property
    def t(self) -> Trajectory:
        """Return the samples."""
        return self.flight.trajectory


def percent(share: float) -> str:
    """Return a share of the printed damping as words."""
    return 'damping as printed' if share == PRINTED else f'{100 * share:g} % damping'


@cache
def frisbee(share: float = PRINTED) -> Disc:
    """Return the paper's disc with a share of its printed roll and pitch damping."""
    disc = disc_file.load_disc('frisbee_as_printed')
    return replace(disc, C_Lp=share * disc.C_Lp, C_Mq=share * disc.C_Mq)


def spin_of(AdvR: float, speed: float) -> float:
    """Return the spin of the paper's disc at an advance ratio [rad/s] (eqn 63)."""
    return theory.spin_rate(AdvR, frisbee().diameter, speed)


def level(AdvR: float, *, speed: float = 19.0, **angles: float) -> Launch:
    """Return a launch of Fig. 6: 19 m/s by default, each angle 0 unless given [degrees]."""
    return Launch(speed=speed, spin=spin_of(AdvR, speed), **{'pitch': 0.0, **angles})


def crossing(alpha: FloatArray, values: FloatArray) -> float:
    """Return the last angle at which values rise through zero, interpolated [degrees]."""
    i = int(np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))[-1])
    return float(alpha[i] - values[i] * (alpha[i + 1] - alpha[i]) / (values[i + 1] - values[i]))


@cache
def no_lift() -> float:
    """Return the angle of attack at which the table of the paper's disc has no lift [degrees]."""
    table = frisbee().table
    if table is None:
        raise ValueError('the disc frisbee_as_printed needs a table')
    small = np.abs(table.alpha_deg) < 45.0
    return crossing(table.alpha_deg[small], table.coefficients[small, 0])


def glide(AdvR: float, *, path: float, speed: float = 19.0) -> Launch:
    """Return a launch without lift along a path [degrees above the horizon] (Figs. 6c, 7, 8)."""
    alpha = no_lift()
    return level(AdvR, speed=speed, pitch=path + alpha, angle_of_attack=alpha)


@cache
def flown(
    launch: Launch,
    share: float = PRINTED,
    *,
    duration: float = 60.0,
    ground: bool = False,
    model: str = MODEL,
    aero: str = 'table',
    gravity: float = 9.81,
    moment_axes: str = 'body',
    control: Control = NO_CONTROL,
    rate: float = RATE,
) -> Flight:
    """Fly the paper's disc; a repeated call returns the same flight."""
    setup = Setup(
        disc=frisbee(share),
        model=model,
        aero=aero,
        moment_axes=moment_axes,
        air=Air(gravity=gravity),
    )
    return fly(launch, setup, control=control, duration=duration, ground=ground, sample_rate=rate)


def read(name: str) -> dict[str, FloatArray]:
    """Return the columns of a file in the folder data: points read off the paper's figures."""
    text = (files('disc_sim_ros.paper') / 'data' / name).read_text(encoding='utf-8')
    lines = [line for line in text.splitlines() if not line.startswith('#')]
    rows = np.array([[float(cell) for cell in line.split(',')] for line in lines[1:]])
    return dict(zip(lines[0].split(','), rows.T, strict=True))


def quantities(t: Trajectory) -> dict[str, FloatArray]:
    """Return the histories that the paper plots, in its axes 1, by names with units."""
    X, Y, Z = t.position.T
    phi, theta, _ = np.degrees(t.euler).T
    return {
        't_s': t.t,
        'X_forward_m': X,
        'Y_right_m': Y,
        'Z_down_m': Z,
        'V_m_s': t.airspeed,
        'alpha_deg': np.degrees(t.alpha),
        'phi_deg': phi,
        'theta_deg': theta,
        'lambda_deg': np.degrees(t.absolute_attitude),
        'AdvR': t.advance_ratio,
        'spin_rad_s': t.spin,
    }


def csv_of_curves(curves: Iterable[Curve], paper: Mapping[str, Mapping[str, Any]]) -> str:
    """Return curves as CSV, one below the other; `paper` adds points read off, by their label."""
    rows: list[list[Any]] = []
    names: list[str] = []
    for curve in curves:
        histories = quantities(curve.t)
        names = list(histories)
        label = [curve.label, f'{curve.share:g}']
        rows += [[*label, *row] for row in np.column_stack(list(histories.values())).tolist()]
    for label_of_points, points in paper.items():
        for i in range(len(points['t_s'])):
            cells = [points[name][i] if name in points else '' for name in names]
            rows.append([label_of_points, '', *cells])
    return csv_text(['curve', 'damping_share', *names], rows)


def csv_text(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return a header and rows as CSV: numbers with 9 digits, NaN and infinity as empty cells."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator='\n')
    writer.writerow(header)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return buffer.getvalue()


def _cell(value: Any) -> str:
    if isinstance(value, float | np.floating):
        return f'{value + 0.0:.9g}' if np.isfinite(value) else ''
    return str(value)
