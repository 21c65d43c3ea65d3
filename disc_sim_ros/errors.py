"""Errors that this package raises on purpose; each carries one line that a user can act on."""

import reprlib
from typing import Self

_LONGEST = 80  # characters
_SHORT = reprlib.Repr()
_SHORT.maxlevel = 2
_SHORT.maxstring = _SHORT.maxother = 60


class DiscSimError(Exception):
    """Base of every error raised on purpose."""


class ConfigError(DiscSimError, ValueError):
    """A value from a user (a flag, a YAML key, a parameter) is not allowed."""

    def __init__(self, thing: str, value: object, allowed: str) -> None:
        """Name the `thing`, the `value` it had and what is `allowed`."""
        self.thing = thing
        self.value = value
        self.allowed = allowed
        super().__init__(f'{thing}: {brief(value)} is not allowed; {allowed}')

    def __reduce__(self) -> tuple[type[Self], tuple[str, object, str]]:
        """Let it come home from another process, which hands over the arguments."""
        return type(self), (self.thing, self.value, self.allowed)


class IntegrationError(DiscSimError, ArithmeticError):
    """A flight left the range of numbers that the integration can follow."""


def brief(value: object) -> str:
    """Return `value` as one short line, however large, deep or odd it is."""
    if isinstance(value, float):
        return f'{value:.12g}'
    try:
        text = ' '.join(_SHORT.repr(value).split())
    except ValueError:  # Python does not write out whole numbers of thousands of digits
        return 'a number of thousands of digits'
    return text if len(text) <= _LONGEST else f'{text[: _LONGEST - 3]}...'


class BagError(DiscSimError):
    """A bag cannot be written, read or repaired; one line says which, where and why."""


class DamageError(BagError):
    """A part of a file is not what it says it is."""


class WriteError(BagError):
    """The system refuses to write a bag."""

    def __init__(self, message: str, reason: str) -> None:
        """Keep the `reason` alone too."""
        self.reason = reason
        super().__init__(message)
