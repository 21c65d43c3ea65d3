"""A bag of one flight without nodes or network: the messages of sim_node, as fast as possible."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import floor, inf
from pathlib import Path
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message

from disc_sim_ros import files
from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.topic import Qos, Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.ros.cdr_template import CdrTemplate
from disc_sim_ros.ros.sim.clock import NANOSECONDS
from disc_sim_ros.ros.sim.commands import Commands
from disc_sim_ros.ros.sim.config import SimConfig
from disc_sim_ros.ros.sim.publishers import Outputs
from disc_sim_ros.ros.sim.simulation import Simulation
from disc_sim_ros.topics import Frames

NODE_NAME = 'sim_node'


@dataclass(frozen=True, slots=True)
class Written:
    """What a bag got.

    Attributes:
        counts: Messages by topic.
        size: Size of the files [bytes].
    """

    counts: Mapping[str, int]
    size: int


class BagSink:
    """A channel that writes into a bag. It always listens.

    Attributes:
        heard: True.
    """

    def __init__(self, medium: 'BagSinkFactory', topic: int, wire: CdrTemplate | None) -> None:
        self.heard = True
        self._medium = medium
        self._topic = topic
        self._pack = wire.pack if wire is not None else None

    def send(self, seconds: int, nanoseconds: int, *values: float) -> None:
        """Write the patched template."""
        self.publish(self._pack(seconds, nanoseconds, *values))  # type: ignore[misc]

    def publish(self, message: Any) -> None:
        """Write a message, or its bytes, at the present time of the simulation."""
        data = message if isinstance(message, bytes) else serialize_message(message)
        now = self._medium.now
        self._medium.writer.write(self._topic, data, now, now)


class BagSinkFactory:
    """Topics of a bag, in the root namespace, described as a recorder finds them.

    Attributes:
        name: Of the node that would publish.
        now: Time at which messages are written [ns].
        writer: The bag.
    """

    def __init__(self, writer: BagWriter) -> None:
        self.name = NODE_NAME
        self.now = 0
        self.writer = writer

    def channel(
        self, kind: type, name: str, qos: QoSProfile, wire: CdrTemplate | None = None
    ) -> BagSink:
        """Return a new topic of the bag."""
        type_name = f'{kind.__module__.split(".", maxsplit=1)[0]}/msg/{kind.__name__}'
        topic = Topic(
            name=name if name.startswith('/') else f'/{name}',
            type=type_name,
            definition=schemas.definition(type_name) or '',
            type_hash=schemas.type_hash(type_name) or '',
            qos=(discovered(qos),),
        )
        return BagSink(self, self.writer.add(topic), wire)


def discovered(qos: QoSProfile) -> Qos:
    """Return the QoS of a publisher as others discover it: DDS does not tell history and depth."""
    reliable = qos.reliability == ReliabilityPolicy.RELIABLE
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return Qos(
        history='unknown',
        depth=0,
        reliability='reliable' if reliable else 'best_effort',
        durability='transient_local' if latched else 'volatile',
    )


def write_flight(
    bag: str, config: SimConfig, control: Control, duration: float, start: int
) -> Written:
    """Write the bag of one flight, whole or not at all.

    It has all topics of sim_node but those that tell of a process (/diagnostics, /rosout,
    /parameter_events). It ends with the message that shows the disc on the ground, or at the last
    one within the duration.

    Args:
        bag: Folder to make, with its parents.
        config: As of a node with the same parameters.
        control: Control coefficients that are held from the release on; moments are 0.
        duration: Longest time of flight [s].
        start: Stamp of the release [ns].

    Raises:
        ConfigError: The folder exists or cannot be made.
        DiscSimError: The system refuses to write, or the flight is lost.
    """
    folder = Path(bag)
    try:
        with files.whole_folder('bag', folder) as part, BagWriter(part) as writer:
            _fly(BagSinkFactory(writer), config, control, duration, start)
    except OSError as error:
        raise DiscSimError(f'{folder.absolute()}: cannot be made ({error.strerror})') from None
    return Written(writer.counts, writer.bytes)


def _fly(
    medium: BagSinkFactory, config: SimConfig, control: Control, duration: float, start: int
) -> None:
    """Throw once and publish to the end, as the thread of sim_node does."""
    frames = Frames.prefixed(config.frame_prefix)
    outputs = Outputs(medium, frames, with_clock=False)
    problems: list[str] = []

    def warn(text: str, _: str = '') -> None:
        problems.append(text)

    simulation = Simulation(config, outputs, Commands(None, frames), start, warn)
    coefficients = (control.C_L, control.C_M, control.C_N)
    simulation.held.set_coefficients(coefficients, inf)
    messages = floor(duration * config.publish_rate * (1 + 1e-12))
    medium.now = start
    simulation.throw()
    simulation.publish()
    time = simulation.timeline
    while simulation.flying and messages > 0:
        messages -= 1
        medium.now = time.at(time.steps + config.steps_per_publish)
        simulation.leap(config.steps_per_publish)
        simulation.publish()
    if problems:
        raise DiscSimError(problems[0])


def epoch(now: int) -> int:
    """Return the stamp at which a bag made at a time [ns] begins: its whole second."""
    return now // NANOSECONDS * NANOSECONDS
