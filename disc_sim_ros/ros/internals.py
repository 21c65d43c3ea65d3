"""Every private part of rclpy that this package uses, each with a public fallback.

- `Subscription.handle.take_message`: a thread takes messages when it likes. Without it, the
  executor puts them into a queue, from which the thread takes them.
- `_rclpy_pybind11.EventHandle`: a thread polls the events of a subscription. Without it, the
  executor reports them.
- `handle.pointer` of publishers and subscriptions, and the C functions of rcl: compiled code
  publishes and takes messages (`native_topics`). Without them, Python does.
- `Node._parameter_overrides`: a misspelt parameter in a file or on the command line is an error.
  Without it, only parameters that exist take their values; other names are ignored.

The executor of rclpy wakes for each message and rebuilds its wait set each time; and it wakes for
each message even where it waits only for events of a subscription, because Fast DDS has one
condition for both. Polled every 10 ms instead, 10,000 messages a second cost a third of the CPU
(benchmarks/recorder.py: 63 % of a core through the executor, 21 % polled). The fallbacks cost what
the executor costs, and messages that it has not taken when it ends are lost.
"""

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, suppress
import ctypes
from functools import partial
import os
import platform
import sys
import threading
from typing import Any, Protocol

import numpy as np
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.event_handler import (
    QoSSubscriptionEventType,
    SubscriptionEventCallbacks,
    UnsupportedEventTypeError,
)
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

try:
    import rclpy._rclpy_pybind11 as _rclpy
except ImportError:
    _rclpy = None

Taken = tuple[Any, dict[str, int]]  # a message, or its bytes, and its message info
_NO_EVENTS = SubscriptionEventCallbacks(use_default_callbacks=False)


class SubscriptionEvents(Protocol):
    """Events of one subscription since they were last asked for."""

    def publisher_count(self) -> int | None:
        """Return the number of matched publishers, or None if none came or left."""

    def lost(self) -> int:
        """Return how many messages the middleware lost."""

    def has_incompatible(self) -> bool:
        """Return True if a publisher came whose QoS offers less than the subscription requests."""

    def destroy(self) -> None:
        """Stop watching; call this before the subscription is destroyed."""


class PolledSubscription:
    """A subscription whose messages a thread takes, without the executor.

    Where rclpy has no `take_message`, the executor that spins the node puts messages into a queue
    as deep as the QoS says; as in the middleware, a full queue loses its oldest message.

    Attributes:
        take: `take() -> Taken | None` returns the oldest message that was not taken yet.
    """

    take: Callable[[], Taken | None]

    def __init__(
        self,
        node: Node,
        message_type: type,
        topic: str,
        qos: QoSProfile,
        *,
        raw: bool = False,
        event_callbacks: SubscriptionEventCallbacks = _NO_EVENTS,
    ) -> None:
        """Subscribe.

        Args:
            node: The node that subscribes.
            message_type: Class of the messages.
            topic: Name of the topic.
            qos: What the subscription requests.
            raw: Take serialised messages, as bytes.
            event_callbacks: What the executor calls at events of the subscription.
        """
        self._node = node
        self._queue: deque[Taken] = deque(maxlen=qos.depth)
        self._subscription = node.create_subscription(
            message_type,
            topic,
            self._enqueue,  # type: ignore[arg-type]  # a callback with two arguments is allowed
            qos,
            callback_group=_PolledGroup(),
            raw=raw,
            event_callbacks=event_callbacks,
        )
        take = _take_message_of(self._subscription)
        self.take = self._dequeue if take is None else partial(take, message_type, raw)

    @property
    def handle(self) -> Any:
        """Return the handle that takes messages; AttributeError where the executor takes them."""
        handle = self._subscription.handle
        handle.take_message  # noqa: B018
        return handle

    def has_publishers(self) -> bool:
        """Return True while a publisher is matched; for any thread."""
        return self._subscription.get_publisher_count() > 0

    def destroy(self) -> None:
        """Unsubscribe."""
        self._node.destroy_subscription(self._subscription)

    def _enqueue(self, message: Any, info: dict[str, int]) -> None:
        self._queue.append((message, info))

    def _dequeue(self) -> Taken | None:
        return self._queue.popleft() if self._queue else None


