"""Fig. 7: range against the launch pitch."""

from dataclasses import dataclass
import sys
from typing import Any

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.paper import conditions, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.fig06_launch_conditions import pitch_launch
from disc_sim_ros.paper.figure_files import PaperFigure

TITLE = 'Fig. 7: range over launch pitch, 19 m/s, AdvR 1.1'
CONDITIONS = (
    conditions.CONDITIONS + '\nLanding where the centre crosses Z = 0. The pitch is that of the '
    'path; the disc is released at the angle of no lift.'
)
GRID = (0.0, 3.0, 5.0, 7.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0)  # degrees, the paper's points
FINE = 0.5  # degrees
PAPER = 10.0  # degrees, pitch of the greatest range in the paper


@dataclass(frozen=True)
class Data:
    """Flights to the ground for a range of pitches, with both dampings.

    Attributes:
        pitch: Launch pitch of the path [degrees], shape (n,).
        range: Distance over the ground, a row for each of `conditions.SHARES` [m], shape (2, n).
        duration: Time of flight, likewise [s], shape (2, n).
        longest: One flight near the greatest range.
    """

    pitch: FloatArray
    range: FloatArray
    duration: FloatArray
    longest: Curve

    def best(self, values: FloatArray) -> float:
        """Return the pitch of the largest of `values`, every half degree [degrees]."""
        return float(self.pitch[np.argmax(values)])

    def best_on_grid(self, values: FloatArray) -> float:
        """Return the pitch of the largest of `values`, on the points of the paper [degrees]."""
        points = np.flatnonzero(np.isin(self.pitch, GRID))
        return float(self.pitch[points[np.argmax(values[points])]])


def compute() -> Data:
    """Fly every half degree from 0 to 90."""
    pitch = np.arange(0.0, 90.0 + FINE / 2, FINE)
    flights = [
        [conditions.flown(pitch_launch(float(x)), share, ground=True, rate=0.0) for x in pitch]
        for share in conditions.SHARES
    ]
    longest = conditions.flown(pitch_launch(10.0), conditions.TENTH, ground=True)
    return Data(
        pitch,
        np.array([[flight.range for flight in row] for row in flights]),
        np.array([[flight.time for flight in row] for row in flights]),
        Curve('θ 10°', conditions.TENTH, longest),
    )


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw the range against the pitch."""
    return draw(data, data.range, 'range, m', stated=PAPER, words=(TITLE, CONDITIONS), look=look)


def draw(
    data: Data,
    values: FloatArray,
    label: str,
    *,
    stated: float,
    words: tuple[str, str],
    look: style.Look,
) -> Figure:
    """Draw one quantity against the pitch, with the best pitches and that of the paper."""
    figure = style.sheet(4.6, *words)
    axis = figure.add_subplot()
    lines: tuple[dict[str, Any], ...] = (
        {'color': look.printed},
        {'color': look.tenth, 'ls': (0, (4, 1.6))},
    )
    for row, line, share in zip(values, lines, conditions.SHARES, strict=True):
        best = data.best(row)
        name = f'{conditions.percent(share)}: most at {best:g}°'
        axis.plot(data.pitch, row, label=name, **line)
    points = np.isin(data.pitch, GRID)
    best = data.best_on_grid(values[1])
    name = f"the paper's ten pitches, 10 % damping: most at {best:g}°"
    axis.plot(data.pitch[points], values[1][points], 'o', color=look.tenth, label=name)
    name = f'paper: most near {stated:g}°'
    axis.axvline(stated, color=look.ink, ls=':', lw=1.4, label=name)
    axis.set(xlabel='launch pitch of the path θ, °', ylabel=label, xlim=(0, 90), ylim=(0, None))
    axis.legend(loc='best')
    return figure


def findings(data: Data) -> list[str]:
    """Return the pitch of the greatest range."""
    return [
        f'{conditions.percent(share)}: greatest range {row.max():.1f} m at {data.best(row):g}°; '
        f"of the paper's ten pitches at {data.best_on_grid(row):g}°."
        for share, row in zip(conditions.SHARES, data.range, strict=True)
    ] + ['At 0° there is no lift: the disc sinks at once and has no range.']


def table(data: Data) -> str:
    """Return range and duration against pitch as CSV."""
    names = ['pitch_deg']
    names += [
        f'{what}_damping_{s:g}' for s in conditions.SHARES for what in ('range_m', 'duration_s')
    ]
    columns = [data.pitch]
    for far, long in zip(data.range, data.duration, strict=True):
        columns += [far, long]
    return conditions.csv_text(names, np.column_stack(columns))


def example(data: Data) -> Curve:
    """Return the flight to integrate a second time."""
    return data.longest


FIGURE = PaperFigure(
    key='7',
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
