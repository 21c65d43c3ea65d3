"""Checks of values from users: each returns the clean value or raises an error of one line."""

from collections.abc import Collection, Sized
from dataclasses import dataclass, replace
import math
from numbers import Real
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.errors import ConfigError

_SHORT_UNITS = {'degrees': '°'}


@dataclass(frozen=True, slots=True)
class Quantity:
    """One quantity that a user can give.

    Attributes:
        name: Its name, unique in the table.
        unit: Its unit; empty for a pure number.
        lowest: Least allowed value.
        highest: Greatest allowed value.
        default: Its value where none is given: a float, an int, or a tuple of floats for three
            components in one range; None where it must be given.
        sentence: Its meaning, without the sign and without the full stop.
        sign: The positive direction, a part of a sentence; empty where there is none.
        open: Whether `lowest` itself is not allowed.
        whole: Whether only whole numbers are allowed.
    """

    name: str
    unit: str
    lowest: float
    highest: float
    default: Any
    sentence: str
    sign: str = ''
    open: bool = False
    whole: bool = False

    @property
    def meaning(self) -> str:
        """Return the sentence with the sign and the full stop."""
        return f'{self.sentence}, {self.sign}.' if self.sign else f'{self.sentence}.'

    @property
    def key(self) -> str:
        """Return the name with the unit, for a key of a file or the head of a column."""
        unit = self.unit.replace('degrees', 'deg').replace('1/', 'per_').replace('^', '')
        unit = unit.replace('/', '_').replace(' ', '_')
        return f'{self.name}_{unit}' if unit else self.name

    @property
    def label(self) -> str:
        """Return the name and the unit for an axis of a plot or a line of a report."""
        name = self.name.replace('_', ' ')
        return f'{name}, {self.short_unit}' if self.unit else name

    @property
    def short_unit(self) -> str:
        """Return the unit as plots and reports write it."""
        return _SHORT_UNITS.get(self.unit, self.unit)

    @property
    def span(self) -> str:
        """Return the range without the unit: '0 to 200'."""
        if self.whole:
            return f'{self.lowest} to {self.highest}'
        return f'{self.lowest:g} to {self.highest:g}'

    @property
    def allowed(self) -> str:
        """Return the range as a refusal states it: 'give a number from 0 to 200 m/s'."""
        if self.whole:
            return whole_range_text(int(self.lowest), int(self.highest), self.unit)
        above = self.lowest if self.open else None
        return range_text(self.lowest, self.highest, above, self.unit)

    def check(self, value: object, thing: str = '') -> Any:
        """Return `value` as a float, or as an int where the quantity is whole.

        Args:
            value: One number.
            thing: Name of the value in the message; empty for the name of the quantity.

        Raises:
            ConfigError: The value is not a number, not finite or out of range.
        """
        if self.whole:
            return whole_number(
                thing or self.name,
                value,
                int(self.lowest),
                int(self.highest),
                unit=self.unit,
                quantity=self.name,
            )
        return number(
            thing or self.name,
            value,
            self.lowest,
            self.highest,
            above=self.lowest if self.open else None,
            unit=self.unit,
            quantity=self.name,
        )

    def within(self, lowest: float | None = None, highest: float | None = None) -> Self:
        """Return the same quantity in a narrower range, ends included."""
        low = self.lowest if lowest is None else lowest
        high = self.highest if highest is None else highest
        if not self.lowest <= low <= high <= self.highest:
            raise ValueError(f'{self.name}: {low} to {high} is not within {self.span}')
        return replace(self, lowest=low, highest=high, open=self.open and lowest is None)


