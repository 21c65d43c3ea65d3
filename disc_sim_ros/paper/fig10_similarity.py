"""Fig. 10: dimensionless trajectories of flat plates of equal k_n / AdvR coincide.

The plate is `flat_plate` of the catalogue, for which the printed 0.06 m is the radius
(docs/deviations.md). Speeds, masses, ratios and slopes are those of the legends.
"""

from dataclasses import dataclass, replace
import sys

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.paper import conditions, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.figure_files import PaperFigure
from disc_sim_ros.physics import disc_file, theory
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.flight import Flight, Setup, fly
from disc_sim_ros.physics.launch import Launch

TITLE = 'Fig. 10: dimensionless flights of flat plates'
CONDITIONS = (
    'Constant-spin model, linear aerodynamics, moments in axes 3 (body); the paper gives the '
    'plate no damping.\nDiscs every 0.1 s, enlarged 4 times. Lengths times g / V².'
)
SPEED, ALPHA = 15.7, 2.0  # m/s and degrees at launch
GRAVITY = 9.81  # m/s^2
LONGEST = 1.5  # dimensionless time t g / V
FIRST = ((15.7, 0.015), (22.2, 0.03), (31.5, 0.06), (44.5, 0.12))  # m/s, kg: lift = weight
SECOND = ((0.25, 0.1), (0.5, 0.2), (0.75, 0.3), (1.0, 0.4))  # AdvR, C_M slope per rad


@dataclass(frozen=True)
class Data:
    """The flights of both rows; lengths are made dimensionless with the speed at launch."""

    first: tuple[Curve, ...]
    second: tuple[Curve, ...]


def plate(mass: float | None = None, CM_alpha: float | None = None) -> Disc:
    """Return the flat plate with another mass [kg] or another moment slope [1/rad]."""
    disc = disc_file.load_disc('flat_plate')
    if disc.linear is None:
        raise ValueError('the disc flat_plate needs lines')
    line = disc.linear if CM_alpha is None else replace(disc.linear, CM_alpha=CM_alpha)
    mass_factor = 1.0 if mass is None else mass / disc.mass
    return replace(
        disc,
        mass=mass_factor * disc.mass,
        inertia_axial=mass_factor * disc.inertia_axial,
        inertia_diametral=mass_factor * disc.inertia_diametral,
        linear=line,
    )


def launched(disc: Disc, speed: float, ratio: float) -> Flight:
    """Fly a level plate released at an angle of attack of 2 degrees (caption)."""
    spin = theory.spin_rate(ratio, disc.diameter, speed)
    launch = Launch(speed=speed, pitch=0.0, angle_of_attack=ALPHA, spin=spin)
    samples = 150
    duration = LONGEST * speed / GRAVITY
    return fly(
        launch,
        Setup(disc=disc, model=conditions.MODEL),
        duration=duration,
        ground=False,
        sample_rate=samples / duration,
    )


def compute() -> Data:
    """Fly both rows."""
    first = tuple(
        Curve(f'{speed:g} m/s, {1e3 * mass:g} g', 0.0, launched(plate(mass), speed, 1.0), speed)
        for speed, mass in FIRST
    )
    second = tuple(
        Curve(
            f'AdvR {ratio:g}, C_Mα {slope:g}',
            0.0,
            launched(plate(CM_alpha=slope), SPEED, ratio),
            ratio,
        )
        for ratio, slope in SECOND
    )
    return Data(first, second)


def dimensionless(curve: Curve) -> FloatArray:
    """Return positions times g / V^2 at equal dimensionless times, shape (n, 3)."""
    return theory.dimensionless_length(curve.t.position, curve.flight.launch.speed, GRAVITY)


def spread(curves: tuple[Curve, ...]) -> float:
    """Return the largest distance between flights at any time, relative to their length [1]."""
    paths = np.array([dimensionless(curve) for curve in curves])
    apart = np.linalg.norm(paths[:, None] - paths[None, :], axis=-1).max()
    way = np.linalg.norm(np.diff(paths[0], axis=0), axis=1).sum()
    return float(apart / way)


def law(curve: Curve, *, printed: bool) -> float:
    """Return the dimensionless roll rate of eqn 64, as printed or corrected."""
    rule = theory.printed_roll_rate_law if printed else theory.roll_rate_law
    disc, launch = curve.flight.setup.disc, curve.flight.launch
    ratio = theory.advance_ratio(launch.spin, disc.diameter, launch.speed)
    return float(rule(theory.static_margin(disc), ratio))


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw both views of both rows."""
    figure = style.sheet(6.6, TITLE, CONDITIONS)
    grid = figure.add_gridspec(2, 2)
    for row, curves in enumerate((data.first, data.second)):
        colours = style.family([curve.value for curve in curves], look)
        for column, side in enumerate((style.SIDE, style.TOP)):
            axis = figure.add_subplot(grid[row, column])
            for i, (curve, colour) in enumerate(zip(curves, colours, strict=True)):
                scale = GRAVITY / curve.flight.launch.speed**2
                line = {'color': colour, 'label': curve.label, 'ls': ('-', '--', '-.', ':')[i]}
                style.path(axis, curve.t, side, scale=scale, **line)
                style.discs(axis, curve.t, side, every=0.1, size=4.0, colour=colour, scale=scale)
            style.views(axis, side)
            axis.set_xlabel('X g / V²')
            axis.set_ylabel('−Z g / V²' if side == style.SIDE else 'Y g / V² (right)')
            what = ('speed and mass vary', 'AdvR and C_Mα vary')[row]
            style.letter(axis, 'ab'[row], what if column == 0 else 'from above')
            if column == 1:
                axis.legend(loc='center left', bbox_to_anchor=(1.0, 0.5))
    return figure


def findings(data: Data) -> list[str]:
    """Return how closely the flights of each row coincide."""
    lines = []
    for name, curves in (('First', data.first), ('Second', data.second)):
        lines.append(
            f'{name} row: eqn 64 gives {law(curves[1], printed=True):.2f} as printed, '
            f'{law(curves[1], printed=False):.2f} corrected; the flights are at most '
            f'{100 * spread(curves):.2g} % of their length apart.'
        )
    return lines


def table(data: Data) -> str:
    """Return the dimensionless positions as CSV."""
    rows = []
    for row, curves in (('first', data.first), ('second', data.second)):
        for curve in curves:
            speed = curve.flight.launch.speed
            t_hat = theory.dimensionless_time(curve.t.t, speed, GRAVITY)
            rows += [
                [row, curve.label, t, t_hat[i], *xyz]
                for i, (t, xyz) in enumerate(zip(curve.t.t, dimensionless(curve), strict=True))
            ]
    header = ['row', 'curve', 't_s', 'time_g_by_V', 'X_g_by_V2', 'Y_right_g_by_V2']
    return conditions.csv_text([*header, 'Z_down_g_by_V2'], rows)


def example(data: Data) -> Curve:
    """Return the flight to integrate a second time."""
    return data.second[0]


FIGURE = PaperFigure(
    key='10',
    title=TITLE,
    conditions=CONDITIONS,
    compute=compute,
    plot=plot,
    findings=findings,
    table=table,
    example=example,
)


if __name__ == '__main__':
    sys.exit(figure_files.main(FIGURE))
