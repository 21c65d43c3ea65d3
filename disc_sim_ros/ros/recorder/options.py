"""What recorder_node records and how: its parameters, checked together, without ROS."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
import re
from typing import Any

from disc_sim_ros.bags.mcap_writer import COMPRESSIONS
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.ros.parameter_spec import ParameterSpec, checked

_MIB = 1024 * 1024
_LARGEST_MIB = 1_000_000  # a terabyte
_LONGEST = 31_536_000.0  # s, a year

RECORDER_GROUPS: Mapping[str, Sequence[ParameterSpec]] = {
    'Bag': (
        ParameterSpec(
            'bag',
            '',
            'fixed',
            'Folder to make for the bag; empty: bags/disc_DATE_TIME, here.',
            constraint='it must not exist',
        ),
        ParameterSpec(
            'max_size_mib',
            0,
            'fixed',
            'Size at which the next file of the bag begins; 0: never.',
            'MiB',
            0,
            _LARGEST_MIB,
        ),
        ParameterSpec(
            'max_duration_s',
            0.0,
            'fixed',
            'Time after which the next file of the bag begins; 0: never.',
            's',
            0.0,
            _LONGEST,
            constraint='0 or at least 0.001',
        ),
        ParameterSpec(
            'compression',
            'zstd',
            'fixed',
            'Of the chunks in the files.',
            choices=tuple(COMPRESSIONS),
        ),
        ParameterSpec(
            'flush_period',
            0.5,
            'fixed',
            'Longest time that a message waits for the disk: what a power failure may cost.',
            's',
            0.01,
            60.0,
        ),
    ),
    'What is recorded': (
        ParameterSpec(
            'topics',
            '',
            'fixed',
            'Names of topics to record, relative to the namespace of the node.',
            constraint='with spaces between, or a list',
            listed=True,
        ),
        ParameterSpec(
            'regex',
            '',
            'fixed',
            'Topics whose whole name matches are recorded; without it and `topics`, all are.',
            constraint='a regular expression of Python',
        ),
        ParameterSpec(
            'exclude',
            '',
            'fixed',
            'Topics whose whole name matches are not recorded, whatever else is said.',
            constraint='a regular expression of Python',
        ),
        ParameterSpec(
            'start_paused',
            default=False,
            effect='fixed',
            meaning='Record nothing until `~/resume` is called.',
        ),
    ),
}
RECORDER_TABLE = tuple(entry for group in RECORDER_GROUPS.values() for entry in group)


@dataclass(frozen=True, slots=True)
class Selection:
    """Which topics are recorded.

    Attributes:
        names: Full names; they are recorded also where they are hidden.
        regex: Of more names; None for none.
        exclude: Of names that are never recorded; None for none.
    """

    names: frozenset[str] = frozenset()
    regex: re.Pattern[str] | None = None
    exclude: re.Pattern[str] | None = None

    @property
    def everything(self) -> bool:
        """Whether nobody said which topics are wanted."""
        return not self.names and self.regex is None

    def takes(self, name: str) -> bool:
        """Say whether a topic is recorded; a part that begins with _ hides it, as in rosbag2."""
        if self.exclude is not None and self.exclude.fullmatch(name):
            return False
        if name in self.names:
            return True
        if '/_' in name:
            return False
        if self.regex is not None:
            return self.regex.fullmatch(name) is not None
        return self.everything

    def __str__(self) -> str:
        parts = sorted(self.names)
        if self.regex is not None:
            parts.append(f'topics like {self.regex.pattern}')
        text = ', '.join(parts) or 'all topics'
        return text if self.exclude is None else f'{text}, but not {self.exclude.pattern}'


@dataclass(frozen=True, slots=True)
class RecorderConfig:
    """All parameters of recorder_node, see RECORDER_TABLE; sizes in bytes, None for no limit."""

    bag: Path
    selection: Selection
    max_size: int | None
    max_duration: float | None
    compression: str
    flush_period: float
    start_paused: bool


def recorder_config(values: Mapping[str, object], namespace: str = '/') -> RecorderConfig:
    """Return what the parameters mean; those that are not given have their defaults.

    Args:
        values: By name.
        namespace: Of the node, in which relative names of topics are.

    Raises:
        ConfigError: A value is not allowed.
    """
    v: dict[str, Any] = checked(values, RECORDER_TABLE)
    if 0.0 < v['max_duration_s'] < 1e-3:
        raise ConfigError('max_duration_s', v['max_duration_s'], 'give 0 or at least 0.001 s')
    names = frozenset(_full_name(name, namespace) for name in v['topics'].split())
    return RecorderConfig(
        bag=Path(v['bag'] or default_bag(datetime.now().astimezone())),
        selection=Selection(names, _pattern('regex', v), _pattern('exclude', v)),
        max_size=v['max_size_mib'] * _MIB or None,
        max_duration=v['max_duration_s'] or None,
        compression=v['compression'],
        flush_period=v['flush_period'],
        start_paused=v['start_paused'],
    )


def default_bag(now: datetime) -> str:
    """Return the folder of a bag that was given no name."""
    return f'bags/disc_{now:%Y-%m-%d_%H-%M-%S}'


def _pattern(name: str, v: Mapping[str, Any]) -> re.Pattern[str] | None:
    try:
        return re.compile(v[name]) if v[name] else None
    except re.error as error:
        raise ConfigError(name, v[name], f'not a regular expression: {error}') from None


def _full_name(name: str, namespace: str) -> str:
    if not re.fullmatch(r'/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*', name):
        raise ConfigError('topics', name, 'names have letters, digits, _ and /, such as /odom')
    return name if name.startswith('/') else f'{namespace.rstrip("/")}/{name}'
