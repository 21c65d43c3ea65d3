"""Commands to the simulation: polled, checked, put in order of time, expired."""

from collections.abc import Callable
from dataclasses import dataclass, field
import heapq
import itertools
import math
from typing import Any

from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from disc_sim_ros import topics
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.kernels.equations import DISC_AIR, Control
from disc_sim_ros.ros import messages, qos
from disc_sim_ros.ros.internals import PolledSubscription, Taken
from disc_sim_ros.units import NANOSECONDS

MOST_WAITING = 1000  # commands stamped in the future, of one topic
END_OF_TIME = 2_145_916_800  # s; 2038-01-01, shortly before stamps of ROS end
MOST_PER_POLL = 256  # messages taken from one topic at a time, so that none starves the others


@dataclass
class CommandTopic:
    """One command topic: how its messages are taken and converted, which wait, which were dropped.

    Attributes:
        name: Name of the topic.
        message_type: Class of its messages.
        take: Returns the oldest message that was not taken yet, or None.
        convert: Returns the checked value of a message; raises ConfigError for a bad one.
        waiting: A heap of (stamp from which it acts [ns], order of arrival, value).
        accepted: Number of commands accepted so far.
        dropped: Number of commands dropped so far.
        reason: Why the last one was dropped.
    """

    name: str
    message_type: type
    take: Callable[[], Taken | None]
    convert: Callable[[Any], Any]
    waiting: list[tuple[int, int, Any]] = field(default_factory=list)
    accepted: int = 0
    dropped: int = 0
    reason: str = ''

    def drop(self, reason: str) -> None:
        """Count a command that is dropped."""
        self.dropped += 1
        self.reason = reason

    def drop_accepted(self, reason: str) -> None:
        """Count a command as dropped that was accepted before, when it arrived."""
        self.accepted -= 1
        self.drop(reason)

    def ahead(self, now: int) -> list[int]:
        """Return how far ahead of a stamp commands wait [ns]; for any thread."""
        return [at - now for at, *_ in tuple(self.waiting) if at > now]


class Commands:
    """The command topics of one node. Only the simulation thread uses it.

    Attributes:
        all: The topics.
        subscriptions: Their subscriptions, in the same order.
    """

    def __init__(self, node: Node | None, frames: topics.Frames) -> None:
        """Subscribe to every command topic; without a node no command ever arrives."""
        self._order = itertools.count()

        self.subscriptions: list[PolledSubscription] = []

        def topic(name: str, message_type: type, convert: Callable[..., Any]) -> CommandTopic:
            take: Callable[[], Taken | None] = _no_message
            if node is not None:
                subscription = PolledSubscription(node, message_type, name, qos.COMMAND_QOS)
                self.subscriptions.append(subscription)
                take = subscription.take
            return CommandTopic(name, message_type, take, lambda message: convert(message, frames))

        self.moment = topic(topics.CMD_MOMENT, WrenchStamped, messages.moment_from_wrench)
        self.coefficients = topic(
            topics.CMD_COEFFICIENTS, Vector3Stamped, messages.coefficients_from_vector
        )
        self.wind = topic(topics.WIND, Vector3Stamped, messages.wind_from_vector)
        self.throw = topic(topics.THROW, Odometry, messages.release_from_odometry)
        self.all = (self.moment, self.coefficients, self.wind, self.throw)

    @property
    def have_publishers(self) -> bool:
        """Return True if a publisher of commands is matched: one may arrive at any moment."""
        return any(subscription.has_publishers() for subscription in self.subscriptions)

    def poll(self, now: int, on_drop: Callable[[CommandTopic], None]) -> None:
        """Take the messages that have arrived, and put them in order of their stamps.

        Args:
            now: Stamp of the next step [ns]; a command with an earlier stamp acts at that step.
            on_drop: Called with the topic after a command was dropped.
        """
        for topic in self.all:
            for _ in range(MOST_PER_POLL):
                taken = topic.take()
                if taken is None:
                    break
                self.take(topic, taken[0], now, on_drop)

    def take(
        self, topic: CommandTopic, message: Any, now: int, on_drop: Callable[[CommandTopic], None]
    ) -> None:
        """Accept a message, or its serialised bytes, or drop it; see `poll`."""
        if isinstance(message, bytes):
            message = deserialize_message(message, topic.message_type)
        try:
            self.accept(topic, message, now)
        except ConfigError as error:
            topic.drop(str(error))
            on_drop(topic)

    def accept(self, topic: CommandTopic, message: Any, now: int) -> None:
        """Check a message and let it wait for its time; `now` as in `poll`.

        Raises:
            ConfigError: The message is not allowed, or too many wait already.
        """
        value = topic.convert(message)
        at = max(checked_stamp(message.header.stamp), now)
        while at == now and topic.waiting and topic.waiting[0][0] <= now:
            heapq.heappop(topic.waiting)  # superseded; a paused clock may collect thousands
        if len(topic.waiting) >= MOST_WAITING:
            allowed = f'{MOST_WAITING} commands at most may wait for their time'
            raise ConfigError(topic.name, 'one more', allowed)
        self.enqueue(topic, at, value)
        topic.accepted += 1

    def enqueue(self, topic: CommandTopic, at: int, value: Any) -> None:
        """Let a checked value wait for its time [ns], behind those of the same time."""
        heapq.heappush(topic.waiting, (at, next(self._order), value))

    @property
    def any_waiting(self) -> bool:
        """Return True if a command waits for its time."""
        return any(topic.waiting for topic in self.all)

    def furthest(self, now: int) -> tuple[int, str]:
        """Return how far ahead of a stamp commands wait at most [ns], and the topic; or 0, ''."""
        return max(((max(t.ahead(now), default=0), t.name) for t in self.all), default=(0, ''))

    def next_change(self) -> float:
        """Return the first stamp at which a waiting command, not a throw, acts [ns]; or inf."""
        changes = (self.moment, self.coefficients, self.wind)
        return min((t.waiting[0][0] for t in changes if t.waiting), default=math.inf)

    def clear(self, reason: str) -> None:
        """Drop all waiting commands."""
        for topic in self.all:
            for _ in topic.waiting:
                topic.drop_accepted(reason)
            topic.waiting.clear()


