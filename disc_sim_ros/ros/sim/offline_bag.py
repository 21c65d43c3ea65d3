"""A bag of one flight without nodes or network: the messages of sim_node, as fast as possible."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import floor, inf
from pathlib import Path
from typing import Any

from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

from disc_sim_ros import files
from disc_sim_ros.bags import schemas, transforms
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.ros.cdr_template import CdrTemplate
from disc_sim_ros.ros.qos import discovered_qos
from disc_sim_ros.ros.sim.commands import Commands
from disc_sim_ros.ros.sim.config import SimConfig
from disc_sim_ros.ros.sim.publishers import Publishers
from disc_sim_ros.ros.sim.simulation import Simulation
from disc_sim_ros.topics import Frames
from disc_sim_ros.units import NANOSECONDS

NODE_NAME = 'sim_node'


@dataclass(frozen=True, slots=True)
class Written:
    """What was written to a bag.

    Attributes:
        counts: Messages by topic.
        size: Size of the files [bytes].
    """

    counts: Mapping[str, int]
    size: int


class BagSink:
    """A sink that writes to a bag.

    Attributes:
        has_subscribers: True: the bag takes every message.
    """

    def __init__(
        self, factory: 'BagSinkFactory', topic_id: int, template: CdrTemplate | None
    ) -> None:
        self.has_subscribers = True
        self._factory = factory
        self._topic_id = topic_id
        self._pack = template.pack if template is not None else None
        self.tf_id: int | None = None  # `/tf`, to be made from the messages of this topic

    def send(self, seconds: int, nanoseconds: int, *values: float) -> None:
        """Write the filled template."""
        self.publish(self._pack(seconds, nanoseconds, *values))  # type: ignore[misc]

    def publish(self, message: Any) -> None:
        """Write a message, or its serialised bytes, at the present time of the factory."""
        data: bytes = message if isinstance(message, bytes) else serialize_message(message)
        now = self._factory.now
        self._factory.writer.write(self._topic_id, data, now, now)
        if self.tf_id is not None and (message := transforms.tf_message(data)) is not None:
            self._factory.writer.write(self.tf_id, message, now, now)


class BagSinkFactory:
    """Makes topics of a bag, in the root namespace, described as a recorder discovers them.

    Attributes:
        node_name: Name of the node that would publish.
        now: Log and publish time of the messages written next [ns].
        writer: The bag.
    """

    def __init__(self, writer: BagWriter) -> None:
        self.node_name = NODE_NAME
        self.now = 0
        self.writer = writer

    def sink(
        self, message_type: type, name: str, qos: QoSProfile, template: CdrTemplate | None = None
    ) -> BagSink:
        """Return a new topic of the bag."""
        package = message_type.__module__.split('.', maxsplit=1)[0]
        type_name = f'{package}/msg/{message_type.__name__}'
        topic = Topic(
            name=name if name.startswith('/') else f'/{name}',
            type=type_name,
            definition=schemas.definition(type_name),
            type_hash=schemas.type_hash(type_name) or '',
            qos=(discovered_qos(qos),),
        )
        sink = BagSink(self, self.writer.add(topic), template)
        if topic.type == transforms.TRANSFORM and transforms.is_needed():
            sink.tf_id = self.writer.add(transforms.tf_topic())
            self.writer.custom(*transforms.note([topic.name]))
        return sink


def write_flight(
    bag: str, config: SimConfig, control: Control, duration: float, start: int
) -> Written:
    """Write the bag of one flight, whole or not at all.

    It has all topics of sim_node but those about a process (/diagnostics, /rosout,
    /parameter_events). It ends with the message that shows the disc on the ground, or with the
    last one within the duration.

    Args:
        bag: Folder to make, with its parents.
        config: The configuration, as of a node with the same parameters.
        control: Control coefficients that act from the release on; moments are 0.
        duration: Longest time of flight [s].
        start: Stamp of the release [ns].

    Raises:
        ConfigError: The folder exists or cannot be made.
        DiscSimError: The system refuses to write, or the flight is lost.
    """
    folder = Path(bag)
    distro = schemas.ros_distro()
    try:
        with (
            files.whole_folder('bag', folder) as part,
            BagWriter(part, ros_distro=distro) as writer,
        ):
            _fly(BagSinkFactory(writer), config, control, duration, start)
    except OSError as error:
        raise DiscSimError(f'{folder.absolute()}: cannot be made ({error.strerror})') from None
    return Written(writer.counts, writer.bytes)


def _fly(
    factory: BagSinkFactory, config: SimConfig, control: Control, duration: float, start: int
) -> None:
    """Throw once and publish to the end, as the thread of sim_node does."""
    frames = Frames.prefixed(config.frame_prefix)
    publishers = Publishers(factory, frames, with_clock=False)
    warnings: list[str] = []

    def warn(text: str, _: str = '') -> None:
        warnings.append(text)

    simulation = Simulation(config, publishers, Commands(None, frames), start, warn)
    coefficients = (control.C_L, control.C_M, control.C_N)
    simulation.inputs.active.set_coefficients(coefficients, inf)
    messages = floor(duration * config.publish_rate * (1 + 1e-12))
    factory.now = start
    simulation.throw()
    simulation.publish()
    clock = simulation.clock
    while simulation.flying and messages > 0:
        messages -= 1
        factory.now = clock.at(clock.steps + config.steps_per_publish)
        simulation.advance(config.steps_per_publish)
        simulation.publish()
    if warnings:
        raise DiscSimError(warnings[0])


def epoch(now: int) -> int:
    """Return the stamp at which a bag made at a time [ns] begins: that time in whole seconds."""
    return now // NANOSECONDS * NANOSECONDS
