"""Fig. 8: duration against the launch pitch, of the flights of Fig. 7."""

import sys

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.paper import conditions, fig07_range, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.fig06_launch_conditions import pitch_launch
from disc_sim_ros.paper.fig07_range import CONDITIONS, Data, compute, table
from disc_sim_ros.paper.figure_files import PaperFigure

TITLE = 'Fig. 8: duration over launch pitch, 19 m/s, AdvR 1.1'
PAPER = 20.0  # degrees, pitch of the greatest duration in the paper


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw the duration against the pitch."""
    words = (TITLE, CONDITIONS)
    return fig07_range.draw(
        data, data.duration, 'duration, s', stated=PAPER, words=words, look=look
    )


def findings(data: Data) -> list[str]:
    """Return the pitch of the greatest duration, and how flat the curve is."""
    lines = []
    for share, row in zip(conditions.SHARES, data.duration, strict=True):
        at_paper = float(np.interp(PAPER, data.pitch, row))
        lines.append(
            f'{conditions.percent(share)}: greatest duration {row.max():.2f} s at '
            f"{data.best(row):g}°; of the paper's ten pitches at {data.best_on_grid(row):g}°. "
            f'At {PAPER:g}° it is {at_paper:.2f} s, {row.max() - at_paper:.2f} s less.'
        )
    return lines


def example(data: Data) -> Curve:
    """Return the flight to integrate a second time."""
    flight = conditions.flown(pitch_launch(20.0), conditions.TENTH, ground=True)
    return Curve('θ 20°', conditions.TENTH, flight)


FIGURE = PaperFigure(
    key='8',
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
