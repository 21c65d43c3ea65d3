"""One throw in real time, with sim_node and recorder_node as processes of their own."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
import fcntl
import math
import os
from pathlib import Path
import socket
import subprocess
import sys
import tempfile
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
import yaml

from disc_sim_ros.bags import metadata
from disc_sim_ros.bags.errors import BagError
from disc_sim_ros.core.equations import Control
from disc_sim_ros.core.errors import DiscSimError
from disc_sim_ros.nodes import topics

DOMAINS = range(1, 102)  # above, the ports of Fast DDS are among those the system hands out
START = 90.0  # s for the simulator to compile the equations, find the recorder and be recorded
END = 30.0  # s for a process to end after its signal
SERVICE = 30.0  # s for the simulator to answer
_PROGRAM = 'import sys; from disc_sim_ros.cli.{0} import main; sys.exit(main())'
_NOT_OF_THE_SIMULATION = ('/rosout', '/parameter_events')
_TO_SEE = 0.1  # s between two looks at the disc


@dataclass(frozen=True, slots=True)
class Seen:
    """The disc in the air: time since the release [s], height [m], speed [m/s]."""

    time: float
    height: float
    speed: float


@contextmanager
def own_domain() -> Iterator[int]:
    """Yield a ROS domain that nobody on this machine uses, and keep it taken.

    The environment of processes started meanwhile has it, and keeps them on this machine.

    Raises:
        DiscSimError: All are taken.
    """
    first = os.getpid() % len(DOMAINS)
    for domain in [*DOMAINS[first:], *DOMAINS[:first]]:
        name = f'disc_sim_ros_domain_{os.getuid()}_{domain}'
        with (Path(tempfile.gettempdir()) / name).open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            if _is_used(domain):
                continue
            os.environ['ROS_DOMAIN_ID'] = str(domain)
            os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
            yield domain
            return
    raise DiscSimError(f'no free ROS domain among {DOMAINS[0]} to {DOMAINS[-1]}')


def _is_used(domain: int) -> bool:
    """Say whether a DDS participant of this machine listens on the first port of a domain."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(('', 7400 + 250 * domain + 10))
        except OSError:
            return True
    return False


class Process:
    """A program of this package in a process and a session of its own.

    Ctrl-C in the terminal reaches only who started it, who then ends it in order.
    """

    def __init__(
        self, program: str, parameters: Mapping[str, object], folder: Path, *arguments: str
    ) -> None:
        """Start it.

        Args:
            program: Such as 'sim_node'.
            parameters: Of the node.
            folder: For the file of parameters and for what it says.
            arguments: More for ROS, such as '-r' and '__ns:=/red'.
        """
        self.name = program
        self.log = folder / f'{program}.log'
        file = folder / f'{program}.yaml'
        document = {'/**': {'ros__parameters': dict(parameters)}}
        file.write_text(yaml.safe_dump(document), encoding='utf-8')
        command = [sys.executable, '-c', _PROGRAM.format(program)]
        with self.log.open('wb') as log:
            self._process = subprocess.Popen(  # noqa: S603 - this package's own programs
                [*command, '--ros-args', '--params-file', str(file), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    def check(self) -> None:
        """Raise where it has ended by itself."""
        if self._process.poll() is not None:
            raise self._failed(f'ended with code {self._process.returncode}')

    def end(self) -> None:
        """Send SIGTERM and wait for the end.

        A Python that is still importing may swallow a SIGINT, but never this.

        Raises:
            DiscSimError: It did not end, or not with 0.
        """
        if self._process.poll() is None:
            self._process.terminate()
        try:
            code = self._process.wait(END)
        except subprocess.TimeoutExpired:
            self.kill()
            raise self._failed(f'did not end within {END:g} s') from None
        if code:
            raise self._failed(f'ended with code {code}')

    def kill(self) -> None:
        """End it at once, if it still runs."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()

    def _failed(self, what: str) -> DiscSimError:
        said = self.log.read_text(encoding='utf-8', errors='replace').strip().splitlines()
        return DiscSimError(f'{self.name} {what}' + (f': {said[-1]}' if said else ''))


@contextmanager
def started(
    program: str, parameters: Mapping[str, object], folder: Path, *arguments: str
) -> Iterator[Process]:
    """Yield a process that ends with the block, in order or, where that fails, at once."""
    process = Process(program, parameters, folder, *arguments)
    try:
        yield process
    except BaseException:
        with suppress(DiscSimError):
            process.end()
        raise
    finally:
        process.kill()


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
            DiagnosticStatus, topics.FLIGHT_EVENTS, self._on_event, topics.STATE_QOS
        )
        # Only the newest counts: what nobody takes costs nothing here.
        newest = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._node.create_subscription(Odometry, topics.ODOM, self._on_odometry, newest)
        self._node.create_subscription(
            Vector3Stamped,
            topics.APPLIED_COEFFICIENTS,
            self._applied.append,
            topics.STATE_QOS,
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
            Vector3Stamped, topics.CMD_COEFFICIENTS, topics.COMMAND_QOS
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
