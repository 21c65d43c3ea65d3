"""The parameters of recorder_node, checked together, without ROS."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
import re
from typing import Any

from disc_sim_ros.bags.mcap_writer import COMPRESSIONS
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.quantities import BAG_FILES, RECORDING
from disc_sim_ros.ros.parameter_spec import ParameterSpec, checked, spec_of

_MIB = 1024 * 1024
_SHORTEST_FILE = BAG_FILES['file_duration'].lowest  # s

RECORDER_GROUPS: Mapping[str, Sequence[ParameterSpec]] = {
    'Bag': (
        ParameterSpec(
            'bag',
            '',
            'fixed',
            'New folder for the bag; empty: bags/disc_DATE_TIME in the current folder.',
            constraint='it must not exist',
        ),
        spec_of(RECORDING['max_size'], 'fixed', 'max_size_mib'),
        spec_of(
            RECORDING['max_duration'],
            'fixed',
            'max_duration_s',
            f'0 or at least {_SHORTEST_FILE:g}',
        ),
        ParameterSpec(
            'compression',
            'zstd',
            'fixed',
            'Compression of the chunks in the files.',
            choices=tuple(COMPRESSIONS),
        ),
        spec_of(RECORDING['flush_period'], 'fixed'),
        ParameterSpec(
            'repeat_latched',
            default=True,
            effect='fixed',
            meaning='Begin each further file with the last messages of latched topics.',
        ),
    ),
    'What is recorded': (
        ParameterSpec(
            'topics',
            '',
            'fixed',
            'Names of topics to record, relative to the namespace of the node.',
            constraint='separated by spaces, or a list',
            listed=True,
        ),
        ParameterSpec(
            'regex',
            '',
            'fixed',
            'Topics whose whole name matches are recorded; with this and `topics` empty, all are.',
            constraint='a regular expression of Python',
        ),
        ParameterSpec(
            'exclude',
            '',
            'fixed',
            'Topics whose whole name matches are never recorded.',
            constraint='a regular expression of Python',
        ),
        ParameterSpec(
            'start_paused',
            default=False,
            effect='fixed',
            meaning='Do not record until `~/resume` is called.',
        ),
    ),
}
RECORDER_TABLE = tuple(spec for group in RECORDER_GROUPS.values() for spec in group)


@dataclass(frozen=True, slots=True)
class Selection:
    """The choice of topics to record.

    Attributes:
        names: Full names; hidden topics among them are recorded, too.
        regex: Pattern of further names, or None.
        exclude: Pattern of names that are never recorded, or None.
    """

    names: frozenset[str] = frozenset()
    regex: re.Pattern[str] | None = None
    exclude: re.Pattern[str] | None = None

    @property
    def everything(self) -> bool:
        """Return True if neither names nor a pattern choose topics."""
        return not self.names and self.regex is None

    def takes(self, name: str) -> bool:
        """Return True if a topic is recorded.

        As in rosbag2, a topic is hidden if a part of its name begins with _.
        """
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
    may_rename: bool  # the name is the default: another recorder may have taken it
    selection: Selection
    max_size: int | None
    max_duration: float | None
    compression: str
    flush_period: float
    repeat_latched: bool
    start_paused: bool


def recorder_config(values: Mapping[str, object], namespace: str = '/') -> RecorderConfig:
    """Return the configuration from the values of parameters, with defaults for the others.

    Args:
        values: Values by name of the parameter.
        namespace: Namespace of the node; relative names of topics are in it.

    Raises:
        ConfigError: A value is not allowed.
    """
    v: dict[str, Any] = checked(values, RECORDER_TABLE)
    if 0.0 < v['max_duration_s'] < _SHORTEST_FILE:
        allowed = f'give 0 or at least {_SHORTEST_FILE:g} s'
        raise ConfigError('max_duration_s', v['max_duration_s'], allowed, 'max_duration')
    names = frozenset(_full_name(name, namespace) for name in v['topics'].split())
    return RecorderConfig(
        bag=Path(v['bag'] or default_bag(datetime.now().astimezone())),
        may_rename=not v['bag'],
        selection=Selection(names, _pattern('regex', v), _pattern('exclude', v)),
        max_size=v['max_size_mib'] * _MIB or None,
        max_duration=v['max_duration_s'] or None,
        compression=v['compression'],
        flush_period=v['flush_period'],
        repeat_latched=v['repeat_latched'],
        start_paused=v['start_paused'],
    )


def default_bag(now: datetime) -> str:
    """Return the default folder of a bag."""
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
