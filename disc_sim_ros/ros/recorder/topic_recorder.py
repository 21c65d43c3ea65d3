"""One topic on its way into a bag: its subscription, and what became of its messages."""

from collections import OrderedDict
from collections.abc import Callable
import importlib
import math
import re
import time
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription

from disc_sim_ros.ros.internals import NO_EVENTS, Events, Polled, can_be_polled
from disc_sim_ros.ros.recorder import qos as ros_qos
from disc_sim_ros.ros.recorder.clock import LogClock

MOST_AT_ONCE = 256  # messages of one topic before the others have their turn
OVERLAP = 1.0  # s that an old subscription stays beside the one that follows it
MOST_REMEMBERED = 20_000  # messages that would be known if they came again
_TYPE = re.compile(r'([A-Za-z]\w*)/(msg|srv|action)/([A-Za-z]\w*)')

Deliver = Callable[['TopicRecorder', bytes, int, int], None]  # track, data, received and sent [ns]


class _Heard:
    """A subscription and what happens to it."""

    def __init__(self, subscription: Subscription) -> None:
        self.subscription = subscription
        self.events = Events(subscription)

    def destroy(self, node: Node) -> None:
        self.events.destroy()
        node.destroy_subscription(self.subscription)


class TopicRecorder:
    """Takes every message of one topic as the bytes that arrived. Not thread-safe.

    Attributes:
        name: Of the topic.
        type_name: Such as 'nav_msgs/msg/Odometry'.
        topic_id: In the bag.
        stale: A publisher came or went since the bag was told of them.
        known: How many there were in the graph when it was told.
        publishers: How many are heard.
        received: Messages that came.
        dropped: Messages that came and were not recorded, because too many waited.
        lost: Messages that the middleware says it lost.
        missed: Numbers that are absent in the sequence of the one publisher.
        lateness: Longest time that a message waited to be taken, since this was set to 0 [ns].
    """

    def __init__(
        self,
        node: Node,
        name: str,
        type_name: str,
        group: Polled,
        deliver: Deliver,
        *,
        clock: LogClock,
    ) -> None:
        """Prepare to record; `listen` begins.

        Raises:
            ImportError: The type is not installed.
        """
        self.name = name
        self.type_name = type_name
        self.topic_id = 0
        self.stale = False
        self.known = self.publishers = 0
        self.received = self.dropped = self.lost = self.missed = 0
        self.lateness = 0
        self._kind = message_type(type_name)
        self._node = node
        self._group = group
        self._deliver = deliver
        self._clock = clock
        self._expected: int | None = None  # the next number of the one publisher
        self._heard: _Heard | None = None
        self._qos: QoSProfile | None = None
        self._old: list[tuple[float, _Heard]] = []  # when to leave it
        self._seen: OrderedDict[tuple[int, int], None] | None = None  # what may come again
        self._remember = False  # as long as this is recorded
        self._seen_until = 0.0  # and until what two subscriptions heard was taken from both

    @property
    def latched(self) -> bool:
        """Whether who comes later gets what was published before."""
        return self._qos is not None and self._qos.durability == DurabilityPolicy.TRANSIENT_LOCAL

    def listen(self, qos: QoSProfile, *, repeating: bool) -> None:
        """Subscribe with what is asked for; go on without gap or repetition if it changes.

        Args:
            qos: To ask for.
            repeating: A publisher is latched: it sends again to each new subscription.
        """
        self._remember = self._remember or repeating
        if self._remember and self._seen is None:
            self._seen = OrderedDict()
        if self._qos is not None and ros_qos.same(self._qos, qos):
            return
        new = _Heard(self._subscribe(qos))
        if self._heard is not None:
            leave = time.monotonic() + OVERLAP
            self._old.append((leave, self._heard))
            self._seen_until = leave + OVERLAP
            self._seen = OrderedDict() if self._seen is None else self._seen
        self._qos = qos
        self._expected = None
        self._heard = new

    def tidy(self) -> None:
        """Note what was lost and who was left out; leave what has been followed by another."""
        now = time.monotonic()
        while self._old and self._old[0][0] <= now:
            old = self._old.pop(0)[1]
            self._take_from(old)
            self.lost += old.events.lost()
            old.destroy(self._node)
        if now >= self._seen_until and not self._remember:
            self._seen = None
        if self._heard is not None:
            self.lost += self._heard.events.lost()
            self._match(self._heard)
            self.stale = self.stale or self._heard.events.left_out()

    def take(self) -> bool:
        """Take what has come, so much that others have their turn; say whether there is more."""
        more = False
        for heard in self._all():
            more = self._take_from(heard, MOST_AT_ONCE) or more
        return more

    def drain(self) -> None:
        """Take all that came before now."""
        now = self._clock.now()
        for heard in self._all():
            self._take_from(heard, until=now)

    def close(self) -> None:
        """Hear no more."""
        for heard in self._all():
            heard.destroy(self._node)
        self._heard, self._old = None, []

    def _all(self) -> list[_Heard]:
        now = [] if self._heard is None else [self._heard]
        return [old for _, old in self._old] + now

    def _subscribe(self, qos: QoSProfile) -> Subscription:
        return self._node.create_subscription(
            self._kind,
            self.name,
            self._take_one,  # type: ignore[arg-type]  # two arguments are fine, only not declared
            qos,
            callback_group=self._group,
            raw=True,
            event_callbacks=NO_EVENTS,
        )

    def _take_from(self, heard: _Heard, most: int | None = None, until: float = math.inf) -> bool:
        """Take messages, as many or received until then [ns]; say whether there is more."""
        if not can_be_polled(heard.subscription):
            return False
        take, kind = heard.subscription.handle.take_message, self._kind
        self._match(heard)
        missed, taken, received = self.missed, 0, 0
        now = self._clock.now()
        found: tuple[bytes, dict[str, int]] | None = None
        while taken != most and received <= until:
            found = take(kind, True)  # noqa: FBT003 - raw; it knows no names
            if found is None:
                break
            data, info = found
            received = self._clock.of(info['received_timestamp'] or time.time_ns())
            if not taken:
                self.lateness = max(self.lateness, now - received)
            taken += 1
            self._take(data, info, received)
        if self.missed > missed and self._match(heard):
            self.missed = missed  # numbers of several publishers tell nothing
        return found is not None

    def _match(self, heard: _Heard) -> bool:
        """Note if publishers came or went; return whether any did."""
        publishers = heard.events.publishers()
        if publishers is None or heard is not self._heard:
            return False
        self.publishers = publishers
        self._expected = None
        self.stale = True
        return True

    def _take_one(self, data: bytes, info: dict[str, int]) -> None:
        """Take what the executor hands over, where messages cannot be polled."""
        self._clock.now()
        self._take(data, info, self._clock.of(info['received_timestamp'] or time.time_ns()))

    def _take(self, data: bytes, info: dict[str, int], received: int) -> None:
        sent = info['source_timestamp']
        if self._seen is not None:
            key = sent, hash(data)
            if key in self._seen:
                return
            self._seen[key] = None
            if len(self._seen) > MOST_REMEMBERED:
                self._seen.popitem(last=False)
        self._count(info['publication_sequence_number'])
        self._deliver(self, data, received, max(sent, 0))

    def _count(self, number: int) -> None:
        self.received += 1
        if self.publishers == 1 and not self._old:
            if self._expected is not None and number > self._expected:
                self.missed += number - self._expected
            self._expected = number + 1


def message_type(name: str) -> Any:
    """Return the class of a message type.

    The name comes from the network: nothing is imported but modules of messages.

    Raises:
        ImportError: It is not installed, or no name of a type.
    """
    match = _TYPE.fullmatch(name)
    if match is None:
        raise ImportError(f'{name!r} is not the name of a message type')
    package, kind, what = match.groups()
    try:
        found = getattr(importlib.import_module(f'{package}.{kind}'), what)
        found.__class__.__import_type_support__()
    except Exception as error:
        raise ImportError(' '.join(str(error).split())) from None
    return found
