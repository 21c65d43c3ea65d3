"""What a bag tells of discs: whose motion it holds, their flights, commands and events."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
import re
from typing import Any

import numpy as np
import yaml

from disc_sim_ros.analysis.odometry import ODOMETRY, POSE, Motion, motions
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.bags.reader import Bag, Message
from disc_sim_ros.errors import BagError
from disc_sim_ros.physics.frames import odometry_array
from disc_sim_ros.physics.kernels.equations import State

NANOSECONDS = 1_000_000_000
APPLIED = ('applied_moment', 'applied_coefficients', 'applied_wind')
_SIBLINGS = {  # topics of sim_node beside its odometry, and their types
    'configuration': 'std_msgs/msg/String',
    'release': ODOMETRY,
    'flight_events': 'diagnostic_msgs/msg/DiagnosticStatus',
    'applied_moment': 'geometry_msgs/msg/WrenchStamped',
    'applied_coefficients': 'geometry_msgs/msg/Vector3Stamped',
    'applied_wind': 'geometry_msgs/msg/Vector3Stamped',
}
_PARAMETER_EVENTS = '/parameter_events'
_TOLD = ('disc', 'model', 'physics_rate', 'publish_rate', 'ground')  # by a configuration, at least
_NOT_MOTION = ('release', 'throw')  # of type Odometry, but single states
_WIND_PROFILE = ('wind.roughness_length', 'wind.reference_height')
# A release message and a configuration tell the same but for p and q, which the precession model
# sets itself: its numbers but these.
_RELEASED = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 12]
_ROUNDING = 1e-12  # a release message is made after the quaternion was brought to unit length


@dataclass(frozen=True, slots=True)
class Change:
    """Something that acts from a time on: control inputs, or the mean wind.

    Attributes:
        topic: Last name of its topic, one of APPLIED.
        stamp: From when [ns].
        values: As in the message.
        frame: In which they are given.
    """

    topic: str
    stamp: int
    values: tuple[float, float, float]
    frame: str


@dataclass(frozen=True, slots=True)
class Event:
    """A flight event.

    Attributes:
        name: Such as 'landed'.
        stamp: When [ns].
        values: Its other values.
    """

    name: str
    stamp: int
    values: Mapping[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class Release:
    """A throw: when, and its configuration, the document that sim_node publishes; or None."""

    stamp: int
    configuration: Mapping[str, Any] | None


@dataclass(frozen=True, eq=False)
class Disc:
    """All that a bag tells of one disc.

    Attributes:
        motion: All its messages.
        releases: Its throws, in order.
        events: Its events.
        changes: What was applied, in order of arrival.
        topics: Names of the topics beside its motion that the bag holds, without namespace.
        profile_changes: Log times of changes of the wind's profile [ns].
    """

    motion: Motion
    releases: tuple[Release, ...] = ()
    events: tuple[Event, ...] = ()
    changes: tuple[Change, ...] = ()
    topics: frozenset[str] = frozenset()
    profile_changes: tuple[int, ...] = ()

    @property
    def namespace(self) -> str:
        """Return the namespace of its topics, such as '/red'; empty for the root."""
        return self.motion.topic.rpartition('/')[0]

    @property
    def name(self) -> str:
        """Return what to call it: its frame, or the namespace where that says more."""
        child = self.motion.child
        if child not in {'', 'disc'}:
            return child.removesuffix('/disc') or child
        return self.namespace.strip('/') or child or self.motion.topic


@dataclass(frozen=True, eq=False)
class Flight:
    """One flight of a disc.

    Attributes:
        disc: Whose.
        number: From 1, in the order of the bag.
        start: Stamp of the release, or of the first message [ns].
        rows: Messages of `disc.motion` that tell of it, until the next begins.
        release: The throw; None where no such message was recorded.
        landing: The event; None where none was recorded.
        ended: What ended it: 'landed', 'thrown again', 'reset', 'failed' or 'end of the bag', and
            of bags of others 'rest', 'gap' or 'jump'.
    """

    disc: Disc
    number: int
    start: int
    rows: slice
    release: Release | None = None
    landing: Event | None = None
    ended: str = 'end of the bag'

    @cached_property
    def motion(self) -> Motion:
        """Return its messages."""
        return self.disc.motion.part(self.rows)

    @property
    def time(self) -> FloatArray:
        """Return the time of each message since the start [s], shape (n,)."""
        return (self.motion.stamps - self.start) / NANOSECONDS

    @property
    def starts_late(self) -> float:
        """Return how long after the release the first message is [s]."""
        return float(self.motion.stamps[0] - self.start) / NANOSECONDS


@dataclass(frozen=True)
class _Told:
    """Decoded messages by topic."""

    by_topic: dict[str, list[Message]] = field(default_factory=dict)

    def of(self, namespace: str, name: str) -> list[Message]:
        return self.by_topic.get(f'{namespace}/{name}', [])


def discs(bag: Bag, topic: str | None = None) -> list[Disc]:
    """Return the discs of a bag, or whatever else moves in it.

    Args:
        bag: The bag.
        topic: The only topic to read; otherwise every Odometry, and every PoseStamped of a
            namespace without one.

    Raises:
        BagError: There is nothing that moves; it names what there is.
    """
    if not bag.message_count:
        raise BagError(f'{bag.path}: the bag is empty')
    moving = _moving_topics(bag, topic)
    found: list[Motion] = []
    for kind in (ODOMETRY, POSE):
        names = [name for name, of in moving.items() if of == kind]
        if names:
            found += motions(bag.raw(names), kind)
    if not found:
        raise BagError(f'{bag.path}: {", ".join(moving)}: no messages; {_contents(bag)}')
    spaces = {motion.topic.rpartition('/')[0] for motion in found}
    types = {f'{space}/{name}': kind for space in spaces for name, kind in _SIBLINGS.items()}
    types[_PARAMETER_EVENTS] = 'rcl_interfaces/msg/ParameterEvent'
    known = {i.topic.name: i for i in bag.topics if types.get(i.topic.name) == i.topic.type}
    told: dict[str, list[Message]] = {}
    for message in bag.messages([name for name, info in known.items() if info.message_count]):
        told.setdefault(message.topic, []).append(message)
    try:
        return [_disc(motion, found, _Told(told), set(known)) for motion in found]
    except (AttributeError, TypeError, ValueError) as error:  # by a damaged definition
        raise BagError(f'{bag.path}: a message is not what its topic says ({error})') from None


def _moving_topics(bag: Bag, topic: str | None) -> dict[str, str]:
    """Return the types of the topics to take motion from, by their names."""
    types = {info.topic.name: info.topic.type for info in bag.topics}
    if topic is not None:
        name = topic if topic in types else f'/{topic.strip("/")}'
        if name not in types:
            raise BagError(f'{bag.path}: no topic {topic}; {_contents(bag)}')
        if types[name] not in {ODOMETRY, POSE}:
            raise BagError(
                f'{bag.path}: {name} is {types[name]}; motion is read from {ODOMETRY} and {POSE}'
            )
        return {name: types[name]}
    filled = {info.topic.name for info in bag.topics if info.message_count}
    odometry = [
        name
        for name, kind in types.items()
        if kind == ODOMETRY and name in filled and name.rpartition('/')[2] not in _NOT_MOTION
    ]
    spaces = {name.rpartition('/')[0] for name in odometry}
    poses = [
        name
        for name, kind in types.items()
        if kind == POSE and name in filled and name.rpartition('/')[0] not in spaces
    ]
    if not odometry and not poses:
        raise BagError(f'{bag.path}: no {ODOMETRY} or {POSE} to analyse; {_contents(bag)}')
    return {name: types[name] for name in [*odometry, *poses]}


def _contents(bag: Bag) -> str:
    """Return what is in a bag, for an error."""
    filled = [info for info in bag.topics if info.message_count]
    return 'it holds ' + ', '.join(f'{i.topic.name} ({i.topic.type})' for i in filled)


def _disc(motion: Motion, others: Iterable[Motion], told: _Told, known: set[str]) -> Disc:
    """Return what is told of one disc; discs that share topics differ in their frames."""
    space = motion.topic.rpartition('/')[0]
    alone = sum(m.topic.rpartition('/')[0] == space for m in others) == 1
    prefix = motion.child.removesuffix('disc')
    frames = {prefix + name for name in ('disc', 'disc_body', 'disc_air')}

    def own(frame: str) -> bool:
        return alone or frame in frames

    changes = [
        change
        for name in APPLIED
        for change in map(_change, told.of(space, name))
        if own(change.frame) or name == 'applied_wind'
    ]
    events = [
        _event(message)
        for message in told.of(space, 'flight_events')
        if alone or message.value.hardware_id == motion.child
    ]
    return Disc(
        motion=motion,
        releases=tuple(
            sorted(_releases(motion.child, space, told, events, alone=alone), key=_stamp)
        ),
        events=tuple(events),
        changes=tuple(sorted(changes, key=_stamp)),
        topics=frozenset(n for n in _SIBLINGS if f'{space}/{n}' in known),
        profile_changes=tuple(
            message.log_time
            for message in told.of('', 'parameter_events')
            if message.value.node.rpartition('/')[0] == space
            and any(p.name in _WIND_PROFILE for p in message.value.changed_parameters)
        ),
    )


def _change(message: Message) -> Change:
    value = message.value
    vector = value.wrench.torque if hasattr(value, 'wrench') else value.vector
    return Change(
        message.topic.rpartition('/')[2],
        _ns(value.header.stamp),
        (float(vector.x), float(vector.y), float(vector.z)),
        value.header.frame_id,
    )


def _event(message: Message) -> Event:
    values = {item.key: item.value for item in message.value.values}
    stamp = _seconds(values.pop('stamp_s', ''))
    at = message.log_time if stamp is None else stamp
    return Event(message.value.name.rpartition(': ')[2], at, values)


def _releases(
    child: str, space: str, told: _Told, events: Iterable[Event], *, alone: bool
) -> Iterable[Release]:
    """Yield the throws of a disc; discs that share topics differ in the frame of the release."""
    numbers = {e.stamp: e.values.get('flight') for e in events if e.name == 'thrown'}
    for message, document in _configured(space, told):
        if alone or message.value.child_frame_id == child:
            stamp = _ns(message.value.header.stamp)
            numbers.pop(stamp, None)
            yield Release(stamp, document)
    documents = [d for _, d in _documents(space, told)]
    for stamp, number in numbers.items():  # where `release` was not recorded
        mine = [d for d in documents if alone and str(d.get('flight')) == number]
        yield Release(stamp, mine[0] if len(mine) == 1 else None)


def _configured(space: str, told: _Told) -> Iterable[tuple[Message, Mapping[str, Any] | None]]:
    """Yield each release with its configuration, which names no disc: by the state, in order."""
    documents = _documents(space, told)
    events = [(m.value.hardware_id, _event(m)) for m in told.of(space, 'flight_events')]
    numbers = {
        (child, e.stamp): e.values.get('flight') for child, e in events if e.name == 'thrown'
    }
    for message in told.of(space, 'release'):
        value = message.value
        number = numbers.get((value.child_frame_id, _ns(value.header.stamp)))
        fitting = [
            (abs(at - message.log_time), i)
            for i, (at, document) in enumerate(documents)
            if number in {None, str(document.get('flight'))} and _is_of(document, _numbers(value))
        ]
        apart, mine = min(fitting, default=(_TOGETHER + 1, -1))
        yield message, documents.pop(mine)[1] if apart <= _TOGETHER else None


def _documents(space: str, told: _Told) -> list[tuple[int, Mapping[str, Any]]]:
    """Return the configurations in a namespace, each with its log time [ns]."""
    return [
        (message.log_time, document)
        for message in told.of(space, 'configuration')
        if (document := _document(message.value.data)) is not None
    ]


_TOGETHER = 2 * NANOSECONDS  # of log time: a release and its configuration are sent together


def _document(text: str) -> Mapping[str, Any] | None:
    """Return the configuration of a flight, or None for a text that is something else."""
    try:
        document = yaml.load(text, Loader=_LOADER)  # noqa: S506 - one of the safe ones
    except yaml.YAMLError:
        return None
    if not isinstance(document, dict) or not document.keys() >= set(_TOLD):
        return None
    release, wind = document.get('release'), document.get('wind')
    if not _are_numbers(release, State._fields) or not _are_numbers(wind, 'xyz'):
        return None
    return document


def _are_numbers(values: Any, names: Iterable[str]) -> bool:
    return isinstance(values, dict) and all(
        isinstance(values.get(name), int | float) for name in names
    )


_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


def _is_of(document: Mapping[str, Any], numbers: FloatArray) -> bool:
    state = [float(document['release'][name]) for name in State._fields]
    off = np.abs(odometry_array(state)[0][_RELEASED] - numbers[_RELEASED])
    return bool((off <= _ROUNDING * (1.0 + np.abs(numbers[_RELEASED]))).all())


def _numbers(odometry: Any) -> FloatArray:
    pose, twist = odometry.pose.pose, odometry.twist.twist
    vectors = (pose.position, pose.orientation, twist.linear, twist.angular)
    names = ('xyz', 'xyzw', 'xyz', 'xyz')
    return np.array([getattr(v, n) for v, of in zip(vectors, names, strict=True) for n in of])


def _stamp(thing: Change | Release) -> int:
    return thing.stamp


def _ns(stamp: Any) -> int:
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def _seconds(text: str) -> int | None:
    """Return an exact time in seconds as nanoseconds."""
    match = re.fullmatch(r'(\d+)\.(\d{9})', text)
    return int(match[1]) * NANOSECONDS + int(match[2]) if match else None
