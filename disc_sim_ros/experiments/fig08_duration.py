"""Fig. 8: duration over the launch pitch, of the flights of Fig. 7."""

import sys

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.experiments import drawing, fig07_range, output, paper
from disc_sim_ros.experiments.fig06_launch_conditions import pitch_launch
from disc_sim_ros.experiments.fig07_range import COARSE, CONDITIONS, Data, compute, table
from disc_sim_ros.experiments.paper import Curve

__all__ = ['CONDITIONS', 'KEY', 'TITLE', 'compute', 'example', 'findings', 'main', 'plot', 'table']

KEY = '8'
TITLE = 'Fig. 8: duration over launch pitch, 19 m/s, AdvR 1.1'
PAPER = 20.0  # degrees, of the greatest duration


@drawing.styled
def plot(data: Data, look: drawing.Look = drawing.LIGHT) -> Figure:
    """Draw duration over pitch."""
    words = (TITLE, CONDITIONS)
    return fig07_range.draw(
        data, data.duration, 'duration, s', stated=PAPER, words=words, look=look
    )


def findings(data: Data) -> list[str]:
    """Say where the duration is greatest, and how flat the curve is."""
    lines = []
    for share, row in zip(paper.SHARES, data.duration, strict=True):
        at_paper = float(np.interp(PAPER, data.pitch, row))
        lines.append(
            f'{paper.percent(share)}: greatest duration {row.max():.2f} s at {data.best(row):g}°; '
            f'of ten points 10° apart at {data.best(row, COARSE):g}°. At {PAPER:g}° it is '
            f'{at_paper:.2f} s, {row.max() - at_paper:.2f} s less.'
        )
    return lines


def example(data: Data) -> Curve:
    """Return the flight that is integrated a second time, independently."""
    flight = paper.flown(pitch_launch(20.0), paper.TENTH, ground=True)
    return Curve('θ 20°', paper.TENTH, flight)


def main(arguments: list[str] | None = None) -> int:
    """Write this figure alone."""
    return output.main(sys.modules[__name__], arguments)


if __name__ == '__main__':
    sys.exit(main())
