"""Arguments of the launch files: names that do not collide with those of other launch files."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
import sys

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.validation import Quantity, as_number

OWN = 'sim.'  # before parameters such as `model`, which other launch files have as arguments


def argument_of(parameter: str) -> str:
    """Return the launch argument of a parameter of sim_node: 'launch.speed', but 'sim.disc'."""
    return parameter if '.' in parameter else OWN + parameter


def number(name: str, text: str, quantity: Quantity) -> float:
    """Return the number that an argument states.

    Raises:
        ConfigError: It is no number, or out of the range of the quantity.
    """
    checked: float = quantity.check(as_number(text), name)
    return checked


def is_started_directly(file: str) -> bool:
    """Return True if `ros2 launch` was called for a launch file, not for one that includes it."""
    return any(Path(word).name == Path(file).name for word in sys.argv[1:])


def refuse_unknown(argv: Sequence[str], known: Iterable[str], *, direct: bool) -> None:
    """Refuse misspelt arguments, which launch accepts silently.

    Args:
        argv: The arguments of `ros2 launch`, NAME:=VALUE.
        known: Names of the arguments that exist.
        direct: All arguments are for this file. Otherwise only those with a prefix of this
            package, such as 'launch.', must be known: others may be for the including file.

    Raises:
        ConfigError: An argument is not known.
    """
    names = set(known)
    prefixes = {f'{name.partition(".")[0]}.' for name in names if '.' in name}
    for word in argv:
        name, assigns, value = word.partition(':=')
        own = any(name.startswith(prefix) for prefix in prefixes)
        if not assigns or name in names or not (direct or own):
            continue
        near = get_close_matches(name, names, n=1) or get_close_matches(OWN + name, names, n=1)
        hint = f'did you mean {near[0]}; ' if near else ''
        raise ConfigError(name, value, f'no such argument; {hint}--show-args lists them')
