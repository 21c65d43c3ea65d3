"""What a parameter of a node is, and how its values are checked, without ROS."""

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import difflib
import math
from typing import Any, Literal

from disc_sim_ros import validation
from disc_sim_ros.errors import ConfigError

Value = bool | int | float | str | tuple[float, ...]
Effect = Literal['next throw', 'at once', 'fixed']


@dataclass(frozen=True, slots=True)
class ParameterSpec:
    """One parameter. The type of its default is its type; a tuple is an array of doubles.

    Attributes:
        name: Its name in ROS.
        default: Its value unless another is given.
        effect: When a change counts; what is 'fixed' is read-only.
        meaning: A sentence.
        unit: Of a number, and of its range.
        lowest: Least allowed number.
        highest: Greatest allowed number.
        choices: Allowed words; any text where empty.
        constraint: What else is asked for, a part of a sentence.
        listed: Whether a text holds words with spaces between; a list of texts will do, too.
    """

    name: str
    default: Value
    effect: Effect
    meaning: str
    unit: str = ''
    lowest: float = -math.inf
    highest: float = math.inf
    choices: Sequence[str] = ()
    constraint: str = ''
    listed: bool = False


def checked(values: Mapping[str, object], table: Sequence[ParameterSpec]) -> dict[str, Any]:
    """Return a value for every parameter, each in its own range: those given, else defaults.

    Raises:
        ConfigError: A name that is not in the table, a wrong type or a value out of range.
    """
    names = [entry.name for entry in table]
    for name, value in values.items():
        if name not in names:
            raise ConfigError(name, value, no_such(name, names))
    return {entry.name: _clean(entry, values.get(entry.name, entry.default)) for entry in table}


def allowed_text(entry: ParameterSpec) -> str:
    """Return the range or the words of a parameter, as part of a sentence."""
    match entry.default:
        case bool():
            return 'true or false'
        case str():
            return words(entry.choices)
        case tuple():
            return f'{len(entry.default)} numbers from {entry.lowest:g} to {entry.highest:g}'
        case int():
            return f'{entry.lowest} to {entry.highest}'
    return f'{entry.lowest:g} to {entry.highest:g}'


def words(choices: Sequence[str]) -> str:
    """Return words with commas between them; the empty one as a pair of quotes."""
    return ', '.join(word or "''" for word in choices)


def plain(value: Value) -> bool | int | float | str | list[float]:
    """Return a value as YAML and rclpy know it."""
    return list(value) if isinstance(value, tuple) else value


def no_such(name: str, names: Sequence[str]) -> str:
    """Return that there is no parameter of this name, and which may be meant."""
    tails = [known for known in names if known.endswith(f'.{name}')]
    close = tails or difflib.get_close_matches(name, names, n=1)
    guess = f', did you mean {" or ".join(close)}?' if close else ''
    return f'there is no such parameter{guess}'


def _clean(entry: ParameterSpec, value: object) -> Value:
    """Return a value as the type of the parameter; a whole number is a double where one is due."""
    name = entry.name
    match entry.default:
        case bool() if isinstance(value, bool):
            return value
        case bool():
            raise ConfigError(name, value, 'give true or false')
        case int():
            return _whole_number(entry, value)
        case float():
            return validation.number(name, value, entry.lowest, entry.highest, unit=entry.unit)
        case str():
            return _text(entry, value)
    return _numbers(entry, value, len(entry.default))


def _whole_number(entry: ParameterSpec, value: object) -> int:
    match value:
        case bool():
            pass
        case int() if entry.lowest <= value <= entry.highest:
            return value
    raise ConfigError(entry.name, value, f'give a whole number from {allowed_text(entry)}')


def _text(entry: ParameterSpec, value: object) -> str:
    if entry.listed and isinstance(value, list | tuple) and all(isinstance(x, str) for x in value):
        value = ' '.join(value)
    if not isinstance(value, str):
        raise ConfigError(entry.name, value, 'give a text')
    if entry.choices and value not in entry.choices:
        raise ConfigError(entry.name, value, f'choose from {words(entry.choices)}')
    return value


def _numbers(entry: ParameterSpec, value: object, count: int) -> tuple[float, ...]:
    allowed = f'give {allowed_text(entry)} {entry.unit}'
    if not isinstance(value, list | tuple | array) or len(value) != count:
        raise ConfigError(entry.name, value, allowed)
    try:
        return tuple(validation.number('', x, entry.lowest, entry.highest) for x in value)
    except ConfigError:
        raise ConfigError(entry.name, list(value), allowed) from None
