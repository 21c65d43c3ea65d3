"""Message definitions and type hashes from the installed interface files, without ROS."""

from collections.abc import Callable
from functools import cache
from importlib import metadata
import json
import os
from pathlib import Path
import re
import sys

_TYPE = re.compile(r'([A-Za-z]\w*)/(?:(msg|srv|action)/)?([A-Za-z]\w*)')
_FIELD = re.compile(r'\s*([A-Za-z0-9_/]+)(?:\[[^\]]*\])?\s')
_PRIMITIVES = frozenset(
    ['bool', 'byte', 'char', 'float32', 'float64', 'string', 'wstring']
    + [f'{sign}int{bits}' for sign in ('', 'u') for bits in (8, 16, 32, 64)]
)
_RULE = '=' * 80
_SECTION = re.compile(r'^---[ \t]*\r?\n?', re.MULTILINE)
_DISTRO = re.compile(r'ros-([a-z]+)-rclpy')
_EVENT = (
    'service_msgs/ServiceEventInfo info\n{0}_Request[<=1] request\n{0}_Response[<=1] response\n'
)
_GOAL_ID = 'unique_identifier_msgs/UUID goal_id\n'
# What rosidl makes of an interface file: the end of the type's name, and its definition from the
# name and the sections of the file (ROS 2 design, "Interface definition" and "Actions").
_Maker = Callable[[str, list[str]], str]
_MADE: dict[str, dict[str, _Maker]] = {
    'srv': {
        '_Request': lambda _, parts: parts[0],
        '_Response': lambda _, parts: parts[1],
        '_Event': lambda name, _: _EVENT.format(name),
    },
    'action': {
        '_Goal': lambda _, parts: parts[0],
        '_Result': lambda _, parts: parts[1],
        '_Feedback': lambda _, parts: parts[2],
        '_SendGoal_Request': lambda name, _: f'{_GOAL_ID}{name}_Goal goal\n',
        '_SendGoal_Response': lambda *_: 'bool accepted\nbuiltin_interfaces/Time stamp\n',
        '_SendGoal_Event': lambda name, _: _EVENT.format(f'{name}_SendGoal'),
        '_GetResult_Request': lambda *_: _GOAL_ID,
        '_GetResult_Response': lambda name, _: f'int8 status\n{name}_Result result\n',
        '_GetResult_Event': lambda name, _: _EVENT.format(f'{name}_GetResult'),
        '_FeedbackMessage': lambda name, _: f'{_GOAL_ID}{name}_Feedback feedback\n',
    },
}


@cache
def definition(type_name: str) -> str | None:
    """Return the definition of a message type with all that it holds, as ros2msg text.

    The text of its .msg file, then each type it holds, depth first, each once and the types of
    one message in alphabetical order, under a line of 80 `=` and a line `MSG: package/Type`.
    Messages that rosidl makes of a .srv or .action file, such as the events of a service, get the
    text that their .msg file would have.

    Args:
        type_name: Such as 'nav_msgs/msg/Odometry', 'nav_msgs/Odometry' or
            'std_srvs/srv/Trigger_Event'.

    Returns:
        The text ('' of a type without fields), or None where the type or one that it holds is not
        installed.
    """
    done: set[str] = set()

    def text_of(name: str) -> str | None:
        text = _own_text(name)
        if text is None:
            return None
        parts = [text]
        for held in _held_types(text, name.split('/', 1)[0]):
            if held not in done:
                done.add(held)
                inner = text_of(held)
                if inner is None:
                    return None
                parts.append(f'\n{_RULE}\nMSG: {held}\n{inner}')
        return ''.join(parts)

    return text_of(type_name)


@cache
def type_hash(type_name: str) -> str | None:
    """Return the hash `RIHS01_...` of an installed message type, or None."""
    match = _TYPE.fullmatch(type_name)
    if match is None or match[2] is None:
        return None
    package, kind, name = match.groups()
    for base in (name, *(name.removesuffix(end) for end in _MADE.get(kind, ()))):
        path = _find(package, kind, f'{base}.json')
        try:
            hashes = json.loads(path.read_text(encoding='utf-8'))['type_hashes'] if path else ()
            return next(str(h['hash_string']) for h in hashes if h['type_name'] == type_name)
        except (OSError, ValueError, KeyError, TypeError, StopIteration):
            continue
    return None


@cache
def ros_distro() -> str:
    """Return the name of the ROS distribution in use, such as 'jazzy'; '' where none is known.

    The environment says it, or else the name of the package that brought rclpy.
    """
    named = os.environ.get('ROS_DISTRO')
    if named:
        return named
    for installed in metadata.distributions():
        match = _DISTRO.fullmatch(str(installed.metadata['Name']).lower().replace('_', '-'))
        if match:
            return match[1]
    return ''


def prefixes() -> list[Path]:
    """Return the folders in which ROS is installed: AMENT_PREFIX_PATH, else this Python's."""
    named = [p for p in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if p]
    return [Path(p) for p in [*named, sys.prefix]]


def _find(package: str, kind: str, file_name: str) -> Path | None:
    for prefix in prefixes():
        path = prefix / 'share' / package / kind / file_name
        if path.is_file():
            return path
    return None


def _own_text(type_name: str) -> str | None:
    """Return the definition of a type without those that it holds, or None."""
    match = _TYPE.fullmatch(type_name)
    if match is None:
        return None
    package, kind, name = match.groups()
    path = _find(package, 'msg', f'{name}.msg') if kind in {None, 'msg'} else None
    if path is not None:
        return path.read_text(encoding='utf-8')
    for source, made in _MADE.items():
        for end, maker in made.items() if kind in {None, source} else ():
            base = name.removesuffix(end)
            path = _find(package, source, f'{base}.{source}') if base != name else None
            if path is not None:
                parts = _SECTION.split(path.read_text(encoding='utf-8'))
                return maker(base, [*parts, '', ''])
    return None


def _held_types(text: str, package: str) -> list[str]:
    """Return the names of the types of the fields in a .msg text, sorted, without primitives."""
    names = {m[1] for line in text.splitlines() if (m := _FIELD.match(f'{line}\n'))}
    return sorted(n if '/' in n else f'{package}/{n}' for n in names - _PRIMITIVES)