class WatchedSubscription(PolledSubscription):
    """A polled subscription to serialised messages, with its events.

    Attributes:
        events: Events of the subscription.
    """

    events: SubscriptionEvents

    def __init__(self, node: Node, message_type: type, topic: str, qos: QoSProfile) -> None:
        """Subscribe; see `PolledSubscription` for the arguments."""
        event_handle = _event_handle_class()
        if event_handle is None:
            events = _ReportedEvents()
            super().__init__(
                node, message_type, topic, qos, raw=True, event_callbacks=events.callbacks
            )
            self.events = events
        else:
            super().__init__(node, message_type, topic, qos, raw=True)
            self.events = _PolledEvents(self._subscription, event_handle)

    def destroy(self) -> None:
        """Stop watching and unsubscribe."""
        self.events.destroy()
        super().destroy()


class _Allocator(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_void_p) for name in ('a', 'b', 'c', 'd', 'state'))


class NativeTopics:
    """Addresses of C functions, and of the publishers and subscriptions of a node.

    They stay valid until `close`, even if the node is destroyed before.

    Attributes:
        functions: Addresses of functions of rcl and of the C library, by `tick.Functions`.
        publishers: Addresses of `rcl_publisher_t`.
        subscriptions: Addresses of `rcl_subscription_t`.
        inbox: A `rcl_serialized_message_t` to take messages into, int64: address and length of
            the bytes first; shape (8,).
    """

    def __init__(
        self, publishers: Sequence[Publisher], subscriptions: Sequence[PolledSubscription]
    ) -> None:
        """Look everything up; AttributeError, OSError or ValueError where something is absent."""
        if sys.platform != 'linux' or platform.machine() not in {'x86_64', 'aarch64'}:
            raise OSError('compiled code calls C functions on Linux alone, on 64-bit processors')
        rcl, self._rcutils = _loaded_library('librcl.so'), _loaded_library('librcutils.so')
        libc = ctypes.CDLL(None)
        self.functions = {
            'publish': _address(rcl.rcl_publish_serialized_message),
            'take': _address(rcl.rcl_take_serialized_message),
            'publisher_count': _address(rcl.rcl_subscription_get_publisher_count),
            'time': _address(libc.clock_gettime),
            'sleep': _address(libc.clock_nanosleep),
        }
        self._rcutils.rcutils_get_default_allocator.restype = _Allocator
        allocator = self._rcutils.rcutils_get_default_allocator()
        self.inbox = np.zeros(8, dtype=np.int64)
        self._address = ctypes.c_void_p(self.inbox.ctypes.data)
        with ExitStack() as held:
            of_publishers = [publisher.handle for publisher in publishers]
            of_subscriptions = [subscription.handle for subscription in subscriptions]
            for handle in (*of_publishers, *of_subscriptions):
                held.enter_context(handle)
            self.publishers = _addresses(of_publishers, rcl.rcl_publisher_get_topic_name)
            self.subscriptions = _addresses(of_subscriptions, rcl.rcl_subscription_get_topic_name)
            make = self._rcutils.rcutils_uint8_array_init
            if make(self._address, ctypes.c_size_t(1024), ctypes.byref(allocator)) != 0:
                raise OSError('no memory for messages')
            held.callback(self._rcutils.rcutils_uint8_array_fini, self._address)
            self._held = held.pop_all()

    def taken(self) -> bytes:
        """Return the serialised message in the inbox."""
        return ctypes.string_at(int(self.inbox[0]), int(self.inbox[1]))

    def close(self) -> None:
        """Release everything."""
        self._held.close()


def native_topics(
    publishers: Sequence[Publisher], subscriptions: Sequence[PolledSubscription]
) -> NativeTopics | None:
    """Return what compiled code needs of a node's topics; None where rclpy does not give it."""
    try:
        return NativeTopics(publishers, subscriptions)
    except (AttributeError, OSError, ValueError):
        return None


def _loaded_library(name: str) -> ctypes.CDLL:
    """Return a library that rclpy has loaded: no other one may get its handles."""
    return ctypes.CDLL(name, mode=os.RTLD_NOLOAD | os.RTLD_NOW)


def _address(function: Any) -> int:
    return ctypes.cast(function, ctypes.c_void_p).value or 0


def _addresses(handles: Sequence[Any], topic_name: Any) -> list[int]:
    """Return the addresses of handles, each checked by the name of its topic."""
    topic_name.argtypes, topic_name.restype = [ctypes.c_void_p], ctypes.c_char_p
    for handle in handles:
        if topic_name(handle.pointer) != handle.get_topic_name().encode():
            raise ValueError('the address is not that of the handle')
    return [handle.pointer for handle in handles]


