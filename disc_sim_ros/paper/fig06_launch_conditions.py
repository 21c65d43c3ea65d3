"""Fig. 6: side view and top view for several spins, pitches, angles of attack and rolls.

The values are those that the legends print. Two readings (docs/deviations.md): in c and d the
pitch is that of the path, released at the angle of no lift; in e to h "AdvR = 0.5" is r c / V.
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
    'Constant-spin model, table aerodynamics, moments in axes 3 (body). Solid: 10 % damping, with '
    'discs every 0.4 s, enlarged 6 times;\ndotted: damping as printed. c, d: released along a '
    'path of pitch θ at the angle of no lift. e to h: the printed AdvR 0.5 is r c / V, 0.25 by '
    'eqn 63.'
)
ADV_R_PITCH = 1.1  # of panels c, d
ADV_R = conditions.ADV_R_PRINTED_AS_0_5  # of panels e to h
PITCH_ROLL = 20.0  # degrees, of panels g and h
LONGEST = 4.0  # s, of launches that start level at Z = 0 and continue below
RATIOS = (0.0, 0.1, 0.4, 1.0, 8.0)
PITCHES = (0.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0)
ALPHAS = (0.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0)
ROLLS = (-20.0, -10.0, -5.0, 0.0, 5.0, 10.0, 20.0)
STRETCHED = 3.0  # panel d: Y by X
SHAPE = 0.72  # height of a panel by its width


@dataclass(frozen=True)
class Panel:
    """A row of the figure: the flights for all values of one quantity, with both dampings."""

    name: str
    curves: tuple[Curve, ...]
    corner: tuple[float, float]  # least height and leftmost Y of the views, m
    width: float  # of the views, m

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
    """Return a launch without lift along a path of a pitch [degrees] (c, d)."""
    return conditions.glide(ADV_R_PITCH, path=pitch)


def alpha_launch(alpha: float) -> Launch:
    """Return a launch of horizontal velocity at an angle of attack [degrees] (e, f)."""
    return conditions.level(ADV_R, pitch=alpha, angle_of_attack=alpha)


def roll_launch(roll: float, ratio: float = ADV_R) -> Launch:
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
        corner: tuple[float, float],
        width: float = 53.0,
        ground: bool,
    ) -> Panel:
        curves = []
        for share in conditions.SHARES:
            for value in values:
                thrown = launch(value)
                lands = ground and thrown.pitch > thrown.angle_of_attack
                longest = 60.0 if lands else LONGEST
                flight = conditions.flown(thrown, share, duration=longest, ground=lands)
                curves.append(Curve(f'{name} {value:g}{unit}', share, flight, value))
        return Panel(name, tuple(curves), corner, width)

    return Data(
        (
            panel('AdvR', '', RATIOS, ratio_launch, corner=(-29.0, -14.0), ground=False),
            panel('θ', '°', PITCHES, pitch_launch, corner=(-12.0, -6.0), ground=True),
            panel('α', '°', ALPHAS, alpha_launch, corner=(-25.0, -25.0), ground=False),
            panel('φ', '°', ROLLS, roll_launch, corner=(-10.0, -14.0), width=42.0, ground=True),
        )
    )


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw the eight panels: a row for each varied quantity."""
    figure = style.sheet(15.0, TITLE, CONDITIONS)
    grid = figure.add_gridspec(4, 2)
    larger = f', Y drawn {STRETCHED:g} times larger'
    titles = (
        'advance ratio',
        f'pitch of the path, AdvR {ADV_R_PITCH:g}',
        f'angle of attack, velocity level, AdvR {ADV_R:g}',
        f'roll, pitch 20°, AdvR {ADV_R:g}',
    )
    for row, (panel, varied) in enumerate(zip(data.panels, titles, strict=True)):
        solid = panel.of(conditions.TENTH)
        colours = style.family([curve.value for curve in solid], look)
        for column, which in enumerate((style.SIDE, style.TOP)):
            axis = figure.add_subplot(grid[row, column])
            narrow = which == style.TOP and panel is data.panels[1]
            for curve, dotted, colour in zip(
                solid, panel.of(conditions.PRINTED), colours, strict=True
            ):
                style.path(axis, dotted.t, which, color=colour, ls=':', lw=1.4)
                style.path(axis, curve.t, which, color=colour, label=curve.label)
                if not narrow:
                    style.discs(axis, curve.t, which, every=0.4, size=6.0, colour=colour)
            style.views(axis, which)
            height = SHAPE * panel.width / (STRETCHED if narrow else 1.0)
            low = panel.corner[column]
            axis.set(xlim=(-3.0, panel.width - 3.0), ylim=(low, low + height))
            axis.set_aspect(STRETCHED if narrow else 'equal', adjustable='box')
            if which == style.TOP:
                axis.yaxis.set_inverted(True)
            above = f'from above{larger if narrow else ""}'
            title = above if which == style.TOP else varied
            style.letter(axis, 'abcdefgh'[2 * row + column], title)
            if column == 1:
                axis.legend(loc='center left', bbox_to_anchor=(1.0, 0.5))
    return figure


def findings(data: Data) -> list[str]:
    """Return the end of each flight."""
    lines = []
    for panel in data.panels:
        ends = (
            f'{curve.label} X {curve.flight.end.X:.1f}, Y {curve.flight.end.Y:+.1f} m'
            for curve in panel.of(conditions.TENTH)
        )
        lines.append('Ends, 10 % damping: ' + '; '.join(ends) + '.')
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
    return data.panels[0].of(conditions.TENTH)[2]


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