def checked_stamp(stamp: Any) -> int:
    """Return a stamp [ns].

    Raises:
        ConfigError: It is no time, or from 2038 on: the sender has mixed up units or bytes.
    """
    if stamp.nanosec >= NANOSECONDS:
        raise ConfigError('header.stamp.nanosec', stamp.nanosec, 'give less than 1000000000')
    if stamp.sec >= END_OF_TIME:
        allowed = f'give less than {END_OF_TIME}, the year 2038'
        raise ConfigError('header.stamp.sec', stamp.sec, allowed)
    return int(stamp.sec * NANOSECONDS + stamp.nanosec)


def pop_due(topic: CommandTopic, now: int) -> Any:
    """Return the newest command of a topic that acts at `now` [ns], or None; remove older ones."""
    value = None
    while topic.waiting and topic.waiting[0][0] <= now:
        value = heapq.heappop(topic.waiting)[2]
    return value


class ActiveControl:
    """The control inputs that act at present, and the stamps at which they fall to zero.

    Attributes:
        control: The control inputs, in the paper's signs.
        moment_until: Stamp at which the moment expires [ns], or inf.
        coefficients_until: The same for the coefficients.
    """

    def __init__(self) -> None:
        self.control = Control(axes=DISC_AIR)
        self.moment_until: float = math.inf
        self.coefficients_until: float = math.inf

    def set_moment(self, moment: tuple[float, float, float, int], until: float) -> None:
        """Set the moment L, M, N [N m] and its axes, until a stamp [ns]."""
        L, M, N, axes = moment
        self.control = self.control._replace(L=L, M=M, N=N, axes=axes)
        self.moment_until = until

    def set_coefficients(self, values: tuple[float, float, float], until: float) -> None:
        """Set the coefficients C_L, C_M, C_N, until a stamp [ns]."""
        C_L, C_M, C_N = values
        self.control = self.control._replace(C_L=C_L, C_M=C_M, C_N=C_N)
        self.coefficients_until = until

    def restore(self, control: Control, moment_until: float, coefficients_until: float) -> None:
        """Take all attributes as compiled code has left them."""
        self.control = control
        self.moment_until = moment_until
        self.coefficients_until = coefficients_until

    def expired(self, now: int) -> tuple[bool, bool]:
        """Return whether the moment and the coefficients have expired at a stamp [ns]."""
        return now >= self.moment_until, now >= self.coefficients_until

    def next_expiry(self) -> float:
        """Return the first stamp at which one of them expires [ns], or inf."""
        return min(self.moment_until, self.coefficients_until)


def _no_message() -> None:
    return None
