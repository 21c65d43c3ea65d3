"""One topic of the graph on its way into a bag: its subscription, and counts of its messages."""

from collections import OrderedDict
from collections.abc import Callable
import importlib
import math
import re
import time
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.type_support import check_for_type_support

from disc_sim_ros.ros.internals import Taken, WatchedSubscription
from disc_sim_ros.ros.recorder.clock import LogClock
from disc_sim_ros.ros.recorder.qos import same_request
from disc_sim_ros.ros.recorder.sequences import Sequences
from disc_sim_ros.ros.recorder.stall_watch import StallWatch
from disc_sim_ros.ros.recorder.writer_thread import BagTopic

MOST_AT_ONCE = 256  # messages of one topic before the others have their turn
OVERLAP = 1.0  # s that a superseded subscription stays beside its successor
MOST_REMEMBERED = 20_000  # messages that are recognised if they arrive again
_TYPE = re.compile(r'([A-Za-z]\w*)/(msg|srv|action)/([A-Za-z]\w*)')

# The recorder of the topic, data, when it was received and sent [ns], 0 if unknown.
Deliver = Callable[['TopicRecorder', bytes, int, int], None]


class TopicRecorder:
    """Takes every message of one topic as the bytes that arrived. Not thread-safe.

    Attributes:
        name: Name of the topic.
        type_name: Such as 'nav_msgs/msg/Odometry'.
        label: The name, with the type where it is not the first of this topic.
        topic: The topic in the bag.
        tf_topic: `/tf` of the bag, if it is made from this topic.
        publisher_count: Number of matched publishers.
        received: Messages that arrived.
        dropped: Messages that arrived and were not recorded, because too many waited.
        lost: Messages that the middleware reported as lost.
        missing: Gaps in the sequence numbers of the publishers; with several it may be too small.
        before: Messages that the only publisher had sent before the subscription was matched.
        ended: Publishers that ended while this process stood still, or just after that.
        is_late: The topic was recorded before with another type: what its publisher sent until
            the subscription was matched is missing as well.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        type_name: str,
        deliver: Deliver,
        *,
        clock: LogClock,
        stalls: StallWatch,
    ) -> None:
        """Prepare to record; `subscribe` begins.

        Args:
            node: The node that subscribes.
            name: Name of the topic.
            type_name: Its type, such as 'nav_msgs/msg/Odometry'.
            deliver: Called with each message.
            clock: The clock of arrivals.
            stalls: The watch of this process.

        Raises:
            ImportError: The type is not installed.
        """
        self.name = self.label = name
        self.type_name = type_name
        self.topic = BagTopic()
        self.tf_topic: BagTopic | None = None
        self.publisher_count = 0
        self.received = self.dropped = self.lost = self.missing = 0
        self.before = self.ended = 0
        self.is_late = False
        self._is_new = True  # nothing was received yet of the only publisher
        self._type = message_type(type_name)
        self._node = node
        self._deliver = deliver
        self._clock = clock
        self._stalls = stalls
        self._lateness = 0  # the longest since it was last reported [ns]
        self._described = 0  # publishers of the graph in the bag's description
        self._rematched = False  # since then a publisher came or left
        self._sequences = Sequences()
        # When a publisher last came or left [ns]: messages that were received before may be of one
        # that left, and their numbers tell nothing.
        self._matched_at = 0
        self._subscription: WatchedSubscription | None = None
        self._request: QoSProfile | None = None
        self._superseded: list[tuple[float, WatchedSubscription]] = []  # and when to destroy it
        # Messages may arrive twice: latched ones again and again, others while two subscriptions
        # overlap and until the messages of both have been taken.
        self._recent: OrderedDict[tuple[int, int], None] | None = None
        self._repeats = False
        self._overlap_until = 0.0

    @property
    def latched(self) -> bool:
        """Return True if the subscription also gets messages published before it."""
        request = self._request
        return request is not None and request.durability == DurabilityPolicy.TRANSIENT_LOCAL

    def subscribe(self, request: QoSProfile, *, repeats: bool) -> None:
        """Subscribe; if the request has changed, do so again without gap or repetition.

        Args:
            request: The quality of service to request.
            repeats: A publisher is latched: it sends again to each new subscription.
        """
        self._repeats = self._repeats or repeats
        if self._repeats and self._recent is None:
            self._recent = OrderedDict()
        if self._request is not None and same_request(self._request, request):
            return
        new = WatchedSubscription(self._node, self._type, self.name, request)
        if self._subscription is not None:
            end = time.monotonic() + OVERLAP
            self._superseded.append((end, self._subscription))
            self._overlap_until = end + OVERLAP
            self._recent = OrderedDict() if self._recent is None else self._recent
        self._request = request
        self._sequences.forget()
        self._subscription = new

    def update(self) -> None:
        """Process events of the subscription, and end superseded ones whose time is over."""
        now = time.monotonic()
        while self._superseded and self._superseded[0][0] <= now:
            old = self._superseded.pop(0)[1]
            self._take_from(old)
            self.lost += old.events.lost()
            old.destroy()
        if now >= self._overlap_until and not self._repeats:
            self._recent = None
        if self._subscription is not None:
            self.lost += self._subscription.events.lost()
            self._match(self._subscription)
            if self._subscription.events.has_incompatible():
                self._rematched = True

    def is_outdated(self, publishers: int) -> bool:
        """Return True if the bag describes other publishers than there are in the graph.

        Args:
            publishers: Number of publishers in the graph, which may know later than a
                subscription that one came or left.
        """
        return self._rematched or publishers != self._described

    def set_described(self, publishers: int) -> None:
        """Note that the bag describes the publishers of the graph, and how many they are."""
        self._rematched = False
        self._described = publishers

    def count_dropped(self) -> None:
        """Count a message that arrived and is not recorded."""
        self.dropped += 1

    def take_lateness(self) -> int:
        """Return the longest time that a message waited to be taken since the last call [ns]."""
        lateness, self._lateness = self._lateness, 0
        return lateness

    def take(self) -> bool:
        """Take messages, only so many that other topics have their turn; return if more wait."""
        more = False
        for subscription in self._subscriptions():
            more = self._take_from(subscription, MOST_AT_ONCE) or more
        return more

    def drain(self) -> None:
        """Take all messages that arrived before now."""
        now = self._clock.now()
        for subscription in self._subscriptions():
            self._take_from(subscription, until=now)

    def close(self) -> None:
        """Unsubscribe."""
        for subscription in self._subscriptions():
            subscription.destroy()
        self._subscription, self._superseded = None, []

    def _subscriptions(self) -> list[WatchedSubscription]:
        present = [] if self._subscription is None else [self._subscription]
        return [old for _, old in self._superseded] + present

    def _take_from(
        self, subscription: WatchedSubscription, most: int | None = None, until: float = math.inf
    ) -> bool:
        """Take messages, so many or received until then [ns]; return True if more may wait."""
        take = subscription.take
        self._match(subscription)
        missing, count, received = self.missing, 0, 0
        now = self._clock.now()
        taken: Taken | None = None
        while count != most and received <= until:
            taken = take()
            if taken is None:
                break
            data, info = taken
            received = self._clock.at(info['received_timestamp'] or time.time_ns())
            if not count:
                self._lateness = max(self._lateness, now - received)
            count += 1
            self._record(data, info, received)
        if self.missing > missing and self._match(subscription):
            self.missing = missing  # numbers of one that came or left prove no gap
        return taken is not None

    def _match(self, subscription: WatchedSubscription) -> bool:
        """Update the number of publishers; return True if any came or left."""
        count = subscription.events.publisher_count()
        if count is None or subscription is not self._subscription:
            return False
        if count < self.publisher_count and self._stalls.is_recent():
            self.ended += self.publisher_count - count
        self._is_new = self._is_new or not count
        self._matched_at = self._clock.now() if self.publisher_count else 0
        self.publisher_count = count
        self._sequences.forget()
        self._rematched = True
        return True

    def _record(self, data: bytes, info: dict[str, int], received: int) -> None:
        sent = info['source_timestamp']
        if self._recent is not None:
            key = sent, hash(data)
            if key in self._recent:
                return
            self._recent[key] = None
            if len(self._recent) > MOST_REMEMBERED:
                self._recent.popitem(last=False)
        self._count(info['publication_sequence_number'], received)
        self._deliver(self, data, received, max(sent, 0))

    def _count(self, number: int, received: int) -> None:
        self.received += 1
        if self._superseded or not self.publisher_count:
            return
        is_new, self._is_new = self._is_new, False
        if is_new and self.publisher_count == 1 and not self.latched:
            if self.is_late:
                self.missing += number - 1
            else:
                self.before += number - 1
        elif received <= self._matched_at:
            return
        self.missing += self._sequences.gap(number, self.publisher_count)


def message_type(name: str) -> Any:
    """Return the class of a message type.

    The name comes from the network: only modules of messages are imported.

    Raises:
        ImportError: It is not installed, or not the name of a type.
    """
    match = _TYPE.fullmatch(name)
    if match is None:
        raise ImportError(f'{name!r} is not the name of a message type')
    package, kind, class_name = match.groups()
    try:
        message_class = getattr(importlib.import_module(f'{package}.{kind}'), class_name)
        check_for_type_support(message_class)
    except Exception as error:
        raise ImportError(' '.join(str(error).split())) from None
    return message_class
