"""Where messages go: what `outputs.Outputs` needs of it, and the one that is publishers of a node.

`flight_bag` has another one, which writes the same messages into a bag.
"""

from typing import Any, Protocol

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions

from disc_sim_ros.ros.cdr_template import CdrTemplate


class Sink(Protocol):
    """One topic and whether anybody listens, which costs nothing to ask.

    Attributes:
        heard: Whether the topic has a subscriber.
    """

    heard: bool

    def send(self, seconds: int, nanoseconds: int, *values: float) -> None:
        """Publish the template with a stamp and values; see `cdr_template.CdrTemplate`."""

    def publish(self, message: Any) -> None:
        """Publish a message that was built whole, or its bytes."""


class SinkFactory(Protocol):
    """Makes channels.

    Attributes:
        name: Of who publishes, with namespace and without a slash in front.
    """

    name: str

    def channel(
        self, kind: type, name: str, qos: QoSProfile, wire: CdrTemplate | None = None
    ) -> Sink:
        """Return a channel for a type of messages, with their template where they have one."""


class PublisherSink:
    """A channel that is a publisher of a node, whose QoS can be overridden by parameters.

    Attributes:
        heard: Whether the topic has a subscriber.
    """

    def __init__(
        self, node: Node, kind: type, name: str, qos: QoSProfile, wire: CdrTemplate | None = None
    ) -> None:
        self.heard = False
        self.publisher: Publisher = node.create_publisher(
            kind,
            name,
            qos,
            event_callbacks=PublisherEventCallbacks(matched=self._on_matched),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self._pack = wire.pack if wire is not None else None
        self._publish = self.publisher.publish

    def send(self, seconds: int, nanoseconds: int, *values: float) -> None:
        """Publish the patched template."""
        self._publish(self._pack(seconds, nanoseconds, *values))  # type: ignore[misc]

    def publish(self, message: Any) -> None:
        """Publish a message that was built whole."""
        self._publish(message)

    def _on_matched(self, status: Any) -> None:
        self.heard = status.current_count > 0


class PublisherSinkFactory:
    """The publishers of a node.

    Attributes:
        name: Of the node.
    """

    def __init__(self, node: Node) -> None:
        self.name = node.get_fully_qualified_name()[1:]
        self._node = node

    def channel(
        self, kind: type, name: str, qos: QoSProfile, wire: CdrTemplate | None = None
    ) -> PublisherSink:
        """Return a new publisher."""
        return PublisherSink(self._node, kind, name, qos, wire)
