"""Placeholder."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
import math
from pathlib import Path
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from disc_sim_ros import topics
from disc_sim_ros.bags import metadata
from disc_sim_ros.errors import BagError, DiscSimError
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.ros import qos
from disc_sim_ros.ros.processes import Process

START = 90.0  # s for the simulator to compile the equations, find the recorder and be recorded


SERVICE = 30.0  # s for the simulator to answer


_NOT_OF_THE_SIMULATION = ('/rosout', '/parameter_events')


_TO_SEE = 0.1  # s between two looks at the disc


@dataclass(frozen=True, slots=True)
class Seen:
    """The disc in the air: time since the release [s], height [m], speed [m/s]."""

    time: float
    height: float
    speed: float


class Watcher:
    """A node that waits for the simulator and its recorder, throws, and watches the disc."""

    def __init__(
        self,
        domain: int,
        processes: tuple[Process, ...],
        held: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> None:
        """Join the domain.

        Args:
            domain: Of ROS.
            processes: Watched while this waits.
            held: Makes a block in which no signal raises an exception: within rclpy it would end
                as an error of another kind.
        """
        self._processes = processes
        self._held = held
        self._context = Context()
        rclpy.init(
            context=self._context,
            domain_id=domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        self._node = Node('demo', context=self._context, start_parameter_services=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._events: list[str] = []
        self._odometry: Odometry | None = None
        self._applied: list[Any] = []
        self._service = self._node.create_client(Trigger, 'sim_node/throw')
        self._resume = self._node.create_client(Trigger, 'recorder_node/resume')
        self._node.create_subscription(
            DiagnosticStatus, topics.FLIGHT_EVENTS, self._on_event, qos.STATE_QOS
        )
        # Only the newest counts: what nobody takes costs nothing here.
        newest = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._node.create_subscription(Odometry, topics.ODOM, self._on_odometry, newest)
        self._node.create_subscription(
            Vector3Stamped,
            topics.APPLIED_COEFFICIENTS,
            self._applied.append,
            qos.STATE_QOS,
        )

    def close(self) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def wait_until_recorded(self, bag: Path) -> None:
        """Wait until all that the simulator says is recorded, so that nothing of a throw is lost.

        The recorder was started paused: the bag shall begin with the disc, not with waiting.

        Raises:
            DiscSimError: It takes too long, or a process ended.
        """
        self._wait(self._is_ready, START, 'the simulator and a recorder of all its topics')
        answers = []

        def resumed() -> bool:  # asked again: an answer to who is not known yet is dropped
            answers.append(self._resume.call_async(Trigger.Request()))
            self._spin(0.2)
            return any(answer.done() for answer in answers)

        self._wait(self._resume.service_is_ready, SERVICE, 'the services of the recorder')
        self._wait(resumed, SERVICE, 'an answer of the recorder')
        self._wait(lambda: _has(bag, f'/{topics.ODOM}'), START, 'the first messages in the bag')

    def steer(self, control: Control) -> None:
        """Command coefficients, and wait until they act."""
        publisher = self._node.create_publisher(
            Vector3Stamped, topics.CMD_COEFFICIENTS, qos.COMMAND_QOS
        )
        self._wait(publisher.get_subscription_count, SERVICE, 'the simulator to take commands')
        message = Vector3Stamped()
        vector = message.vector
        vector.x, vector.y, vector.z = control.C_L, control.C_M, control.C_N
        publisher.publish(message)
        self._wait(lambda: self._applied, SERVICE, 'the command to act')

    def throw(self) -> None:
        """Let the disc go."""
        answer = self._service.call_async(Trigger.Request())
        self._wait(answer.done, SERVICE, 'an answer of the simulator')
        result = answer.result()
        if result is None or not result.success:
            raise DiscSimError(f'the simulator did not throw: {result and result.message}')
        self._wait(lambda: 'thrown' in self._events, SERVICE, 'the throw')

    def watch(self, longest: float, tell: Callable[[Seen], None]) -> str:
        """Watch the disc until it lies or the time [s] is up; return what ended it."""
        self._odometry = None
        begun: float | None = None
        end = time.monotonic() + longest
        while time.monotonic() < end:
            self._spin(_TO_SEE)
            for event in ('landed', 'failed'):
                if event in self._events:
                    return event
            m = self._newest()
            if m is not None:
                stamp = m.header.stamp.sec + m.header.stamp.nanosec * 1e-9
                begun = stamp if begun is None else begun
                v = m.twist.twist.linear
                tell(Seen(stamp - begun, m.pose.pose.position.z, math.hypot(v.x, v.y, v.z)))
        return 'time is up'

    def _newest(self) -> Odometry | None:
        return self._odometry

    def _is_ready(self) -> bool:
        """Say whether the simulator is there and all its topics have a recorder."""
        node = self._node
        if ('sim_node', '/') not in node.get_node_names_and_namespaces():
            return False
        names = [n for n, _ in node.get_publisher_names_and_types_by_node('sim_node', '/')]
        if not self._service.service_is_ready() or f'/{topics.APPLIED_WIND}' not in names:
            return False
        return all(
            any(s.node_name != 'demo' for s in node.get_subscriptions_info_by_topic(name))
            for name in names
            if name not in _NOT_OF_THE_SIMULATION
        )

    def _wait(self, condition: Callable[[], Any], longest: float, what: str) -> None:
        end = time.monotonic() + longest
        while not condition():
            for process in self._processes:
                process.check()
            if time.monotonic() > end:
                raise DiscSimError(f'waited {longest:g} s in vain for {what}')
            self._spin(0.05)

    def _spin(self, seconds: float) -> None:
        """Take what has come, and let others work for the rest of the time."""
        end = time.monotonic() + seconds
        with self._held():
            self._executor.spin_once(seconds)
            for _ in range(10):
                self._executor.spin_once(0.0)
        time.sleep(max(end - time.monotonic(), 0.0))

    def _on_event(self, message: DiagnosticStatus) -> None:
        self._events.append(message.name.rpartition(': ')[2])

    def _on_odometry(self, message: Odometry) -> None:
        self._odometry = message


def _has(bag: Path, topic: str) -> bool:
    """Say whether there are messages of a topic on the disk already."""
    try:
        told = metadata.parse((bag / metadata.FILE_NAME).read_text(encoding='utf-8'))
    except (OSError, BagError):
        return False
    return any(info.topic.name == topic and info.message_count for info in told.topics)
