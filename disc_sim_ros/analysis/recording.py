"""What a bag holds of discs: their motion, throws, events, commands and wind."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np

from disc_sim_ros import topics
from disc_sim_ros.analysis.moving_topics import contents, moving_topics
from disc_sim_ros.analysis.odometry import ODOMETRY, POSE, Motion, motions
from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.bags.reader import Bag, Message
from disc_sim_ros.bags.topic import full_type
from disc_sim_ros.errors import BagError
from disc_sim_ros.physics.flight_config import (
    EventKey,
    Key,
    document_of,
    nanoseconds_of,
    release_of,
)
from disc_sim_ros.physics.frames import odometry_array
from disc_sim_ros.topics import FlightEvent, Frames
from disc_sim_ros.units import NANOSECONDS

END_OF_BAG, THROWN_AGAIN = 'end of the bag', 'thrown again'
# The numbers that a release message and a configuration have in common. Not p and q, 10 and 11:
# the precession model sets these itself.
_RELEASED = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 12]
_ROUNDING = 1e-12  # a release message is made after the quaternion was brought to unit length
_TOGETHER = 2 * NANOSECONDS  # of log time: a release and its configuration are sent together


class Began(StrEnum):
    """With what a recorded flight begins."""

    THROWN = 'thrown'  # a throw was recorded
    MOVED = 'moved'  # the body was at rest before
    IN_FLIGHT = 'in flight'  # with its first message; when it was thrown is not known


@dataclass(frozen=True, slots=True)
class Change:
    """Control inputs, or a mean wind, that act from a time on.

    Attributes:
        topic: Last name of its topic, one of `topics.APPLIED`.
        stamp: When it begins to act [ns].
        values: As in the message.
        frame: The frame of the values.
    """

    topic: str
    stamp: int
    values: tuple[float, float, float]
    frame: str


@dataclass(frozen=True, slots=True)
class Event:
    """A flight event.

    Attributes:
        name: Such as 'landed', see `topics.FlightEvent`.
        stamp: When it happened [ns].
        values: Its other values, by `flight_config.EventKey` and the fields of `Landing`.
    """

    name: str
    stamp: int
    values: Mapping[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class Release:
    """A throw: its time [ns], and the document of its configuration, or None."""

    stamp: int
    configuration: Mapping[str, Any] | None


@dataclass(frozen=True, eq=False)
class Disc:
    """All that a bag holds of one disc.

    Attributes:
        motion: All its messages.
        releases: Its throws, in order.
        events: Its events, each once: a latched one may be recorded again.
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

    @cached_property
    def jumps(self) -> tuple[tuple[int, int], ...]:
        """Return the jumps of its time: the stamp after each [ns], and by how much [ns]."""
        jumps = (e for e in self.events if e.name == FlightEvent.TIME_JUMPED)
        return tuple(
            (e.stamp, nanoseconds_of(e.values.get(EventKey.JUMP, '')) or 0) for e in jumps
        )

    @property
    def namespace(self) -> str:
        """Return the namespace of its topics, such as '/red'; empty for the root."""
        return self.motion.namespace

    @property
    def name(self) -> str:
        """Return its name in reports: its frame, or the namespace where that tells it apart."""
        child, plain = self.motion.child, Frames().disc
        if child not in {'', plain}:
            return child.removesuffix(f'/{plain}') or child
        return self.namespace.strip('/') or child or self.motion.topic


