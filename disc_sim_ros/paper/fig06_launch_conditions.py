"""Fig. 6: side view and top view for several spins, pitches, angles of attack and rolls.

The text gives V = 19 m/s and the advance ratios 1.1 for c and d and 0.5 for e and f; for g and h
it says only that the advance ratio is less than in Fig. 5. The varied values are printed only in
the legends of the figure; those here are chosen to span what the text discusses.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
import sys

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.paper import conditions, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.figure_files import PaperFigure
from disc_sim_ros.physics.launch import Launch

TITLE = 'Fig. 6: effect of the launch, 19 m/s'
CONDITIONS = (
    'Constant-spin model, table aerodynamics, moments in axes 3 (body).\nSolid: damping as '
    'printed, with discs every 0.4 s, enlarged 6 times; dotted: 10 % damping.'
)
ADV_R_PITCH, ADV_R_ALPHA = 1.1, 0.5  # of panels c, d and e, f, from the text
ADV_R_ROLL = 0.25  # not printed; the text says only less than in Fig. 5, 0.29
PITCH_ROLL = 20.0  # degrees, of panels g and h
LONGEST = 4.0  # s, of launches that start level at Z = 0 and continue below
RATIOS = (0.0, 0.1, 0.2, 0.4, 1.1, 3.2)
PITCHES = (0.0, 10.0, 20.0, 30.0, 40.0, 60.0)
ALPHAS = (0.0, 15.0, 30.0, 45.0, 60.0, 90.0)
ROLLS = (-30.0, -20.0, -10.0, -7.0, 0.0, 10.0, 20.0, 30.0)


@dataclass(frozen=True)
class Panel:
    """A row of the figure: the flights for all values of one quantity, with both dampings."""

    name: str
    curves: tuple[Curve, ...]
    limits: tuple[float, float]  # of the height, m

    def of(self, share: float) -> list[Curve]:
        """Return the flights with a share of the printed damping."""
        return [curve for curve in self.curves if curve.share == share]


@dataclass(frozen=True)
class Data:
    """The rows a-b, c-d, e-f and g-h."""

    panels: tuple[Panel, ...]


def ratio_launch(ratio: float) -> Launch:
    """Return a level launch at an advance ratio (a, b)."""
    return conditions.level(ratio)


def pitch_launch(pitch: float) -> Launch:
    """Return a launch along the x axis of the disc at a pitch [degrees] (c, d)."""
    return conditions.level(ADV_R_PITCH, pitch=pitch)


def alpha_launch(alpha: float) -> Launch:
    """Return a launch of horizontal velocity at an angle of attack [degrees] (e, f)."""
    return conditions.level(ADV_R_ALPHA, pitch=alpha, angle_of_attack=alpha)


def roll_launch(roll: float, ratio: float = ADV_R_ROLL) -> Launch:
    """Return a launch at 20 degrees of pitch and a roll [degrees] (g, h)."""
    return conditions.level(ratio, pitch=PITCH_ROLL, roll=roll)


def compute() -> Data:
    """Fly all launches."""

    def panel(
        name: str,
        unit: str,
        values: Sequence[float],
        launch: Callable[[float], Launch],
        *,
        limits: tuple[float, float],
        ground: bool,
    ) -> Panel:
        curves = []
        for share in conditions.SHARES:
            for value in values:
                thrown = launch(value)
                lands = ground and thrown.pitch > 0.0
                longest = 60.0 if lands else LONGEST
                flight = conditions.flown(thrown, share, duration=longest, ground=lands)
                curves.append(Curve(f'{name} {value:g}{unit}', share, flight, value))
        return Panel(name, tuple(curves), limits)

    return Data(
        (
            panel('AdvR', '', RATIOS, ratio_launch, limits=(-14.0, 3.0), ground=False),
            panel('θ', '°', PITCHES, pitch_launch, limits=(-5.0, 13.0), ground=True),
            panel('α', '°', ALPHAS, alpha_launch, limits=(-10.0, 12.0), ground=False),
            panel('φ', '°', ROLLS, roll_launch, limits=(0.0, 10.0), ground=True),
        )
    )


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw the eight panels: a row for each varied quantity."""
    figure = style.sheet(10.8, TITLE, CONDITIONS)
    grid = figure.add_gridspec(4, 2, height_ratios=(1, 0.75, 1, 1.3))
    titles = (
        'spin: AdvR from 0 to 3.2',
        f'pitch, AdvR {ADV_R_PITCH:g}',
        f'angle of attack, velocity level, AdvR {ADV_R_ALPHA:g}',
        f'roll, pitch 20°, AdvR {ADV_R_ROLL:g} (assumed)',
    )
    for row, (panel, title) in enumerate(zip(data.panels, titles, strict=True)):
        solid = panel.of(conditions.PRINTED)
        colours = style.family([curve.value for curve in solid], look)
        for column, which in enumerate((style.SIDE, style.TOP)):
            axis = figure.add_subplot(grid[row, column])
            for curve, dotted, colour in zip(
                solid, panel.of(conditions.TENTH), colours, strict=True
            ):
                style.path(axis, dotted.t, which, color=colour, ls=':', lw=1.4)
                style.path(axis, curve.t, which, color=colour, label=curve.label)
                style.discs(axis, curve.t, which, every=0.4, size=6.0, colour=colour)
            style.views(axis, which, equal='box')
            if which == style.SIDE:
                axis.set_ylim(*panel.limits)
            style.letter(axis, 'abcdefgh'[2 * row + column], title if column == 0 else '')
            if column == 1:
                axis.legend(loc='center left', bbox_to_anchor=(1.0, 0.5))
    return figure


def findings(data: Data) -> list[str]:
    """Return the end of each flight."""
    lines = []
    for panel in data.panels:
        ends = (
            f'{curve.label} X {curve.flight.end.X:.1f}, Y {curve.flight.end.Y:+.1f} m'
            for curve in panel.of(conditions.PRINTED)
        )
        lines.append('Ends, damping as printed: ' + '; '.join(ends) + '.')
    return lines


def returns(pitch: float, share: float) -> bool:
    """Return True if a disc thrown at a pitch [degrees] flies backwards before it lands (c)."""
    flight = conditions.flown(pitch_launch(pitch), share, ground=True)
    return bool(np.min(flight.trajectory.velocity[:, 0]) < 0.0)


def least_returning_pitch(share: float, spacing: int) -> float:
    """Return the least pitch from which the disc turns back, on a grid [degrees]."""
    for pitch in range(spacing, 91, spacing):
        if returns(float(pitch), share):
            return float(pitch)
    return math.nan


def table(data: Data) -> str:
    """Return the samples as CSV."""
    return conditions.csv_of_curves((c for panel in data.panels for c in panel.curves), {})


def example(data: Data) -> Curve:
    """Return the flight to integrate a second time."""
    return data.panels[0].of(conditions.PRINTED)[3]


FIGURE = PaperFigure(
    key='6',
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
