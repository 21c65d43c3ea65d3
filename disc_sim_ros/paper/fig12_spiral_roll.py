"""Fig. 12: a spiral roll, steered by a constant pitching moment coefficient.

The figure was drawn without gravity (docs/deviations.md); both are shown.
"""

from dataclasses import dataclass
import sys

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.paper import conditions, figure_files, manoeuvre, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.physics.flight import Flight
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch

KEY = '12'
TITLE = 'Fig. 12: spiral roll, C_M = 0.2'
CONDITIONS = (
    'Constant-spin model, table aerodynamics, moments in axes 3 (body); damping as printed and '
    "10 % of it.\nDiscs every 0.2 s, enlarged 4 times. The paper's figure ends about 12 m down."
)
SPEED, ADV_R = 19.0, 0.34
LAUNCH = Launch(
    speed=SPEED, pitch=-20.0, angle_of_attack=-3.0, spin=conditions.spin_of(ADV_R, SPEED)
)
CONTROL = Control(C_M=0.2)
DURATION = 4.0  # s
STATED = {'alpha_deg': -3.0}
GRAVITIES = (0.0, 9.81)  # m/s^2


@dataclass(frozen=True)
class Data:
    """Flights without and with gravity, each with both dampings."""

    curves: tuple[Curve, ...]


def compute() -> Data:
    """Fly all four, without ground."""

    def roll(gravity: float, share: float) -> Curve:
        flight = conditions.flown(
            LAUNCH, share, duration=DURATION, control=CONTROL, gravity=gravity
        )
        name = 'with gravity' if gravity else 'no gravity'
        return Curve(f'{name}, {conditions.percent(share)}', share, flight, gravity)

    return Data(tuple(roll(g, share) for g in GRAVITIES for share in conditions.SHARES))


def descent_angle(curve: Curve) -> tuple[float, float]:
    """Return least and greatest angle of the path below the horizon, means over 0.5 s [degrees].

    Means, because the disc rolls about its path and the angle swings with it.
    """
    window = round(0.5 * conditions.RATE)
    velocity = curve.t.velocity[: len(curve.t) // window * window].reshape(-1, window, 3)
    X, Y, Z = velocity.mean(axis=1).T
    angle = np.degrees(np.arctan2(Z, np.hypot(X, Y)))
    return float(angle.min()), float(angle.max())


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw both views and the histories."""
    dashed = {'ls': (0, (4, 1.6)), 'lw': 1.2}
    lines = (
        {'color': look.printed},
        {'color': look.printed} | dashed,
        {'color': look.tenth},
        {'color': look.tenth} | dashed,
    )
    words = (TITLE, CONDITIONS)
    return manoeuvre.draw(data.curves, lines, words, STATED, look, with_discs=(0, 2))


def findings(data: Data) -> list[str]:
    """Say how deep it goes and whether angle of attack and path are constant."""
    lines = []
    for curve in data.curves:
        alpha = np.degrees(curve.t.alpha)
        lowest, highest = descent_angle(curve)
        lines.append(
            f'{curve.label}: {curve.flight.end.Z:.1f} m down after {DURATION:g} s; angle of '
            f'attack from {alpha.min():.1f}° to {alpha.max():.1f}°, path {lowest:.0f}° to '
            f'{highest:.0f}° below the horizon (means over 0.5 s).'
        )
    exact = ', '.join(
        f'{flight.end.Z:.1f} m {"with" if gravity else "without"} gravity at '
        f'{conditions.percent(share)}'
        for gravity in GRAVITIES
        for share in conditions.SHARES
        for flight in [exact_flight(gravity, share)]
    )
    return [*lines, f'The exact model, which loses spin: {exact}.']


def exact_flight(gravity: float, share: float) -> Flight:
    """Fly the manoeuvre in the exact model."""
    return conditions.flown(
        LAUNCH, share, duration=DURATION, control=CONTROL, gravity=gravity, model='exact'
    )


def table(data: Data) -> str:
    """Return the samples as CSV."""
    return conditions.csv_of_curves(data.curves, {})


def example(data: Data) -> Curve:
    """Return the flight that is integrated a second time, independently."""
    return data.curves[0]


def main(arguments: list[str] | None = None) -> int:
    """Write this figure alone."""
    return figure_files.main(sys.modules[__name__], arguments)


if __name__ == '__main__':
    sys.exit(main())
