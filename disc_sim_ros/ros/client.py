"""A node for programs that throw one disc: it waits for the nodes, throws and watches."""

from collections.abc import Callable, Sequence
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
from disc_sim_ros.bags.metadata import TopicInfo
from disc_sim_ros.errors import BagError, DiscSimError
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.ros import qos
from disc_sim_ros.ros.processes import Process

START = 90.0  # s for the simulator to compile the equations, find the recorder and be recorded
SERVICE = 30.0  # s for the simulator to answer
_NODE_NAME = 'demo'
_NOT_OF_THE_SIMULATION = (topics.NodeTopic.ROSOUT, topics.NodeTopic.PARAMETER_EVENTS)
_WATCH_PERIOD = 0.1  # s


@dataclass(frozen=True, slots=True)
class DiscSample:
    """The disc at one moment of its flight.

    Attributes:
        time: Simulated time since the first sample [s].
        height: Of the centre above the ground [m].
        speed: Over the ground [m/s].
    """

    time: float
    height: float
    speed: float


class Watcher:
    """A node that waits for the simulator and its recorder, throws, and watches the disc."""

    def __init__(
        self,
        domain: int | None,
        processes: tuple[Process, ...] = (),
        signals_held: Callable[[], AbstractContextManager[None]] = nullcontext,
        namespace: str = '',
    ) -> None:
        """Join a ROS domain.

        Args:
            domain: Number of the domain; None for that of the environment.
            processes: Processes that must run while this waits.
            signals_held: Makes a context in which no signal raises an exception: inside rclpy
                the exception would end as one of another type.
            namespace: Namespace of the simulator and of the recorder.
        """
        self._namespace = ''.join(f'/{part}' for part in namespace.split('/') if part)
        self._processes = processes
        self._signals_held = signals_held
        self._context = Context()
        rclpy.init(
            context=self._context,
            domain_id=domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        self._node = Node(
            _NODE_NAME,
            context=self._context,
            namespace=self._namespace,
            start_parameter_services=False,
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._events: list[str] = []
        self._odometry: Odometry | None = None
        self._applied: list[Any] = []
        self._throw = self._node.create_client(Trigger, 'sim_node/throw')
        self._resume = self._node.create_client(Trigger, 'recorder_node/resume')
        self._node.create_subscription(
            DiagnosticStatus, topics.FLIGHT_EVENTS, self._on_event, qos.STATE_QOS
        )
        # Best effort, depth 1: messages that are not taken cost nothing here.
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

    def wait_until_recorded(self, bag: Path, *, resume: bool = True) -> None:
        """Wait until a recorder records every topic of the simulator.

        Args:
            bag: The bag that it fills.
            resume: Resume the recorder then. It was started paused, so that the bag does not
                begin with this wait.

        Raises:
            DiscSimError: It takes too long, or a process ended.
        """
        self._wait(self._is_ready, START, 'the simulator and a recorder of all its topics')
        if resume:
            self._resume_recorder()
        odom = f'{self._namespace}/{topics.ODOM}'
        self._wait(lambda: recorded_messages(bag, odom), START, 'the first messages in the bag')
        # A viewer may have subscribed to topics that the recorder does not record yet, or never.
        wanted = set(self._topics_of_the_simulator())
        self._wait(lambda: wanted <= _recorded_topics(bag), START, 'all topics in the bag')

    def wait_until_followed(self) -> None:
        """Wait until a predictor follows `odom` of the simulator.

        Raises:
            DiscSimError: It takes too long, or a process ended.
        """
        self._wait(self._is_followed, START, 'the simulator and a predictor that follows odom')

    def wait_until_kept(self, bag: Path) -> bool:
        """Wait until a bag has the flight events that came here: a recorder may get them later.

        Args:
            bag: The bag that the recorder fills.

        Returns:
            False if it does not have them after `SERVICE` seconds.

        Raises:
            DiscSimError: A process ended.
        """
        topic = f'{self._namespace}/{topics.FLIGHT_EVENTS}'
        end = time.monotonic() + SERVICE
        while recorded_messages(bag, topic) < len(self._events):
            if time.monotonic() > end:
                return False
            for process in self._processes:
                process.check()
            self._spin(0.05)
        return True

    def pause(self, seconds: float) -> None:
        """Let wall time pass [s]."""
        self._spin(seconds)

    def _resume_recorder(self) -> None:
        futures = []

        def resumed() -> bool:  # repeated: a service drops its answer to a client not yet matched
            futures.append(self._resume.call_async(Trigger.Request()))
            self._spin(0.2)
            return any(future.done() for future in futures)

        self._wait(self._resume.service_is_ready, SERVICE, 'the services of the recorder')
        self._wait(resumed, SERVICE, 'an answer of the recorder')

    def steer(self, control: Control) -> None:
        """Command coefficients and wait until they act.

        Raises:
            DiscSimError: It takes too long, or a process ended.
        """
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
        """Throw the disc.

        Raises:
            DiscSimError: The simulator refuses, it takes too long, or a process ended.
        """
        future = self._throw.call_async(Trigger.Request())
        self._wait(future.done, SERVICE, 'an answer of the simulator')
        result = future.result()
        if result is None or not result.success:
            raise DiscSimError(f'the simulator did not throw: {result and result.message}')
        self._wait(lambda: topics.FlightEvent.THROWN in self._events, SERVICE, 'the throw')

    def watch(self, longest: float, show: Callable[[DiscSample], None]) -> str:
        """Watch the disc until it lands.

        Args:
            longest: Wall time to watch at most [s].
            show: Called with each sample.

        Returns:
            What ended it: 'landed', 'failed' or 'time is up'.
        """
        self._odometry = None
        begin: float | None = None
        end = time.monotonic() + longest
        while time.monotonic() < end:
            self._spin(_WATCH_PERIOD)
            for event in (topics.FlightEvent.LANDED, topics.FlightEvent.FAILED):
                if event in self._events:
                    return event
            m = self._newest_odometry()
            if m is not None:
                stamp = m.header.stamp.sec + m.header.stamp.nanosec * 1e-9
                begin = stamp if begin is None else begin
                v = m.twist.twist.linear
                speed = math.hypot(v.x, v.y, v.z)
                show(DiscSample(stamp - begin, m.pose.pose.position.z, speed))
        return 'time is up'

    def _newest_odometry(self) -> Odometry | None:
        return self._odometry

    def _is_followed(self) -> bool:
        """Return True if the simulator is there and a predictor has subscribed to `odom`."""
        followers = self._node.get_subscriptions_info_by_topic(f'{self._namespace}/{topics.ODOM}')
        return self._throw.service_is_ready() and any(
            follower.node_name == 'predictor_node' for follower in followers
        )

    def _is_ready(self) -> bool:
        """Return True if the simulator is there and all its topics have a recorder."""
        node = self._node
        space = self._namespace or '/'
        if ('sim_node', space) not in node.get_node_names_and_namespaces():
            return False
        names = self._topics_of_the_simulator()
        last = f'{self._namespace}/{topics.APPLIED_WIND}'
        if not self._throw.service_is_ready() or last not in names:
            return False
        return all(
            any(s.node_name != _NODE_NAME for s in node.get_subscriptions_info_by_topic(name))
            for name in names
        )

    def _topics_of_the_simulator(self) -> list[str]:
        """Return the topics that the simulator publishes for all to see."""
        space = self._namespace or '/'
        published = self._node.get_publisher_names_and_types_by_node('sim_node', space)
        return [name for name, _ in published if name not in _NOT_OF_THE_SIMULATION]

    def _wait(self, condition: Callable[[], Any], longest: float, what: str) -> None:
        end = time.monotonic() + longest
        while not condition():
            for process in self._processes:
                process.check()
            if time.monotonic() > end:
                raise DiscSimError(f'timed out after {longest:g} s waiting for {what}')
            self._spin(0.05)

    def _spin(self, seconds: float) -> None:
        """Take the messages that have arrived, then sleep for the rest of the time."""
        end = time.monotonic() + seconds
        with self._signals_held():
            self._executor.spin_once(seconds)
            for _ in range(10):
                self._executor.spin_once(0.0)
        time.sleep(max(end - time.monotonic(), 0.0))

    def _on_event(self, message: DiagnosticStatus) -> None:
        self._events.append(topics.event_of(message.name))

    def _on_odometry(self, message: Odometry) -> None:
        self._odometry = message


def recorded_messages(bag: Path, topic: str) -> int:
    """Return the number of messages of a topic that a recorder has on the disk."""
    return sum(info.message_count for info in _listed(bag) if info.name == topic)


def _recorded_topics(bag: Path) -> set[str]:
    """Return the topics that a recorder has subscribed to, as its bag lists them."""
    return {info.name for info in _listed(bag)}


def _listed(bag: Path) -> Sequence[TopicInfo]:
    try:
        return metadata.parse((bag / metadata.FILE_NAME).read_text(encoding='utf-8')).topics
    except (OSError, BagError):
        return ()
