"""One topic on its way into a bag: its subscription, and what became of its messages."""

from collections.abc import Callable
import importlib
import time
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription

from disc_sim_ros.nodes import offers

MOST_AT_ONCE = 256  # messages of one topic before the others have their turn
OVERLAP = 1.0  # s that an old subscription stays beside the one that follows it

Deliver = Callable[['Track', bytes, int, int], None]  # track, data, received and sent [ns]


class Track:
    """Takes every message of one topic as the bytes that arrived.

    Attributes:
        name: Of the topic.
        type_name: Such as 'nav_msgs/msg/Odometry'.
        topic_id: In the bag.
        stale: A publisher came or went since the bag was told of them.
        received: Messages that came.
        dropped: Messages that came and were not recorded, because too many waited.
        lost: Messages that the middleware says it lost.
        missed: Numbers that are absent in the sequence of the one publisher.
    """

    def __init__(self, node: Node, name: str, type_name: str, deliver: Deliver) -> None:
        """Prepare to record; `listen` begins.

        Raises:
            ImportError: The type is not installed.
        """
        self.name = name
        self.type_name = type_name
        self.topic_id = 0
        self.stale = False
        self.received = self.dropped = self.lost = self.missed = 0
        self._kind = message_type(type_name)
        self._node = node
        self._deliver = deliver
        self._publishers = 0
        self._expected: int | None = None  # the next number of the one publisher
        self._subscription: Subscription | None = None
        self._qos: QoSProfile | None = None
        self._old: list[tuple[float, Subscription]] = []  # when to leave it
        self._seen: dict[tuple[int, bytes], None] | None = None  # while two subscriptions hear
        self._seen_until = 0.0  # and until what both heard has been taken from both

    @property
    def latched(self) -> bool:
        """Whether who comes later gets what was published before."""
        return self._qos is not None and self._qos.durability == DurabilityPolicy.TRANSIENT_LOCAL

    def listen(self, qos: QoSProfile) -> None:
        """Subscribe with what is asked for; go on without gap or repetition if it changes."""
        if self._qos is not None and offers.same(self._qos, qos):
            return
        if self._subscription is not None:
            leave = time.monotonic() + OVERLAP
            self._old.append((leave, self._subscription))
            self._seen_until = leave + OVERLAP
            self._seen = {} if self._seen is None else self._seen
        self._qos = qos
        self._expected = None
        self._subscription = self._subscribe(qos)

    def tidy(self) -> None:
        """Leave subscriptions that have been followed by others."""
        now = time.monotonic()
        while self._old and self._old[0][0] <= now:
            old = self._old.pop(0)[1]
            self._drain(old)
            self._node.destroy_subscription(old)
        if now >= self._seen_until:
            self._seen = None

    def drain(self) -> None:
        """Take all that has arrived."""
        for subscription in self._subscriptions():
            self._drain(subscription)

    def _subscriptions(self) -> list[Subscription]:
        now = [] if self._subscription is None else [self._subscription]
        return [old for _, old in self._old] + now

    def _subscribe(self, qos: QoSProfile) -> Subscription:
        events = SubscriptionEventCallbacks(
            matched=self._on_matched,
            message_lost=self._on_lost,
            incompatible_qos=self._on_incompatible,
        )
        handle: Any = None
        kind, take = self._kind, self._take

        def receive(data: Any, info: Any) -> None:
            take(data, info)
            for _ in range(MOST_AT_ONCE):
                more = handle.take_message(kind, True)  # noqa: FBT003 - raw; knows no names
                if more is None:
                    return
                take(*more)

        subscription = self._node.create_subscription(
            kind,
            self.name,
            receive,  # type: ignore[arg-type]  # two arguments are fine, only not declared
            qos,
            raw=True,
            event_callbacks=events,
        )
        handle = subscription.handle
        return subscription

    def _drain(self, subscription: Subscription) -> None:
        handle = subscription.handle
        while (more := handle.take_message(self._kind, True)) is not None:  # noqa: FBT003
            self._take(*more)

    def _take(self, data: bytes, info: dict[str, int]) -> None:
        sent = info['source_timestamp']
        if self._seen is not None:
            if (sent, data) in self._seen:
                return
            self._seen[sent, data] = None
        self._count(info['publication_sequence_number'])
        self._deliver(self, data, info['received_timestamp'] or time.time_ns(), sent)

    def _count(self, number: int) -> None:
        self.received += 1
        if self._publishers == 1 and not self._old:
            if self._expected is not None and number > self._expected:
                self.missed += number - self._expected
            self._expected = number + 1

    def _on_matched(self, status: Any) -> None:
        if status.current_count != self._publishers:
            self._expected = None
        self._publishers = status.current_count
        self.stale = True

    def _on_lost(self, status: Any) -> None:
        self.lost += status.total_count_change

    def _on_incompatible(self, _: Any) -> None:
        self.stale = True


def message_type(name: str) -> Any:
    """Return the class of a message type.

    Raises:
        ImportError: It is not installed.
    """
    package, _, rest = name.partition('/')
    kind, _, what = rest.partition('/')
    try:
        found = getattr(importlib.import_module(f'{package}.{kind}'), what)
        found.__class__.__import_type_support__()
    except AttributeError as error:
        raise ImportError(str(error)) from None
    return found
