"""Command lines: a strict parser, and flags whose text and range come from a quantity."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
import os
import re
from typing import Any, NoReturn

from disc_sim_ros import units, validation
from disc_sim_ros.errors import ConfigError, brief, printable
from disc_sim_ros.validation import Quantity

# argparse takes only -1 and -1.5 for numbers, and would read -1e-3, -5mph or -inf as a flag.
_NEGATIVE = re.compile(
    r'^-(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?( ?[a-z°/^0-9]+)?$|^-(inf|infinity|nan)$', re.I
)


class _HelpFormatter(argparse.HelpFormatter):
    """Adds the default of each flag that has a value to its help, unless the help tells it."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        text, value = action.help, action.default
        if text is None or '(default' in text or value is None or value is argparse.SUPPRESS:
            return text
        if action.nargs == 0 or isinstance(value, bool):
            return text
        values = value if isinstance(value, list | tuple) else [value]
        numbers = ' '.join(f'{x:g}' if isinstance(x, float) else str(x) for x in values)
        return f'{text} (default: {numbers.replace("%", "%%")})'


class Parser(argparse.ArgumentParser):
    """A parser that refuses abbreviations and reports an error in one line."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(allow_abbrev=False, formatter_class=_HelpFormatter, **kwargs)
        self._negative_number_matcher = _NEGATIVE

    def error(self, message: str) -> NoReturn:
        """End with code 2 and one line on stderr."""
        text = printable(' '.join(message.removeprefix('argument ').split()))
        self.exit(2, f'{self.prog}: error: {text}\n')

    def in_flags(self, error: ConfigError) -> ConfigError:
        """Return an error under the name of the flag that gave the refused value.

        The flag is found by the quantity of the error, by its thing, or by the first word of the
        thing, each of which may be the `dest` of a flag: 'vary speed' becomes '--vary speed'. An
        error that no flag gave is returned unchanged.
        """
        first, _, rest = error.thing.partition(' ')
        for name, tail in ((error.quantity, ''), (error.thing, ''), (first, f' {rest}')):
            flag = self.flag_of(name)
            if flag:
                return error.named(f'{flag}{tail}')
        return error

    def flag_of(self, name: str) -> str:
        """Return the flag that gives a quantity or has this `dest`; empty if none does."""
        for action in self._actions:
            names = {action.dest}
            if isinstance(action.type, FromText):
                names |= {quantity.name for quantity in action.type.quantities}
            if action.option_strings and name and name in names:
                return action.option_strings[-1]
        return ''

    def _match_argument(self, action: argparse.Action, arg_strings_pattern: str) -> int:
        """Report the help text, with the range, of a flag that lacks its value."""
        try:
            return super()._match_argument(action, arg_strings_pattern)
        except argparse.ArgumentError as error:
            raise argparse.ArgumentError(action, f'{error.message}; {action.help}') from None


@dataclass(frozen=True)
class FromText:
    """Converts text of a command line to a number in the range of a quantity.

    Attributes:
        quantities: The quantity, or one for each component of the flag, all with one range.
    """

    quantities: tuple[Quantity, ...]

    def __call__(self, text: str) -> float | int:
        """Return the number.

        Raises:
            argparse.ArgumentTypeError: The text is not a number, or out of range.
        """
        quantity = self.quantities[0]
        number: float | int
        try:
            number = quantity.check(_whole(text) if quantity.whole else _in_unit(text, quantity))
        except ConfigError as error:
            shown = brief(text if quantity.whole else error.value)
            message = f'{shown} is not allowed; {error.allowed}'
            raise argparse.ArgumentTypeError(message) from None
        return number


def path(text: str) -> str:
    """Return a path with a leading `~` as the home folder: a shell keeps it after a `=`."""
    return os.path.expanduser(text)  # noqa: PTH111 - a Path would change 'a/', which is a folder


def number(lowest: float, highest: float, unit: str) -> FromText:
    """Return a converter of text to a number in [lowest, highest], for a flag without quantity."""
    return FromText((Quantity('', unit, lowest, highest, None, ''),))


def whole(lowest: int, highest: int) -> FromText:
    """Return a converter of text to a whole number, for a flag without quantity."""
    return FromText((Quantity('', '', lowest, highest, None, '', whole=True),))


def add_quantity(
    group: argparse._ActionsContainer,
    flag: str,
    quantity: Quantity,
    *,
    dest: str = '',
    metavar: str = '',
    text: str = '',
    **options: Any,
) -> None:
    """Add a flag that gives a quantity.

    Args:
        group: The parser or the group.
        flag: The flag.
        quantity: Gives the range, the unit, the default and the meaning.
        dest: Name of the value in the namespace; empty for the name of the quantity.
        metavar: Name of the value in the help text; empty for the unit.
        text: Meaning in the help text; empty for that of the quantity.
        options: Further arguments of `add_argument`, such as another default.
    """
    group.add_argument(
        flag,
        dest=dest or quantity.name,
        type=FromText((quantity,)),
        metavar=metavar or _metavar(quantity),
        help=f'{text or help_text(quantity)}; {range_text(quantity)}'.replace('%', '%%'),
        **{'default': quantity.default} | options,
    )


def add_components(
    group: argparse._ActionsContainer,
    flag: str,
    quantities: Sequence[Quantity],
    metavar: tuple[str, ...],
    text: str,
    **options: Any,
) -> None:
    """Add a flag that gives several quantities of one range, such as the components of a vector.

    Args:
        group: The parser or the group.
        flag: The flag.
        quantities: The quantities in the order of the numbers.
        metavar: Names of the numbers in the help text.
        text: The meaning.
        options: Further arguments of `add_argument`, such as another default.
    """
    group.add_argument(
        flag,
        nargs=len(quantities),
        type=FromText(tuple(quantities)),
        metavar=metavar,
        help=f'{text}; {range_text(quantities[0])} each',
        **{'default': tuple(quantity.default for quantity in quantities)} | options,
    )


def help_text(quantity: Quantity) -> str:
    """Return the meaning of a quantity as a help text: no capital, no full stop."""
    meaning = quantity.meaning.removesuffix('.').replace('`', '')
    return meaning[0].lower() + meaning[1:]


def range_text(quantity: Quantity) -> str:
    """Return the range of a quantity as a help text states it: 'from 0 to 200 m/s'."""
    number = 'a whole number ' if quantity.whole else ''
    return f'{number}from {quantity.span} {quantity.unit}'.rstrip()


def _metavar(quantity: Quantity) -> str:
    if quantity.whole:
        return 'N'
    return {'': 'X', 'degrees': 'DEG'}.get(quantity.unit, quantity.unit.upper().replace('^', ''))


def _in_unit(text: str, quantity: Quantity) -> float | str:
    """Return the number of a text such as '60mph', in the unit of the quantity.

    Raises:
        ConfigError: The unit does not fit the quantity.
    """
    digits, unit = units.split(text)
    if not unit:
        return validation.as_number(text)
    number = validation.as_number(digits)
    factor = units.UNITS.get(quantity.unit, {}).get(unit)
    if factor is None and isinstance(number, float):
        allowed = units.spellings(quantity.unit)
        also = f', in {allowed}' if allowed else ''
        raise ConfigError('', text, f'{quantity.allowed}{also}')
    return text if factor is None or isinstance(number, str) else number * factor


def _whole(text: str) -> int | str:
    """Return text as a whole number without sign; as text where it is none, or absurdly long."""
    return int(text) if text.isascii() and text.isdigit() and len(text) < 100 else text
