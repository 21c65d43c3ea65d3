"""What the programs' command lines have in common: numbers with a range, errors of one line."""

import argparse
from collections.abc import Callable
import re
from typing import Any, NoReturn

from disc_sim_ros import validation
from disc_sim_ros.errors import ConfigError

# argparse takes only -1 and -1.5 for numbers, and would read -1e-3 or -inf as a flag.
_NEGATIVE = re.compile(r'^-(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?$|^-(inf|infinity|nan)$', re.I)


class Parser(argparse.ArgumentParser):
    """A parser that knows no abbreviations and says what is wrong in one line."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(
            allow_abbrev=False, formatter_class=argparse.ArgumentDefaultsHelpFormatter, **kwargs
        )
        self._negative_number_matcher = _NEGATIVE

    def error(self, message: str) -> NoReturn:
        """End with code 2 and one line on stderr."""
        text = ' '.join(message.removeprefix('argument ').split())
        self.exit(2, f'{self.prog}: error: {text}\n')

    def _match_argument(self, action: argparse.Action, arg_strings_pattern: str) -> int:
        """Say also what a flag without its value is for, which holds the allowed range."""
        try:
            return super()._match_argument(action, arg_strings_pattern)
        except argparse.ArgumentError as error:
            raise argparse.ArgumentError(action, f'{error.message}; {action.help}') from None


def number(lowest: float, highest: float, unit: str) -> Callable[[str], float]:
    """Return a converter of command-line text to a number in [lowest, highest]."""

    def convert(text: str) -> float:
        try:
            value: float | str = text if '_' in text else float(text)  # not 1_5 for 1.5
        except ValueError:
            value = text
        try:
            return validation.number('', value, lowest, highest, unit=unit)
        except ConfigError as error:
            raise argparse.ArgumentTypeError(str(error).removeprefix(': ')) from None

    return convert
