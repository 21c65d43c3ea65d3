"""Commands on their way to the simulation: polled, checked, put in order of time, expired."""

from collections.abc import Callable
from dataclasses import dataclass, field
import heapq
import itertools
import math
from typing import Any

from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.subscription import Subscription

from disc_sim_ros import topics
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.kernels.equations import DISC_AIR, Control
from disc_sim_ros.ros import messages, qos
from disc_sim_ros.ros.sim.clock import NANOSECONDS

MOST_WAITING = 1000  # commands stamped in the future, of one topic
MOST_A_POLL = 256  # messages taken from one topic at a time, so that none starves the others


class Polled(CallbackGroup):
    """Keeps subscriptions out of the executor: the simulation thread takes their messages."""

    def can_execute(self, entity: Any) -> bool:
        """Say no."""
        return False

    def beginning_execution(self, entity: Any) -> bool:
        """Say no."""
        return False

    def ending_execution(self, entity: Any) -> None:
        """Do nothing."""


@dataclass
class Topic:
    """One topic of commands: how it is read, what waits, what was dropped.

    Attributes:
        accepted: Commands taken, so far.
        dropped: Commands refused, so far.
        reason: Why the last one was refused.
    """

    name: str
    type: type
    subscription: Subscription | None
    read: Callable[[Any], Any]
    waiting: list[tuple[int, int, Any]] = field(default_factory=list)  # from when [ns], order
    accepted: int = 0
    dropped: int = 0
    reason: str = ''

    def drop(self, reason: str) -> None:
        """Count a refused command."""
        self.dropped += 1
        self.reason = reason


class Commands:
    """The command topics of one node. Only the simulation thread uses it."""

    def __init__(self, node: Node | None, frames: topics.Frames) -> None:
        """Subscribe to every command topic; without a node nobody commands."""
        self._order = itertools.count()
        group = Polled()

        def topic(name: str, kind: type, read: Callable[[Any], Any]) -> Topic:
            subscription = None
            if node is not None:
                subscription = node.create_subscription(
                    kind, name, _never, qos.COMMAND_QOS, callback_group=group
                )
            return Topic(name, kind, subscription, read)

        self.moment = topic(
            topics.CMD_MOMENT,
            WrenchStamped,
            lambda message: messages.moment_from_wrench(message, frames),
        )
        self.coefficients = topic(
            topics.CMD_COEFFICIENTS,
            Vector3Stamped,
            lambda message: messages.coefficients_from_vector(message, frames),
        )
        self.wind = topic(
            topics.WIND,
            Vector3Stamped,
            lambda message: messages.wind_from_vector(message, frames),
        )
        self.throw = topic(
            topics.THROW,
            Odometry,
            lambda message: messages.release_from_odometry(message, frames),
        )
        self.all = (self.moment, self.coefficients, self.wind, self.throw)

    def poll(self, now: int, refused: Callable[[Topic], None]) -> None:
        """Take what has arrived and put it in order of the time from which it acts.

        Args:
            now: Stamp of the next step [ns]; a command with an earlier one acts now.
            refused: Told of every topic that has refused a command.
        """
        for topic in self.all:
            if topic.subscription is None:
                continue
            for _ in range(MOST_A_POLL):
                taken = topic.subscription.handle.take_message(topic.type, False)  # noqa: FBT003
                if taken is None:
                    break
                try:
                    self._take(topic, taken[0], now)
                except ConfigError as error:
                    topic.drop(str(error))
                    refused(topic)

    def _take(self, topic: Topic, message: Any, now: int) -> None:
        value = topic.read(message)
        stamp = message.header.stamp
        at = max(stamp.sec * NANOSECONDS + stamp.nanosec, now)
        while at == now and topic.waiting and topic.waiting[0][0] <= now:
            heapq.heappop(topic.waiting)  # this one supersedes it; time may stand still for long
        if len(topic.waiting) >= MOST_WAITING:
            allowed = f'{MOST_WAITING} commands at most may wait for their time'
            raise ConfigError(topic.name, 'one more', allowed)
        heapq.heappush(topic.waiting, (at, next(self._order), value))
        topic.accepted += 1

    def next_time(self) -> float:
        """Return the first time at which a waiting command, not a throw, acts; or infinity."""
        steady = (self.moment, self.coefficients, self.wind)
        return min((t.waiting[0][0] for t in steady if t.waiting), default=math.inf)

    def forget(self) -> None:
        """Let go of all that waits."""
        for topic in self.all:
            topic.waiting.clear()


def pop_due(topic: Topic, now: int) -> Any:
    """Return the newest command of a topic that acts at `now` [ns], or None."""
    value = None
    while topic.waiting and topic.waiting[0][0] <= now:
        value = heapq.heappop(topic.waiting)[2]
    return value


class ActiveControl:
    """The control inputs that act now, and the times at which they fall to zero [ns]."""

    def __init__(self) -> None:
        self.control = Control(axes=DISC_AIR)
        self._moment_until: float = math.inf
        self._coefficients_until: float = math.inf

    def set_moment(self, moment: tuple[float, float, float, int], until: float) -> None:
        """Hold a moment: L, M, N [N m] and their axes."""
        L, M, N, axes = moment
        self.control = self.control._replace(L=L, M=M, N=N, axes=axes)
        self._moment_until = until

    def set_coefficients(self, values: tuple[float, float, float], until: float) -> None:
        """Hold coefficients C_L, C_M, C_N."""
        C_L, C_M, C_N = values
        self.control = self.control._replace(C_L=C_L, C_M=C_M, C_N=C_N)
        self._coefficients_until = until

    def expired(self, now: int) -> tuple[bool, bool]:
        """Say whether the time of the moment and of the coefficients is over."""
        return now >= self._moment_until, now >= self._coefficients_until

    def next_time(self) -> float:
        """Return when the first of them ends, or infinity."""
        return min(self._moment_until, self._coefficients_until)


def _never(message: Any) -> None:
    raise AssertionError(f'the executor took {type(message).__name__}')
