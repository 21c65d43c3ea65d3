"""Fig. 3: steady coefficients: the wind tunnel table, symbols read off, and the fitted lines."""

from dataclasses import dataclass
import math
import sys

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.paper import conditions, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.fig05_typical_flight import DURATION, LAUNCH
from disc_sim_ros.paper.figure_files import PaperFigure

TITLE = 'Fig. 3: steady coefficients of the disc'
CONDITIONS = (
    'Wind tunnel, no damping, moment about y of axes 3 (body). Table: what flies, linear between '
    "its rows. Symbols: read off the paper's Fig. 3."
)
NAMES = {'CL': 'C_Lift', 'CD': 'C_Drag', 'CM': 'C_M'}


@dataclass(frozen=True)
class Data:
    """Coefficients against the angle of attack.

    Attributes:
        alpha: Angles of attack of the curves [degrees], shape (n,).
        table: C_Lift, C_Drag, C_M of the table, shape (n, 3).
        linear: C_Lift, C_Drag, C_M of the printed lines, shape (n, 3).
        read: Columns of the symbols of Fig. 3.
    """

    alpha: FloatArray
    table: FloatArray
    linear: FloatArray
    read: dict[str, FloatArray]

    def zero(self, column: int) -> float:
        """Return the angle of attack at which a coefficient of the table is zero [degrees]."""
        return conditions.crossing(self.alpha, self.table[:, column])

    def read_zero(self, name: str) -> float:
        """Return the angle of attack at which a coefficient of the symbols is zero [degrees]."""
        return conditions.crossing(self.read['alpha_deg'], self.read[name])


def compute() -> Data:
    """Evaluate table and lines from -15 to 45 degrees."""
    disc = conditions.frisbee()
    table, line = disc.table, disc.linear
    if table is None or line is None:
        raise ValueError('the disc frisbee needs a table and lines')
    alpha = np.arange(-15.0, 45.0 + 0.25, 0.5)
    a = np.radians(alpha)
    columns = [np.interp(a, table.alpha, column) for column in table.coefficients.T]
    linear = (
        line.CL_0 + line.CL_alpha * a,
        line.CD_0 + line.CD_alpha * (a - line.alpha_0) ** 2,
        line.CM_0 + line.CM_alpha * a,
    )
    read = conditions.read('fig3_symbols_1deg.csv')
    return Data(alpha, np.column_stack(columns), np.column_stack(linear), read)


def slope(data: Data, name: str, low: float = 0.0, high: float = 10.0) -> float:
    """Return the least-squares slope of a coefficient of the symbols [1/rad]."""
    chosen = (data.read['alpha_deg'] >= low) & (data.read['alpha_deg'] <= high)
    a = np.radians(data.read['alpha_deg'][chosen])
    return float(np.polyfit(a, data.read[name][chosen], 1)[0])


def misfit(data: Data, low: float, high: float) -> float:
    """Return the rms difference of line and symbols of C_M between two angles [1]."""
    line = conditions.frisbee().linear
    if line is None:
        return math.nan
    alpha = data.read['alpha_deg']
    error = line.CM_0 + line.CM_alpha * np.radians(alpha) - data.read['CM']
    return float(np.sqrt(np.mean(error[(alpha >= low) & (alpha <= high)] ** 2)))


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw lift, drag and pitching moment."""
    figure = style.sheet(4.3, TITLE, CONDITIONS)
    panels = figure.subplots(1, 3)
    for i, (axis, (name, label)) in enumerate(zip(panels, NAMES.items(), strict=True)):
        axis.plot(data.alpha, data.table[:, i], color=look.printed, label='table')
        dashed = (0, (4, 1.6))
        axis.plot(data.alpha, data.linear[:, i], color=look.tenth, ls=dashed, label='lines')
        axis.plot(
            data.read['alpha_deg'], data.read[name], 'o', ms=3.5, color=look.ink, label='symbols'
        )
        axis.set(xlabel='angle of attack, °', ylabel=label)
        style.letter(axis, 'abc'[i], '')
    panels[0].legend(loc='upper left')
    return figure


def findings(data: Data) -> list[str]:
    """Return the angles of zero lift and zero moment, and the misfit of the line of C_M."""
    return [
        f'Zero lift at {data.zero(0):.1f}° (table), {data.read_zero("CL"):.1f}° (symbols).',
        f'C_M changes sign at {data.zero(2):.1f}° (table), {data.read_zero("CM"):.1f}° (symbols), '
        'and by the printed line at '
        f'{math.degrees(0.01 / 0.057):.1f}°.',
        f'The printed line of C_M is {misfit(data, 0, 10):.4f} rms from the symbols between 0 and '
        f'10°, {misfit(data, 11, 34):.4f} above 10° and {misfit(data, -10, -1):.4f} below 0°.',
    ]


def table(data: Data) -> str:
    """Return the curves as CSV; the symbols are in a file of the package."""
    header = ['alpha_deg', *(f'{name}_{kind}' for kind in ('table', 'linear') for name in NAMES)]
    return conditions.csv_text(header, np.column_stack([data.alpha, data.table, data.linear]))


def example(data: Data) -> Curve:
    """Return the flight to integrate a second time: Fig. 5 with the printed lines."""
    flight = conditions.flown(LAUNCH, duration=DURATION, aero='linear')
    return Curve('Fig. 5, linear aerodynamics', conditions.PRINTED, flight)


FIGURE = PaperFigure(
    key='3',
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
