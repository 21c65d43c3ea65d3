"""Axes of plots that show SI data in the units of `--units`."""

from functools import partial

from matplotlib.axis import Axis
from matplotlib.ticker import AutoLocator, FuncFormatter

from disc_sim_ros.units import UNITS, System


class _RoundNumbers(AutoLocator):
    """Places ticks at round numbers of another unit than that of the data."""

    def __init__(self, factor: float) -> None:
        super().__init__()
        self._factor = factor  # data per unit

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Return the ticks between two data values."""
        ticks = super().tick_values(vmin / self._factor, vmax / self._factor)
        return [float(tick) * self._factor for tick in ticks]


def label(axis: Axis, text: str, system: System) -> None:
    """Label an axis, and number it in the unit of a system.

    Args:
        axis: The x or y axis of a plot, with data in SI units.
        text: Name and SI unit, such as 'height z, m'.
        system: The system of units that is shown.
    """
    name, comma, si = text.rpartition(', ')
    unit = system.unit(si)
    axis.set_label_text(f'{name}{comma}{unit}')
    if unit != si:
        factor = UNITS[si][unit]
        axis.set_major_locator(_RoundNumbers(factor))
        axis.set_major_formatter(FuncFormatter(partial(_number, factor)))


def _number(factor: float, value: float, _: int) -> str:
    return f'{round(value / factor, 9):g}'