def parameter_overrides(node: Node, names: Iterable[str]) -> dict[str, object]:
    """Return the parameters that files, command line and constructor set for a node.

    Args:
        node: The node.
        names: Parameters that are not declared yet. Where rclpy does not give the overrides, each
            is declared for a moment with a dynamic type, which takes its override; overrides of
            other names stay unknown then.
    """
    overrides = getattr(node, '_parameter_overrides', None)
    if overrides is not None:
        return {parameter.name: parameter.value for parameter in overrides.values()}
    overridden: dict[str, object] = {}
    for name in names:
        if node.has_parameter(name):
            continue
        any_type = ParameterDescriptor(dynamic_typing=True)
        value = node.declare_parameter(name, None, any_type).value
        node.undeclare_parameter(name)
        if value is not None:
            overridden[name] = value
    return overridden


def has_qos_override(node: Node, topic: str) -> bool:
    """Return True if files, command line or constructor may override the QoS of a topic.

    Args:
        node: The node.
        topic: Name of the topic, relative or absolute. Where rclpy does not give the overrides,
            the answer is True.
    """
    overrides = getattr(node, '_parameter_overrides', None)
    prefix = f'qos_overrides.{node.resolve_topic_name(topic)}.'
    return overrides is None or any(name.startswith(prefix) for name in overrides)


def _take_message_of(subscription: Subscription) -> Callable[..., Taken | None] | None:
    """Return the function that takes a message without the executor; None if there is none."""
    take: Callable[..., Taken | None] | None = getattr(
        getattr(subscription, 'handle', None), 'take_message', None
    )
    return take


def _event_handle_class() -> Any:
    """Return the class of events that a thread can poll; None if there is none."""
    if not hasattr(Subscription, 'handle'):
        return None
    return getattr(_rclpy, 'EventHandle', None)


class _PolledGroup(ReentrantCallbackGroup):
    """Keeps a subscription out of the executor if a thread can take its messages."""

    def can_execute(self, entity: Any) -> bool:
        """Return True if the executor handles an entity: an event, or what cannot be polled."""
        return not (isinstance(entity, Subscription) and _take_message_of(entity) is not None)


class _PolledEvents:
    """Events that a thread takes from the middleware."""

    def __init__(self, subscription: Subscription, event_handle: Any) -> None:
        def event(kind: Any) -> Any:
            with suppress(UnsupportedEventTypeError), subscription.handle:
                return event_handle(subscription.handle, kind)
            return None

        kinds = QoSSubscriptionEventType
        self._matched = event(kinds.RCL_SUBSCRIPTION_MATCHED)
        self._lost = event(kinds.RCL_SUBSCRIPTION_MESSAGE_LOST)
        self._incompatible = event(kinds.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS)

    def publisher_count(self) -> int | None:
        status = _status_of(self._matched)
        if status is None or not (status.total_count_change or status.current_count_change):
            return None
        return int(status.current_count)

    def lost(self) -> int:
        status = _status_of(self._lost)
        return 0 if status is None else int(status.total_count_change)

    def has_incompatible(self) -> bool:
        status = _status_of(self._incompatible)
        return status is not None and status.total_count_change > 0

    def destroy(self) -> None:
        for event in (self._matched, self._lost, self._incompatible):
            if event is not None:
                event.destroy_when_not_in_use()


def _status_of(event: Any) -> Any:
    """Return the status that an event has now; None where the middleware has no such event."""
    if event is None:
        return None
    with event:
        return event.take_event()


class _ReportedEvents:
    """Events that the executor reports, kept until a thread asks for them.

    Attributes:
        callbacks: What the subscription is created with.
    """

    def __init__(self) -> None:
        self.callbacks = SubscriptionEventCallbacks(
            matched=self._on_matched,
            message_lost=self._on_lost,
            incompatible_qos=self._on_incompatible,
            use_default_callbacks=False,
        )
        self._lock = threading.Lock()
        self._publisher_count: int | None = None
        self._lost = 0
        self._incompatible = False

    def publisher_count(self) -> int | None:
        with self._lock:
            count, self._publisher_count = self._publisher_count, None
        return count

    def lost(self) -> int:
        with self._lock:
            lost, self._lost = self._lost, 0
        return lost

    def has_incompatible(self) -> bool:
        with self._lock:
            incompatible, self._incompatible = self._incompatible, False
        return incompatible

    def destroy(self) -> None:
        """Do nothing: the events end with the subscription."""

    def _on_matched(self, status: Any) -> None:
        with self._lock:
            self._publisher_count = int(status.current_count)

    def _on_lost(self, status: Any) -> None:
        with self._lock:
            self._lost += int(status.total_count_change)

    def _on_incompatible(self, _: Any) -> None:
        with self._lock:
            self._incompatible = True
