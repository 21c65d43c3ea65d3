"""Where the messages of the simulator go: a sink for each topic.

`PublisherSink` publishes on a node; `sim.offline_bag.BagSink` writes the same messages to a bag.
"""

from collections.abc import Callable
from typing import Any, Protocol

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions

from disc_sim_ros.ros.cdr_template import CdrTemplate
from disc_sim_ros.ros.internals import has_qos_override


class Sink(Protocol):
    """One topic.

    Attributes:
        has_subscribers: Whether anything would take a message; reading it costs nothing.
    """

    has_subscribers: bool

    def send(self, seconds: int, nanoseconds: int, *values: float) -> None:
        """Publish the template with a stamp and values; see `cdr_template.CdrTemplate`."""

    def publish(self, message: Any) -> None:
        """Publish a complete message, or its serialised bytes."""


class SinkFactory(Protocol):
    """Makes the sinks of one simulator.

    Attributes:
        node_name: Name of the node that publishes, with namespace, without the leading slash.
    """

    node_name: str

    def sink(
        self, message_type: type, name: str, qos: QoSProfile, template: CdrTemplate | None = None
    ) -> Sink:
        """Return a new sink for messages of a type, with the template that `send` fills."""


class PublisherSink:
    """A sink that is a publisher of a node; parameters of the node can override its QoS.

    Attributes:
        has_subscribers: Whether the topic has a subscriber.
        publisher: The publisher.
        template: What `send` fills.
    """

    def __init__(  # noqa: PLR0917
        self,
        node: Node,
        message_type: type,
        name: str,
        qos: QoSProfile,
        template: CdrTemplate | None = None,
        on_change: Callable[[], None] = lambda: None,
    ) -> None:
        """Create the publisher; `on_change` is called after `has_subscribers` has changed."""
        self.has_subscribers = False
        self.template = template
        self._on_change = on_change
        self.publisher: Publisher = node.create_publisher(
            message_type,
            name,
            qos,
            event_callbacks=PublisherEventCallbacks(matched=self._on_matched),
            # Only where they are used: 150 parameters would hide those of the simulator.
            qos_overriding_options=QoSOverridingOptions.with_default_policies()
            if has_qos_override(node, name)
            else None,
        )
        self._pack = template.pack if template is not None else None
        self._publish = self.publisher.publish

    def send(self, seconds: int, nanoseconds: int, *values: float) -> None:
        """Publish the filled template."""
        self._publish(self._pack(seconds, nanoseconds, *values))  # type: ignore[misc]

    def publish(self, message: Any) -> None:
        """Publish a complete message, or its serialised bytes."""
        self._publish(message)

    def _on_matched(self, status: Any) -> None:
        self.has_subscribers = status.current_count > 0
        self._on_change()


class PublisherSinkFactory:
    """Makes publishers of a node.

    Attributes:
        node_name: Name of the node, with namespace, without the leading slash.
        on_change: Called after a subscriber has come or gone, from the thread of the executor.
    """

    def __init__(self, node: Node) -> None:
        self.on_change: Callable[[], None] = lambda: None
        self.node_name = node.get_fully_qualified_name()[1:]
        self._node = node

    def _on_change(self) -> None:
        self.on_change()

    def sink(
        self, message_type: type, name: str, qos: QoSProfile, template: CdrTemplate | None = None
    ) -> PublisherSink:
        """Return a new publisher."""
        return PublisherSink(self._node, message_type, name, qos, template, self._on_change)
