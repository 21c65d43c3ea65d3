"""Specification of a node's parameters, and the check of their values, without ROS."""

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import difflib
import math
from typing import Any, Literal

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.validation import Quantity

Value = bool | int | float | str | tuple[float, ...]
Effect = Literal['next throw', 'at once', 'fixed']


@dataclass(frozen=True, slots=True)
class ParameterSpec:
    """One parameter. The type of its default is its type; a tuple is an array of doubles.

    Attributes:
        name: Its name in ROS.
        default: Its value where none is given.
        effect: When a change takes effect; a 'fixed' parameter is read-only.
        meaning: A sentence.
        quantity: Unit and range of a number, and of each number of an array.
        choices: Allowed words of a text; empty where any text is allowed.
        constraint: A further condition, a part of a sentence.
        listed: Whether a text holds words separated by spaces; a list of texts is allowed, too.
    """

    name: str
    default: Value
    effect: Effect
    meaning: str
    quantity: Quantity | None = None
    choices: Sequence[str] = ()
    constraint: str = ''
    listed: bool = False

    @property
    def unit(self) -> str:
        """Return the unit of a number; empty for other parameters."""
        return '' if self.quantity is None else self.quantity.unit

    @property
    def lowest(self) -> float:
        """Return the least allowed number; -inf for other parameters."""
        return -math.inf if self.quantity is None else self.quantity.lowest

    @property
    def highest(self) -> float:
        """Return the greatest allowed number; inf for other parameters."""
        return math.inf if self.quantity is None else self.quantity.highest


def spec_of(
    quantity: Quantity, effect: Effect, name: str = '', constraint: str = ''
) -> ParameterSpec:
    """Return the specification of a parameter that holds a quantity of the table.

    Args:
        quantity: Gives the default, the range, the unit and the meaning.
        effect: When a change takes effect.
        name: Name in ROS; empty for the name of the quantity.
        constraint: A further condition, a part of a sentence.
    """
    return ParameterSpec(
        name or quantity.name,
        quantity.default,
        effect,
        quantity.meaning,
        quantity,
        constraint=constraint,
    )


def checked(values: Mapping[str, object], table: Sequence[ParameterSpec]) -> dict[str, Any]:
    """Return a value for every parameter, each in its own range: those given, else defaults.

    Raises:
        ConfigError: A name that is not in the table, a wrong type or a value out of range.
    """
    names = [spec.name for spec in table]
    for name, value in values.items():
        if name not in names:
            raise ConfigError(name, value, no_such(name, names))
    return {spec.name: _clean(spec, values.get(spec.name, spec.default)) for spec in table}


def allowed_text(spec: ParameterSpec) -> str:
    """Return the range or the words of a parameter, as a part of a sentence."""
    match spec.default, spec.quantity:
        case tuple(), Quantity():
            return f'{len(spec.default)} numbers from {spec.quantity.span}'
        case _, Quantity():
            return spec.quantity.span
        case bool(), _:
            return 'true or false'
    return words(spec.choices)


def words(choices: Sequence[str]) -> str:
    """Return words with commas between them; the empty word as a pair of quotes."""
    return ', '.join(word or "''" for word in choices)


def plain(value: Value) -> bool | int | float | str | list[float]:
    """Return a value in the types of YAML and rclpy: an array as a list."""
    return list(value) if isinstance(value, tuple) else value


def no_such(name: str, names: Sequence[str]) -> str:
    """Return that no parameter has this name, and which one may be meant."""
    tails = [known for known in names if known.endswith(f'.{name}')]
    close = tails or difflib.get_close_matches(name, names, n=1)
    guess = f', did you mean {" or ".join(close)}?' if close else ''
    return f'there is no such parameter{guess}'


def _clean(spec: ParameterSpec, value: object) -> Value:
    """Return a value in the type of the parameter; a whole number may stand for a double."""
    match spec.default, spec.quantity:
        case tuple(), Quantity():
            return _numbers(spec.name, value, spec.quantity, allowed_text(spec), len(spec.default))
        case _, Quantity():
            number: int | float = spec.quantity.check(value, spec.name)
            return number
        case bool(), _:
            if isinstance(value, bool):
                return value
            raise ConfigError(spec.name, value, 'give true or false')
    return _text(spec, value)


def _text(spec: ParameterSpec, value: object) -> str:
    if spec.listed and isinstance(value, list | tuple) and all(isinstance(x, str) for x in value):
        value = ' '.join(value)
    if not isinstance(value, str):
        raise ConfigError(spec.name, value, 'give a text')
    if spec.choices and value not in spec.choices:
        raise ConfigError(spec.name, value, f'choose from {words(spec.choices)}')
    return value


def _numbers(
    name: str, value: object, quantity: Quantity, span: str, count: int
) -> tuple[float, ...]:
    allowed = f'give {span} {quantity.unit}'
    if not isinstance(value, list | tuple | array) or len(value) != count:
        raise ConfigError(name, value, allowed, quantity.name)
    try:
        return tuple(quantity.check(x) for x in value)
    except ConfigError:
        raise ConfigError(name, list(value), allowed, quantity.name) from None
