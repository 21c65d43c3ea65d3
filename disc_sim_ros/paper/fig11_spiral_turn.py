"""Fig. 11: a spiral turn, steered by a constant rolling moment coefficient."""

from dataclasses import dataclass
import sys

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.paper import conditions, figure_files, manoeuvre, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch

KEY = '11'
TITLE = 'Fig. 11: spiral turn, C_L = 0.1'
CONDITIONS = (
    'Table aerodynamics, moments in axes 3 or 4 and damping as named; constant-spin model, but '
    'for the thin line, which is exact.\n'
    'Discs every 0.2 s, enlarged 4 times.'
)
SPEED, ADV_R = 13.5, 0.5
LAUNCH = Launch(
    speed=SPEED,
    roll=-45.0,
    pitch=-30.0,
    angle_of_attack=5.0,
    spin=conditions.spin_of(ADV_R, SPEED),
)
CONTROL = Control(C_L=0.1)
DURATION = 6.0  # s; not printed
SETTLED = (2.0, 4.0)  # s, over which the text's steady values are taken
STATED = {'alpha_deg': 15.0, 'lambda_deg': 30.0, 'V_m_s': 7.0}


@dataclass(frozen=True)
class Data:
    """Flights with moments in axes 3, both dampings; in axes 4; and exact, in axes 3."""

    curves: tuple[Curve, ...]


def compute() -> Data:
    """Fly without ground: the turn goes on below the launch."""

    def turn(label: str, share: float, **options: str) -> Curve:
        flight = conditions.flown(LAUNCH, share, duration=DURATION, control=CONTROL, **options)
        return Curve(label, share, flight)

    return Data(
        (
            *(turn(f'axes 3, {conditions.percent(share)}', share) for share in conditions.SHARES),
            turn('axes 4, damping as printed', conditions.PRINTED, moment_axes='wind'),
            turn('axes 3, damping as printed, exact', conditions.PRINTED, model='exact'),
        )
    )


def mean(curve: Curve, name: str, span: tuple[float, float] = SETTLED) -> float:
    """Return the mean of a history over a span of time [its unit]."""
    chosen = (curve.t.t >= span[0] - 1e-9) & (curve.t.t <= span[1] + 1e-9)
    return float(np.mean(conditions.quantities(curve.t)[name][chosen]))


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw both views and the histories."""
    lines = (
        {'color': look.printed},
        {'color': look.tenth, 'ls': (0, (4, 1.6))},
        {'color': look.third, 'ls': ':'},
        {'color': look.fourth, 'lw': 0.9},
    )
    return manoeuvre.draw(data.curves, lines, (TITLE, CONDITIONS), STATED, look)


def findings(data: Data) -> list[str]:
    """Say where the turn settles."""
    lines = []
    for curve in data.curves:
        spin = curve.t.spin
        means = ', '.join(
            f'{symbol} {mean(curve, name):.1f}{unit}'
            for symbol, name, unit in (
                ('α', 'alpha_deg', '°'),
                ('λ', 'lambda_deg', '°'),
                ('V', 'V_m_s', ' m/s'),
            )
        )
        lines.append(
            f'{curve.label}: mean over {SETTLED[0]:g} to {SETTLED[1]:g} s {means}; spin '
            f'{spin[0]:.1f} to {spin[-1]:.1f} rad/s.'
        )
    exact = conditions.flown(
        LAUNCH, duration=DURATION, control=CONTROL, moment_axes='wind', model='exact'
    )
    lines.append(
        'The path does not tell axes 3 from 4, the spin does: in the exact model with axes 4 the '
        f'command is a motor and the spin goes to {exact.end.r:.1f} rad/s.'
    )
    return lines


def table(data: Data) -> str:
    """Return the samples as CSV."""
    return conditions.csv_of_curves(data.curves, {})


def example(data: Data) -> Curve:
    """Return the flight that is integrated a second time, independently."""
    return data.curves[3]


def main(arguments: list[str] | None = None) -> int:
    """Write this figure alone."""
    return figure_files.main(sys.modules[__name__], arguments)


if __name__ == '__main__':
    sys.exit(main())
