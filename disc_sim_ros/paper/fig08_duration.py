"""Fig. 8: duration over the launch pitch, of the flights of Fig. 7."""

import sys

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.paper import conditions, fig07_range, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.fig06_launch_conditions import pitch_launch
from disc_sim_ros.paper.fig07_range import COARSE, CONDITIONS, Data, compute, table

__all__ = ['CONDITIONS', 'KEY', 'TITLE', 'compute', 'example', 'findings', 'main', 'plot', 'table']

KEY = '8'
TITLE = 'Fig. 8: duration over launch pitch, 19 m/s, AdvR 1.1'
PAPER = 20.0  # degrees, of the greatest duration


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw duration over pitch."""
    words = (TITLE, CONDITIONS)
    return fig07_range.draw(
        data, data.duration, 'duration, s', stated=PAPER, words=words, look=look
    )


def findings(data: Data) -> list[str]:
    """Say where the duration is greatest, and how flat the curve is."""
    lines = []
    for share, row in zip(conditions.SHARES, data.duration, strict=True):
        at_paper = float(np.interp(PAPER, data.pitch, row))
        lines.append(
            f'{conditions.percent(share)}: greatest duration {row.max():.2f} s at '
            f'{data.best(row):g}°; of ten points 10° apart at {data.best(row, COARSE):g}°. '
            f'At {PAPER:g}° it is {at_paper:.2f} s, {row.max() - at_paper:.2f} s less.'
        )
    return lines


def example(data: Data) -> Curve:
    """Return the flight that is integrated a second time, independently."""
    flight = conditions.flown(pitch_launch(20.0), conditions.TENTH, ground=True)
    return Curve('θ 20°', conditions.TENTH, flight)


def main(arguments: list[str] | None = None) -> int:
    """Write this figure alone."""
    return figure_files.main(sys.modules[__name__], arguments)


if __name__ == '__main__':
    sys.exit(main())