def number(
    thing: str,
    value: object,
    lowest: float = -math.inf,
    highest: float = math.inf,
    *,
    above: float | None = None,
    unit: str = '',
    quantity: str = '',
) -> float:
    """Return `value` as a float in [lowest, highest], and greater than `above` where given.

    Args:
        thing: Name of the value in the message: a flag, a YAML key or an argument.
        value: The value from the user.
        lowest: Least allowed value.
        highest: Greatest allowed value.
        above: Open lower bound, instead of `lowest`.
        unit: Unit of the range in the message.
        quantity: Name of the quantity in the table, for the error.

    Raises:
        ConfigError: The value is not a number, not finite or out of range.
    """

    def refused() -> ConfigError:
        return ConfigError(thing, value, range_text(lowest, highest, above, unit), quantity)

    if type(value) is float and above is None and lowest <= value <= highest:
        if math.isfinite(value):  # the usual case, without what takes most of the time
            return value
        raise refused()
    if isinstance(value, bool) or not isinstance(value, int | Real):
        raise refused()
    try:
        x = float(value)
    except OverflowError:
        raise refused() from None
    exact = value if isinstance(value, int) else x  # above 2^53 no float equals the whole number
    if not (math.isfinite(x) and lowest <= exact <= highest) or (above is not None and x <= above):
        raise refused()
    return x


def whole_number(
    thing: str, value: object, lowest: int, highest: int, *, unit: str = '', quantity: str = ''
) -> int:
    """Return `value` if it is a whole number in [lowest, highest].

    Raises:
        ConfigError: It is not.
    """
    if isinstance(value, bool) or not isinstance(value, int) or not lowest <= value <= highest:
        raise ConfigError(thing, value, whole_range_text(lowest, highest, unit), quantity)
    return value


def choice(thing: str, value: object, allowed: Collection[str]) -> str:
    """Return `value` if it is one of the `allowed` words.

    Raises:
        ConfigError: It is not.
    """
    if not isinstance(value, str) or value not in allowed:
        raise ConfigError(thing, value, f'choose from {", ".join(allowed)}')
    return value


def as_number(text: str) -> float | str:
    """Return text as a number; as text where it is none, or one in Python's syntax alone: 1_5."""
    try:
        return text if '_' in text else float(text)
    except ValueError:
        return text


def text(thing: str, value: object) -> str:
    """Return a text as one line that is safe to show on a terminal.

    Raises:
        ConfigError: It is not a text, or has control characters.
    """
    line = ' '.join(value.split()) if isinstance(value, str) else None
    if line is None or not line.isprintable():
        raise ConfigError(thing, value, 'give a text without control characters')
    return line


def instance(thing: str, value: object, kind: type, such_as: str) -> None:
    """Refuse an argument of another type.

    Args:
        thing: Name of the argument.
        value: The argument.
        kind: Its type.
        such_as: An expression that makes one.

    Raises:
        ConfigError: It is of another type.
    """
    if not isinstance(value, kind):
        raise ConfigError(
            thing, value, f'it must be of the type {kind.__name__}, such as {such_as}'
        )


def vector(thing: str, value: object, count: int = 3) -> None:
    """Refuse what does not hold `count` components; their ranges are checked elsewhere.

    Raises:
        ConfigError: It has no length, or another one.
    """
    if isinstance(value, str) or not isinstance(value, Sized) or len(value) != count:
        raise ConfigError(thing, value, f'give {count} numbers')


def column(thing: str, values: object, *, least: int = 2) -> NDArray[np.float64]:
    """Return a list of at least `least` finite numbers as an array, shape (n,).

    Raises:
        ConfigError: It is not a list, is too short or holds something else.
    """
    if not isinstance(values, list | tuple | np.ndarray):
        raise ConfigError(thing, values, f'give a list of at least {least} numbers')
    if len(values) < least:
        raise ConfigError(thing, list(values), f'give a list of at least {least} numbers')
    return np.array([number(f'{thing}[{i}]', x) for i, x in enumerate(values)], dtype=float)


def ascending(thing: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `values` if each is greater than the one before.

    Raises:
        ConfigError: One of them is not.
    """
    for i in range(1, len(values)):
        if not values[i] > values[i - 1]:
            allowed = f'values must ascend, and [{i - 1}] is {values[i - 1]:g}'
            raise ConfigError(f'{thing}[{i}]', float(values[i]), allowed)
    return values


def range_text(lowest: float, highest: float, above: float | None = None, unit: str = '') -> str:
    """Return which numbers are allowed, as a part of a sentence."""
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


def whole_range_text(lowest: int, highest: int, unit: str = '') -> str:
    """Return which whole numbers are allowed, as a part of a sentence."""
    return f'give a whole number from {lowest} to {highest}{f" {unit}" if unit else ""}'