@dataclass(frozen=True, eq=False)
class Flight:
    """One flight of a disc.

    Attributes:
        disc: The disc.
        number: From 1, in the order of the bag.
        start: Stamp of the release, or of the first message [ns].
        rows: Its messages in `disc.motion`, up to the next flight.
        release: The throw; None where no such message was recorded.
        landing: The event; None where none was recorded.
        began: With what it begins, see `Began`.
        ended: What ended it: 'landed', 'thrown again', 'reset', 'failed' or 'end of the bag', and
            in bags of other recorders 'rest', 'gap' or 'jump'.
        until: Up to which stamp its messages must reach [ns], as other topics tell; None if
            nothing tells it.
    """

    disc: Disc
    number: int
    start: int
    rows: slice
    release: Release | None = None
    landing: Event | None = None
    began: Began = Began.THROWN
    ended: str = END_OF_BAG
    until: int | None = None

    @cached_property
    def motion(self) -> Motion:
        """Return its messages."""
        return self.disc.motion.part(self.rows)

    @property
    def configuration(self) -> Mapping[str, Any] | None:
        """Return the document of its configuration; None where none was recorded."""
        return None if self.release is None else self.release.configuration

    @property
    def changes(self) -> list[Change]:
        """Return what was applied from the release to the last message, in order."""
        end = int(self.motion.stamps[-1])
        return [c for c in self.disc.changes if self.start <= c.stamp <= end]

    def elapsed(self, stamps: IntArray) -> IntArray:
        """Return the time of flight at stamps [ns], without the jumps of time since the start."""
        elapsed = stamps - self.start
        for after, shift in self.jumps:
            elapsed = elapsed - shift * (stamps >= after)
        return elapsed

    @property
    def jumps(self) -> list[tuple[int, int]]:
        """Return the jumps of time from the start to the last message, as `Disc.jumps`."""
        end = int(self.motion.stamps[-1])
        return [(after, shift) for after, shift in self.disc.jumps if self.start < after <= end]

    @property
    def evened(self) -> Motion:
        """Return its messages with stamps as if time had not jumped."""
        motion = self.motion
        return replace(motion, stamps=self.start + self.elapsed(motion.stamps))

    def time_of(self, stamp: int) -> float:
        """Return the time of flight at a stamp [s]."""
        return float(self.elapsed(np.array([stamp]))[0]) / NANOSECONDS

    @property
    def time(self) -> FloatArray:
        """Return the time of flight at each message [s], shape (n,)."""
        return self.elapsed(self.motion.stamps) / NANOSECONDS

    @property
    def starts_late(self) -> float:
        """Return the time of flight at the first message [s]."""
        return float(self.time[0])


@dataclass(frozen=True)
class _Messages:
    """Decoded messages by topic."""

    by_topic: dict[str, list[Message]] = field(default_factory=dict)

    def of(self, namespace: str, name: str) -> list[Message]:
        """Return the messages of a topic of a namespace, in order of arrival."""
        return self.by_topic.get(f'{namespace}/{name}', [])


def discs(bag: Bag, topic: str | None = None) -> list[Disc]:
    """Return the discs of a bag, or whatever else moves in it.

    Args:
        bag: The bag.
        topic: The only topic to read; otherwise every Odometry, and every PoseStamped of a
            namespace without one.

    Raises:
        BagError: The bag holds no motion; the message lists its topics.
    """
    if not bag.message_count:
        raise BagError(f'{bag.path}: the bag is empty')
    moving = moving_topics(bag, topic)
    bodies: list[Motion] = []
    for kind in (ODOMETRY, POSE):
        names = [name for name, of in moving.items() if of == kind]
        if names:
            bodies += motions(bag.raw(names, [kind]), kind)
    if not bodies:
        raise BagError(f'{bag.path}: {", ".join(moving)}: no messages; {contents(bag)}')
    types = {
        f'{space}/{name}': kind
        for space in {motion.namespace for motion in bodies}
        for name, kind in topics.FLIGHT_TOPICS.items()
    }
    types[topics.NodeTopic.PARAMETER_EVENTS] = topics.MessageType.PARAMETER_EVENT
    known = {i.name: i for i in bag.topics if types.get(i.name) == full_type(i.type)}
    filled = [name for name, info in known.items() if info.message_count]
    messages = _Messages()
    for message in bag.messages(filled, {types[name] for name in filled}):
        if full_type(message.type) == types[message.topic]:
            messages.by_topic.setdefault(message.topic, []).append(message)
    try:
        return [_disc(motion, bodies, messages, set(known)) for motion in bodies]
    except (AttributeError, TypeError, ValueError) as error:  # a damaged definition
        raise BagError(f'{bag.path}: a message is not what its topic says ({error})') from None


def _disc(motion: Motion, bodies: Iterable[Motion], messages: _Messages, known: set[str]) -> Disc:
    """Return all that is recorded of one disc; discs that share topics differ in their frames."""
    space = motion.namespace
    alone = sum(body.namespace == space for body in bodies) == 1
    names = Frames.of_disc(motion.child)
    own = {names.disc, names.disc_body, names.disc_air}
    changes = [
        change
        for name in topics.APPLIED
        for change in map(_change, messages.of(space, name))
        if alone or change.frame in own or name == topics.APPLIED_WIND
    ]
    events = [
        _event(message)
        for message in messages.of(space, topics.FLIGHT_EVENTS)
        if alone or message.value.hardware_id == motion.child
    ]
    releases = _releases(motion.child, space, messages, events, alone=alone)
    return Disc(
        motion=motion,
        releases=tuple(sorted(releases, key=_stamp)),
        events=tuple({(e.name, e.stamp, *e.values.items()): e for e in events}.values()),
        changes=tuple(_without_repeats(sorted(changes, key=_stamp))),
        topics=frozenset(n for n in topics.FLIGHT_TOPICS if f'{space}/{n}' in known),
        profile_changes=tuple(_profile_changes(space, messages)),
    )


