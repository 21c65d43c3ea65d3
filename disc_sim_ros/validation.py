"""Checks of values from outside: each returns the clean value or says what is allowed."""

from collections.abc import Collection
import math
from numbers import Real

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.errors import ConfigError


def number(
    thing: str,
    value: object,
    lowest: float = -math.inf,
    highest: float = math.inf,
    *,
    above: float | None = None,
    unit: str = '',
) -> float:
    """Return `value` as a float in [lowest, highest], and greater than `above` where given.

    Args:
        thing: Name of the value for the message: a flag, a YAML key or an argument.
        value: What came from outside.
        lowest: Least allowed value.
        highest: Greatest allowed value.
        above: Open lower bound, instead of `lowest`.
        unit: Unit for the message.

    Raises:
        ConfigError: The value is no number, not finite or out of range.
    """
    allowed = _range_text(lowest, highest, above, unit)
    if isinstance(value, bool) or not isinstance(value, int | Real):
        raise ConfigError(thing, value, allowed)
    try:
        x = float(value)
    except OverflowError:
        raise ConfigError(thing, value, allowed) from None
    exact = value if isinstance(value, int) else x  # above 2^53 no float is the whole number
    if not (math.isfinite(x) and lowest <= exact <= highest) or (above is not None and x <= above):
        raise ConfigError(thing, value, allowed)
    return x


def whole_number(thing: str, value: object, lowest: int, highest: int) -> int:
    """Return `value` if it is a whole number in [lowest, highest]."""
    if isinstance(value, bool) or not isinstance(value, int) or not lowest <= value <= highest:
        raise ConfigError(thing, value, f'give a whole number from {lowest} to {highest}')
    return value


def choice(thing: str, value: object, allowed: Collection[str]) -> str:
    """Return `value` if it is one of the `allowed` words."""
    if not isinstance(value, str) or value not in allowed:
        raise ConfigError(thing, value, f'choose from {", ".join(allowed)}')
    return value


def text(thing: str, value: object) -> str:
    """Return a text as one line that is safe to show on a terminal."""
    line = ' '.join(value.split()) if isinstance(value, str) else None
    if line is None or not line.isprintable():
        raise ConfigError(thing, value, 'give a text without control characters')
    return line


def column(thing: str, values: object, *, least: int = 2) -> NDArray[np.float64]:
    """Return a list of at least `least` finite numbers as an array."""
    if not isinstance(values, list | tuple | np.ndarray):
        raise ConfigError(thing, values, f'give a list of at least {least} numbers')
    if len(values) < least:
        raise ConfigError(thing, list(values), f'give a list of at least {least} numbers')
    return np.array([number(f'{thing}[{i}]', x) for i, x in enumerate(values)], dtype=float)


def ascending(thing: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `values` if each is greater than the one before."""
    for i in range(1, len(values)):
        if not values[i] > values[i - 1]:
            allowed = f'values must ascend, and [{i - 1}] is {values[i - 1]:g}'
            raise ConfigError(f'{thing}[{i}]', float(values[i]), allowed)
    return values


def _range_text(lowest: float, highest: float, above: float | None, unit: str) -> str:
    unit = f' {unit}' if unit else ''
    low = f'> {above:g}' if above is not None else f'>= {lowest:g}'
    bounded_below = above is not None or lowest > -math.inf
    if highest < math.inf and bounded_below:
        if above is None:
            return f'give a number from {lowest:g} to {highest:g}{unit}'
        return f'give a number {low} and <= {highest:g}{unit}'
    if bounded_below:
        return f'give a finite number {low}{unit}'
    if highest < math.inf:
        return f'give a finite number <= {highest:g}{unit}'
    return f'give a finite number{unit}'
