"""Every exception class of the package; each message is one line that a user can act on."""

import re
import reprlib
from typing import Self

_LONGEST = 80  # characters
_SHORT = reprlib.Repr()
_SHORT.maxlevel = 2
_SHORT.maxstring = _SHORT.maxother = 60
# Characters that move the cursor, colour, or turn the direction of a text.
_CONTROLS = re.compile('[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]')
_CONTROLS_IN_LINES = re.compile('[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]')


class DiscSimError(Exception):
    """Base class of every error that this package raises on purpose."""

    def __init__(self, message: str) -> None:
        """Keep the message, with control characters escaped: a bag or a file may name things."""
        super().__init__(printable(message))


class ConfigError(DiscSimError, ValueError):
    """A value from a user (a flag, a YAML key, a parameter, an argument) is not allowed.

    Attributes:
        thing: The name under which the user gave the value.
        value: The refused value.
        allowed: What is allowed, a part of a sentence.
        quantity: Name of the quantity in the table `disc_sim_ros.quantities`, or empty. A command
            line, a node or a file reader replaces `thing` by its own name of the quantity.
    """

    def __init__(self, thing: str, value: object, allowed: str, quantity: str = '') -> None:
        """Write the message from the `thing`, its `value` and what is `allowed`."""
        self.thing = thing
        self.value = value
        self.allowed = allowed
        self.quantity = quantity
        super().__init__(f'{thing}: {brief(value)} is not allowed; {allowed}')

    def __reduce__(self) -> tuple[type[Self], tuple[str, object, str, str]]:
        """Return what another process needs to build the same error."""
        return type(self), (self.thing, self.value, self.allowed, self.quantity)

    def named(self, thing: str) -> 'ConfigError':
        """Return the same error under another name of the thing."""
        return ConfigError(thing, self.value, self.allowed, self.quantity)


class IntegrationError(DiscSimError, ArithmeticError):
    """A flight left the range of numbers that the integration can follow."""


class InterruptedSweepError(DiscSimError):
    """A worker died. Finished flights are kept, and a resumed run continues from them."""


class BagError(DiscSimError):
    """A bag cannot be written, read or repaired; the message says which bag, where and why."""


class DamageError(BagError):
    """The bytes of a part of a file contradict the format or the checksum."""


class WriteError(BagError):
    """The operating system refuses to write a bag.

    Attributes:
        reason: The reason of the system, without the name of the bag.
    """

    def __init__(self, message: str, reason: str) -> None:
        """Keep the message and its `reason`."""
        self.reason = reason
        super().__init__(message)


def printable(text: str, *, lines: bool = False) -> str:
    """Return text with control characters escaped, so that a bag does not command the terminal.

    Args:
        text: Such as the name of a topic.
        lines: Keep newlines and tabs.
    """
    controls = _CONTROLS_IN_LINES if lines else _CONTROLS
    return controls.sub(lambda match: match[0].encode('unicode_escape').decode(), text)


def brief(value: object) -> str:
    """Return `value` as one short line, however large or deeply nested it is."""
    if isinstance(value, float):
        return f'{value:.12g}'
    try:
        text = ' '.join(_SHORT.repr(value).split())
    except ValueError:  # Python does not print whole numbers of thousands of digits
        return 'a number of thousands of digits'
    return text if len(text) <= _LONGEST else f'{text[: _LONGEST - 3]}...'
