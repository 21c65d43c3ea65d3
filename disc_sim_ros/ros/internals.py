"""Subscriptions whose messages and events a thread takes when it likes, without the executor.

The executor wakes for each message and builds a set of all it waits for, each time; and it wakes
for each message even where it waits only for events of a subscription, because both share a
condition in Fast DDS. Taken every 10 ms, 10,000 messages a second cost a third of the CPU
(benchmarks/recorder.py: 63 % of a core through the executor, 21 % polled).
"""

from contextlib import suppress
from typing import Any

from rclpy._rclpy_pybind11 import EventHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.event_handler import (
    QoSSubscriptionEventType,
    SubscriptionEventCallbacks,
    UnsupportedEventTypeError,
)
from rclpy.subscription import Subscription

NO_EVENTS = SubscriptionEventCallbacks(use_default_callbacks=False)  # for the executor


class Polled(ReentrantCallbackGroup):
    """Keeps subscriptions out of the executor, except where they cannot be polled."""

    def can_execute(self, entity: Any) -> bool:
        """Say whether the executor is to look after something."""
        return not (isinstance(entity, Subscription) and can_be_polled(entity))


def can_be_polled(subscription: Subscription) -> bool:
    """Say whether messages can be taken without the executor: rclpy does not promise it."""
    return hasattr(subscription.handle, 'take_message')


class Events:
    """What became of one subscription: publishers that came and went, messages lost."""

    def __init__(self, subscription: Subscription) -> None:
        """Watch a subscription; `destroy` this before it."""
        kinds = QoSSubscriptionEventType
        self._matched = _event(subscription, kinds.RCL_SUBSCRIPTION_MATCHED)
        self._lost = _event(subscription, kinds.RCL_SUBSCRIPTION_MESSAGE_LOST)
        self._incompatible = _event(
            subscription, kinds.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS
        )

    def publishers(self) -> int | None:
        """Return how many publishers there are if any came or went since the last call."""
        status = _taken(self._matched)
        if status is None or not (status.total_count_change or status.current_count_change):
            return None
        return int(status.current_count)

    def lost(self) -> int:
        """Return how many messages the middleware lost since the last call."""
        status = _taken(self._lost)
        return 0 if status is None else int(status.total_count_change)

    def left_out(self) -> bool:
        """Say whether publishers came since the last call whose offer is too little."""
        status = _taken(self._incompatible)
        return status is not None and status.total_count_change > 0

    def destroy(self) -> None:
        """Watch no more."""
        for event in (self._matched, self._lost, self._incompatible):
            if event is not None:
                event.destroy_when_not_in_use()


def _event(subscription: Subscription, kind: Any) -> Any:
    with suppress(UnsupportedEventTypeError), subscription.handle:
        return EventHandle(subscription.handle, kind)
    return None


def _taken(event: Any) -> Any:
    if event is None:
        return None
    with event:
        return event.take_event()
