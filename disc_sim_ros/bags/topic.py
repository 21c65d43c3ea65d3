"""Topics as a bag describes them, with the quality of service of their publishers."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from disc_sim_ros.errors import BagError
from disc_sim_ros.units import NANOSECONDS

# The C one is many times faster; not every build of PyYAML has it.
LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
# What reading a YAML document of somebody else raises; int(inf) is an OverflowError.
MALFORMED = (
    yaml.YAMLError,
    KeyError,
    TypeError,
    ValueError,
    AttributeError,
    OverflowError,
    RecursionError,
)
INFINITE = 9223372036854775807  # ns: 9223372036 s and 854775807 ns, rmw's RMW_DURATION_INFINITE
_FOXY_INFINITE = ((2147483647, 4294967295), (2147483647, 2147483647))  # sec, nsec in old bags

# rmw/types.h: the place of a word is its number; bags before Jazzy hold numbers.
HISTORY = ('system_default', 'keep_last', 'keep_all', 'unknown')
RELIABILITY = ('system_default', 'reliable', 'best_effort', 'unknown', 'best_available')
DURABILITY = ('system_default', 'transient_local', 'volatile', 'unknown', 'best_available')
LIVELINESS = (
    'system_default',
    'automatic',
    'manual_by_node',
    'manual_by_topic',
    'unknown',
    'best_available',
)
_WORDS = {
    'history': HISTORY,
    'reliability': RELIABILITY,
    'durability': DURABILITY,
    'liveliness': LIVELINESS,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Qos:
    """One offered profile. Durations are whole nanoseconds, `INFINITE` for none."""

    history: str = 'keep_last'
    depth: int = 10
    reliability: str = 'reliable'
    durability: str = 'volatile'
    deadline: int = INFINITE
    lifespan: int = INFINITE
    liveliness: str = 'automatic'
    liveliness_lease_duration: int = INFINITE
    avoid_ros_namespace_conventions: bool = False

    def __post_init__(self) -> None:
        for name, words in _WORDS.items():
            if getattr(self, name) not in words:
                raise BagError(
                    f'QoS {name} {getattr(self, name)!r} is unknown; known are {", ".join(words)}'
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """A topic with all that is needed to read and to play back its messages.

    Attributes:
        name: Such as '/odom'.
        type: Such as 'nav_msgs/msg/Odometry'; '' where the bag names none.
        definition: Text of the type and of all types that it holds; '' of a type without fields,
            None where there is none.
        type_hash: 'RIHS01_...', or ''.
        qos: Offered, one profile for each publisher.
        serialization_format: Encoding of the messages.
        definition_encoding: Of `definition`; 'ros2idl' and others in bags of other recorders.
    """

    name: str
    type: str
    definition: str | None = None
    type_hash: str = ''
    qos: tuple[Qos, ...] = ()
    serialization_format: str = 'cdr'
    definition_encoding: str = 'ros2msg'

    @property
    def latched(self) -> bool:
        """True if a publisher sends its last messages to subscriptions that come later."""
        return any(profile.durability == 'transient_local' for profile in self.qos)


def full_type(name: str) -> str:
    """Return a type with its middle part, 'nav_msgs/msg/Odometry' for 'nav_msgs/Odometry'.

    Some recorders write the short name, which ROS 1 had.
    """
    package, _, rest = name.partition('/')
    return f'{package}/msg/{rest}' if rest and '/' not in rest else name


def qos_yaml(profiles: Iterable[Qos]) -> str:
    """Return profiles as the YAML list that rosbag2 Jazzy keeps; `[]` for none."""
    return '\n'.join('\n'.join(_item(profile)) for profile in profiles) or '[]'


def parse_qos(text: str) -> tuple[Qos, ...]:
    """Return the profiles of a YAML list, also of the older ones with numbers for words.

    Raises:
        BagError: It is no such list.
    """
    try:
        return qos_profiles(yaml.load(text, Loader=LOADER) or [])  # noqa: S506 - a safe one
    except MALFORMED as error:
        raise BagError(f'QoS is no YAML ({" ".join(str(error).split())})') from None


def qos_profiles(items: Any) -> tuple[Qos, ...]:
    """Return the profiles of a list of mappings, as metadata.yaml holds it."""
    if isinstance(items, str):  # before version 9: YAML in YAML
        return parse_qos(items)
    if not isinstance(items, list):
        raise BagError('QoS is no list of profiles')
    return tuple(_profile(item) for item in items)


def _item(qos: Qos) -> list[str]:
    return [
        f'- history: {qos.history}',
        f'  depth: {qos.depth}',
        f'  reliability: {qos.reliability}',
        f'  durability: {qos.durability}',
        *_time('deadline', qos.deadline),
        *_time('lifespan', qos.lifespan),
        f'  liveliness: {qos.liveliness}',
        *_time('liveliness_lease_duration', qos.liveliness_lease_duration),
        f'  avoid_ros_namespace_conventions: {str(qos.avoid_ros_namespace_conventions).lower()}',
    ]


def _time(name: str, nanoseconds: int) -> list[str]:
    sec, nsec = divmod(nanoseconds, NANOSECONDS)
    return [f'  {name}:', f'    sec: {sec}', f'    nsec: {nsec}']


def _profile(item: Any) -> Qos:
    if not isinstance(item, Mapping):
        raise BagError('a QoS profile is no mapping')
    try:
        return Qos(
            depth=int(item['depth']),
            deadline=_nanoseconds(item['deadline']),
            lifespan=_nanoseconds(item['lifespan']),
            liveliness_lease_duration=_nanoseconds(item['liveliness_lease_duration']),
            avoid_ros_namespace_conventions=bool(item['avoid_ros_namespace_conventions']),
            **{name: _word(item[name], words) for name, words in _WORDS.items()},
        )
    except MALFORMED as error:
        raise BagError(f'a QoS profile lacks or misstates {error}') from None


def _word(value: Any, words: tuple[str, ...]) -> str:
    if isinstance(value, int):
        return words[value] if 0 <= value < len(words) else 'unknown'
    return value if value in words else 'unknown'


def _nanoseconds(time: Any) -> int:
    sec, nsec = int(time['sec']), int(time['nsec'])
    if (sec, nsec) in _FOXY_INFINITE:
        return INFINITE
    return min(sec * NANOSECONDS + nsec, INFINITE)
