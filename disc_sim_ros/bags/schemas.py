"""Message definitions and type hashes from the installed .msg and .json files, without ROS."""

from functools import cache
import json
import os
from pathlib import Path
import re
import sys

_TYPE = re.compile(r'([A-Za-z]\w*)/(?:(msg|srv)/)?([A-Za-z]\w*)')
_FIELD = re.compile(r'\s*([A-Za-z0-9_/]+)(?:\[[^\]]*\])?\s')
_PRIMITIVES = frozenset(
    ['bool', 'byte', 'char', 'float32', 'float64', 'string', 'wstring']
    + [f'{sign}int{bits}' for sign in ('', 'u') for bits in (8, 16, 32, 64)]
)
_RULE = '=' * 80


@cache
def definition(type_name: str) -> str | None:
    """Return the definition of a message type with all that it holds, as ros2msg text.

    The text of its .msg file, then each type it holds, depth first, each once and the types of
    one message in alphabetical order, under a line of 80 `=` and a line `MSG: package/Type`.

    Args:
        type_name: Such as 'nav_msgs/msg/Odometry' or 'nav_msgs/Odometry'.

    Returns:
        The text, or None where the type or one that it holds is not installed.
    """
    seen: set[str] = set()

    def text_of(name: str) -> str | None:
        path = _find(name, '.msg')
        if path is None:
            return None
        text = path.read_text(encoding='utf-8')
        parts = [text]
        for held in _held(text, name.split('/', 1)[0]):
            if held not in seen:
                seen.add(held)
                inner = text_of(held)
                if inner is None:
                    return None
                parts.append(f'\n{_RULE}\nMSG: {held}\n{inner}')
        return ''.join(parts)

    return text_of(type_name)


@cache
def type_hash(type_name: str) -> str | None:
    """Return the hash `RIHS01_...` of an installed message type, or None."""
    path = _find(type_name, '.json')
    if path is None:
        return None
    try:
        hashes = json.loads(path.read_text(encoding='utf-8'))['type_hashes']
        package, kind, name = type_name.split('/')
        full = f'{package}/{kind}/{name}'
        return next(str(h['hash_string']) for h in hashes if h['type_name'] == full)
    except (ValueError, KeyError, TypeError, StopIteration):
        return None


def prefixes() -> list[Path]:
    """Return the folders in which ROS is installed: AMENT_PREFIX_PATH, else this Python's."""
    named = [p for p in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if p]
    return [Path(p) for p in [*named, sys.prefix]]


def _find(type_name: str, suffix: str) -> Path | None:
    match = _TYPE.fullmatch(type_name)
    if match is None:
        return None
    package, kind, name = match[1], match[2] or 'msg', match[3]
    for prefix in prefixes():
        path = prefix / 'share' / package / kind / (name + suffix)
        if path.is_file():
            return path
    return None


def _held(text: str, package: str) -> list[str]:
    """Return the names of the types of the fields in a .msg text, sorted, without primitives."""
    names = {m[1] for line in text.splitlines() if (m := _FIELD.match(f'{line}\n'))}
    return sorted(n if '/' in n else f'{package}/{n}' for n in names - _PRIMITIVES)
