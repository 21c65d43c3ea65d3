"""What the programs' command lines have in common: numbers with a range, errors of one line."""

import argparse
from collections.abc import Callable
import re
import sys
from typing import Any, NoReturn

from disc_sim_ros.core import check
from disc_sim_ros.core.errors import ConfigError

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
        sys.stderr.write(f'{self.prog}: error: {text}\n')
        sys.exit(2)


def number(lowest: float, highest: float, unit: str) -> Callable[[str], float]:
    """Return a converter of command-line text to a number in [lowest, highest]."""

    def convert(text: str) -> float:
        try:
            value: float | str = float(text)
        except ValueError:
            value = text
        try:
            return check.number('', value, lowest, highest, unit=unit)
        except ConfigError as error:
            raise argparse.ArgumentTypeError(str(error).removeprefix(': ')) from None

    return convert