def _profile_changes(space: str, messages: _Messages) -> Iterator[int]:
    """Yield the log times of changes of the wind's profile, by parameters of sim_node [ns]."""
    for message in messages.by_topic.get(topics.NodeTopic.PARAMETER_EVENTS, []):
        names = {parameter.name for parameter in message.value.changed_parameters}
        if message.value.node.rpartition('/')[0] == space and names & set(topics.WIND_PROFILE):
            yield message.log_time


def _without_repeats(changes: Iterable[Change]) -> Iterator[Change]:
    """Yield changes, each once: a recorder with two subscriptions has each message twice."""
    last: dict[str, Change] = {}
    for change in changes:
        if last.get(change.topic) != change:
            yield change
        last[change.topic] = change


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
    stamp = nanoseconds_of(values.pop(EventKey.STAMP, ''))
    at = message.log_time if stamp is None else stamp
    return Event(topics.event_of(message.value.name), at, values)


def _releases(
    child: str, space: str, messages: _Messages, events: Iterable[Event], *, alone: bool
) -> Iterator[Release]:
    """Yield the throws of a disc; discs that share topics differ in the frame of the release."""
    numbers = {e.stamp: e.values.get(EventKey.FLIGHT) for e in events if _is_throw(e)}
    for message, document in _configured(space, messages):
        if alone or message.value.child_frame_id == child:
            stamp = _ns(message.value.header.stamp)
            numbers.pop(stamp, None)
            yield Release(stamp, document)
    documents = [document for _, document in _documents(space, messages)]
    for stamp, number in numbers.items():  # where `release` was not recorded
        fitting = [d for d in documents if alone and str(d.get(Key.FLIGHT)) == number]
        yield Release(stamp, fitting[0] if len(fitting) == 1 else None)


def _configured(
    space: str, messages: _Messages
) -> Iterator[tuple[Message, Mapping[str, Any] | None]]:
    """Yield each release with its configuration.

    A configuration does not name the disc that it is of. It goes with the release that has the
    same state and flight number, and of several with the one that was sent together with it.
    """
    numbers = {
        (message.value.hardware_id, event.stamp): event.values.get(EventKey.FLIGHT)
        for message in messages.of(space, topics.FLIGHT_EVENTS)
        if _is_throw(event := _event(message))
    }
    remaining = _documents(space, messages)
    for message in messages.of(space, topics.RELEASE):
        value = message.value
        number = numbers.get((value.child_frame_id, _ns(value.header.stamp)))
        fitting = [
            (abs(at - message.log_time), i)
            for i, (at, document) in enumerate(remaining)
            if number in {None, str(document.get(Key.FLIGHT))}
            and _is_of(document, _numbers(value))
        ]
        apart, nearest = min(fitting, default=(_TOGETHER + 1, -1))
        yield message, remaining.pop(nearest)[1] if apart <= _TOGETHER else None


def _documents(space: str, messages: _Messages) -> list[tuple[int, Mapping[str, Any]]]:
    """Return the configurations in a namespace, each with its log time [ns]."""
    return [
        (message.log_time, document)
        for message in messages.of(space, topics.CONFIGURATION)
        if (document := document_of(message.value.data)) is not None
    ]


def _is_of(document: Mapping[str, Any], numbers: FloatArray) -> bool:
    """Return True if a configuration has the state of a release message, to rounding."""
    expected, recorded = odometry_array(release_of(document))[0][_RELEASED], numbers[_RELEASED]
    return bool((np.abs(expected - recorded) <= _ROUNDING * (1.0 + np.abs(recorded))).all())


def _numbers(odometry: Any) -> FloatArray:
    pose, twist = odometry.pose.pose, odometry.twist.twist
    vectors = (pose.position, pose.orientation, twist.linear, twist.angular)
    names = ('xyz', 'xyzw', 'xyz', 'xyz')
    return np.array([getattr(v, n) for v, of in zip(vectors, names, strict=True) for n in of])


def _is_throw(event: Event) -> bool:
    return event.name == FlightEvent.THROWN


def _stamp(dated: Change | Release) -> int:
    return dated.stamp


def _ns(stamp: Any) -> int:
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)
