"""Fig. 9: landing position against the launch roll, of the flights of Fig. 6g, h."""

from dataclasses import dataclass
import sys

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.paper import conditions, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.fig06_launch_conditions import ADV_R, roll_launch
from disc_sim_ros.paper.figure_files import PaperFigure

TITLE = 'Fig. 9: landing position over launch roll, 19 m/s, pitch 20°'
CONDITIONS = (
    conditions.CONDITIONS
    + '\nThe panels print AdvR 0.5; read as r c / V it is 0.25 by eqn 63. At 0.24 the '
    "text's 8 m and -6° come out as 8.2 m and -5.5°."
)
ROLLS = np.arange(-30.0, 31.0)  # degrees
GRID = (-30.0, -20.0, -10.0, -5.0, 0.0, 5.0, 10.0, 20.0, 30.0)  # degrees, the paper's points
RATIOS = (0.24, ADV_R, 0.5)


@dataclass(frozen=True)
class Data:
    """Landings for a range of rolls, for each advance ratio and damping.

    Attributes:
        landing: X, Y of the landings [m], shape (RATIOS, conditions.SHARES, ROLLS, 2).
        straight: The flight without roll at AdvR 0.25.
    """

    landing: FloatArray
    straight: Curve

    def of(self, ratio: float, share: float) -> FloatArray:
        """Return the landings at an advance ratio and damping [m], shape (61, 2)."""
        xy: FloatArray = self.landing[RATIOS.index(ratio), conditions.SHARES.index(share)]
        return xy

    def crossing(self, ratio: float, share: float) -> float:
        """Return the roll from which the disc lands on the X axis, interpolated [degrees]."""
        Y = self.of(ratio, share)[:, 1]
        i = int(np.flatnonzero(Y[:-1] * Y[1:] <= 0.0)[0])
        return float(ROLLS[i] - Y[i] * (ROLLS[i + 1] - ROLLS[i]) / (Y[i + 1] - Y[i]))

    def without_roll(self, ratio: float, share: float) -> float:
        """Return the landing to the right of the X axis without roll [m]."""
        return float(self.of(ratio, share)[ROLLS == 0.0, 1][0])


def compute() -> Data:
    """Fly every whole degree of roll to the ground."""

    def landing(ratio: float, share: float, roll: float) -> tuple[float, float]:
        end = conditions.flown(roll_launch(roll, ratio), share, ground=True, rate=0.0).end
        return end.X, end.Y

    landings = [
        [[landing(ratio, share, float(x)) for x in ROLLS] for share in conditions.SHARES]
        for ratio in RATIOS
    ]
    flight = conditions.flown(roll_launch(0.0), conditions.TENTH, ground=True)
    return Data(np.array(landings), Curve('φ 0°', conditions.TENTH, flight))


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw the landings for each advance ratio, one damping below the other."""
    figure = style.sheet(6.6, TITLE, CONDITIONS)
    panels = figure.subplots(2, 1, sharex=True, sharey=True)
    colours = style.family(RATIOS, look)
    for axis, share in zip(panels, conditions.SHARES, strict=True):
        for ratio, colour in zip(RATIOS, colours, strict=True):
            X, Y = data.of(ratio, share).T
            bold = ratio == ADV_R
            name = f'AdvR {ratio:g}: on the axis at {data.crossing(ratio, share):.1f}°'
            axis.plot(Y, X, color=colour, lw=2.6 if bold else 1.3, label=name)
            every = np.isin(ROLLS, GRID)
            axis.plot(Y[every], X[every], 'o', color=colour, ms=5.5 if bold else 3.5)
            if bold:
                for roll, x, y in zip(ROLLS[every], X[every], Y[every], strict=True):
                    axis.annotate(
                        f'{roll:g}°', (y, x), textcoords='offset points', xytext=(6, 5), fontsize=9
                    )
        axis.axvline(0.0, color=look.ink, lw=0.8)
        axis.set(ylabel='X forward, m', title=conditions.percent(share))
        axis.set_aspect('equal', adjustable='box')
        axis.legend(loc='center left', bbox_to_anchor=(1.0, 0.5))
    panels[1].set_xlabel('Y right, m')
    return figure


def steepest(roll: float) -> float:
    """Return the largest angle of attack at AdvR 0.25 and 10 % damping [degrees]."""
    flight = conditions.flown(roll_launch(roll), conditions.TENTH, ground=True)
    return float(np.degrees(flight.trajectory.alpha).max())


def findings(data: Data) -> list[str]:
    """Return where the landings cross the X axis, and the cause of the corner."""
    lines = [
        f'AdvR {ratio:g}, {conditions.percent(share)}: on the X axis at a roll of '
        f'{data.crossing(ratio, share):.1f}°, {data.without_roll(ratio, share):.1f} m to the '
        'right without roll.'
        for ratio in RATIOS
        for share in conditions.SHARES
    ]
    return [
        *lines,
        f'The corner at AdvR {ADV_R:g} and 10 % damping lies between rolls of -3° and -2°, '
        f'where the largest angle of attack goes from {steepest(-3.0):.0f}° to '
        f'{steepest(-2.0):.0f}°: between 45° and 50° the table loses half of its lift.',
    ]


def table(data: Data) -> str:
    """Return the landings as CSV."""
    rows = [
        [ratio, share, roll, X, Y]
        for ratio in RATIOS
        for share in conditions.SHARES
        for roll, (X, Y) in zip(ROLLS, data.of(ratio, share), strict=True)
    ]
    header = ['AdvR', 'damping_share', 'roll_deg', 'X_forward_m', 'Y_right_m']
    return conditions.csv_text(header, rows)


def example(data: Data) -> Curve:
    """Return the flight to integrate a second time."""
    return data.straight


FIGURE = PaperFigure(
    key='9',
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
