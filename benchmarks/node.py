"""What sim_node costs, how late it is and how fast it starts, beside the naive way.

Every figure is measured in this run with real processes: the node, one that subscribes to `odom`
and `pose`, one that sends commands. CPU is that of the node's process, per cent of one core.
The naive way is the same physics in an rclpy timer, fresh messages, an executor's subscription.

usage: benchmarks/node.py [seconds of each measurement]
"""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time

os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
os.environ.setdefault('ROS_DOMAIN_ID', '91')

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMessage
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64

from disc_sim_ros.core import catalogue
from disc_sim_ros.core.equations import Control
from disc_sim_ros.core.flight import Setup
from disc_sim_ros.core.launch import Launch
from disc_sim_ros.core.simulator import FlightSimulator, warm_up
from disc_sim_ros.nodes import conversions, topics

DEEP = QoSProfile(depth=1000)
TYPES = {
    'odom': Odometry, 'pose': PoseStamped, 'transform': TransformStamped, 'imu': Imu,
    'joint_states': JointState, 'aero_wrench': WrenchStamped, 'airspeed': Float64,
    'path': PathMessage,
}  # fmt: skip
TICK = os.sysconf('SC_CLK_TCK')
HIGH = 1000.0  # m: a disc thrown from here flies for minutes


def main() -> None:
    """Measure and print a table."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    warm_up()
    print(f'{"":54s} {"CPU %":>7s} {"odom/s":>8s} {"rtf":>7s} {"late p50":>9s} {"p99, us":>9s}')
    bare = bare_thread(1e-3, seconds)
    print(f'{"bare sleeping thread at 1 kHz":54s} {bare[0]:7.1f} {"":8s} {"":7s} '
          f'{bare[1] * 1e6:9.0f} {bare[2] * 1e6:9.0f}')  # fmt: skip
    plain = measured('sim_node 1 kHz, nobody listens', 1000, 1000, [], 0, seconds)
    both = ['odom', 'pose']
    pairs = measured('sim_node 1 kHz, odom + pose 1 kHz', 1000, 1000, both, 0, seconds)
    line = 'sim_node 1 kHz, odom + pose + commands 1 kHz'
    full = measured(line, 1000, 1000, both, 1000, seconds)
    naive = measured('naive node, the same', 1000, 1000, both, 1000, seconds, naive=True)
    measured('sim_node 10 kHz, odom + pose 10 kHz', 10000, 10000, both, 0, seconds)
    print()
    print('cost of an optional topic at 1 kHz, beyond nobody listening, CPU %:')
    for topic in [name for name in TYPES if name not in both]:
        cost = measured(topic, 1000, 1000, [topic], 0, seconds / 2, show=False)[0] - plain[0]
        print(f'  {topic:14s} {cost:5.1f}')
    print()
    steps = [command_to_effect() for _ in range(5)]
    print(f'command to published effect at 1 kHz, 5 times: {steps} steps and messages')
    print(f'start to first message, warm cache: {min(start_time() for _ in range(3)):.2f} s')
    with tempfile.TemporaryDirectory() as empty:
        print(f'start to first message, cold cache: {start_time(XDG_CACHE_HOME=empty):.2f} s')
    print()
    print(f'odom + pose cost {pairs[0] - plain[0]:.1f} % over nobody listening')
    print(f'lateness p99 is {full[3] / bare[2]:.2f} times that of the bare thread')
    print(f'naive costs {naive[0] / full[0]:.1f} times as much CPU: '
          f'{naive[0]:.1f} against {full[0]:.1f} % of a core')  # fmt: skip


def measured(
    label: str,
    physics: int,
    publish: int,
    listened: list[str],
    command_rate: int,
    seconds: float,
    *,
    naive: bool = False,
    show: bool = True,
) -> tuple[float, float, float, float]:
    """Return CPU per cent, messages a second, real-time factor and lateness p99 [s]."""
    with ExitStack() as stack:
        node = stack.enter_context(simulator(physics, publish, naive=naive))
        listener = None
        if listened:
            listener = stack.enter_context(role('listen', *listened))
        if command_rate:
            stack.enter_context(role('command', str(command_rate)))
        time.sleep(2.0)  # discovery
        watch = stack.enter_context(Watch.running())
        cpu, start = cpu_time(node.pid), time.monotonic()
        watch.spin(seconds)
        elapsed = time.monotonic() - start
        used = (cpu_time(node.pid) - cpu) / elapsed * 100
        rate = 0.0
        if listener is not None:
            listener.send_signal(signal.SIGINT)
            rate = float(listener.communicate()[0].split()[-1])
    factor, p50, p99 = watch.seen()
    if show:
        print(f'{label:54s} {used:7.1f} {rate:8.0f} {factor:7.4f} '
              f'{p50 * 1e6:9.0f} {p99 * 1e6:9.0f}')  # fmt: skip
    return used, rate, factor, p99


@contextmanager
def simulator(physics: int, publish: int, *, naive: bool = False) -> Iterator[subprocess.Popen]:
    """Run a node in a process of its own."""
    if naive:
        with role('naive', str(physics)) as process:
            yield process
        return
    with started(physics, publish) as process:
        yield process


@contextmanager
def started(
    physics: int, publish: int, *more: str, **environment: str
) -> Iterator[subprocess.Popen]:
    """Run sim_node with a disc that stays in the air."""
    parameters = (
        f'physics_rate:={float(physics)}', f'publish_rate:={float(publish)}',
        f'launch.height:={HIGH}', 'ground:=false', 'command_timeout:=0.5', *more,
    )  # fmt: skip
    command = [sys.executable, '-m', 'disc_sim_ros.nodes.sim_node', '--ros-args']
    for parameter in parameters:
        command += ['-p', parameter]
    with ended(subprocess.Popen(command, env={**os.environ, **environment})) as process:
        yield process


@contextmanager
def role(*words: str) -> Iterator[subprocess.Popen]:
    """Run this file in another role."""
    command = [sys.executable, __file__, *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    with ended(process):
        yield process


@contextmanager
def ended(process: subprocess.Popen) -> Iterator[subprocess.Popen]:
    """End a process behind the block."""
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.wait(10)


def cpu_time(pid: int) -> float:
    """Return the CPU seconds that a process has used."""
    fields = Path(f'/proc/{pid}/stat').read_text(encoding='ascii').rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def bare_thread(period: float, seconds: float) -> tuple[float, float, float]:
    """Return CPU per cent and lateness p50, p99 of a loop that only sleeps to deadlines."""
    late = []
    epoch, cpu = time.monotonic(), time.process_time()
    for i in range(1, round(seconds / period) + 1):
        wait = epoch + i * period - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        late.append(time.monotonic() - epoch - i * period)
    used = (time.process_time() - cpu) / (time.monotonic() - epoch) * 100
    late.sort()
    return used, late[len(late) // 2], late[int(0.99 * len(late))]


class Watch(Node):
    """Reads what the simulation says of itself."""

    @classmethod
    @contextmanager
    def running(cls) -> Iterator['Watch']:
        """Watch while the block runs."""
        rclpy.init()
        try:
            yield cls('watch')
        finally:
            rclpy.shutdown()

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._values: list[dict[str, str]] = []
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self._values.append({pair.key: pair.value for pair in message.status[0].values})

    def spin(self, seconds: float) -> None:
        """Listen for a while."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            rclpy.spin_once(self, timeout_sec=0.1)

    def seen(self) -> tuple[float, float, float]:
        """Return medians of real-time factor, lateness p50 and p99; zeros of a naive node."""
        rows = self._values[1:] or self._values
        if not rows:
            return 0.0, 0.0, 0.0
        names = ('real_time_factor', 'lateness_p50_s', 'lateness_p99_s')
        columns = (sorted(float(row[name]) for row in rows) for name in names)
        factor, p50, p99 = (column[len(column) // 2] for column in columns)
        return factor, p50, p99


def command_to_effect() -> int:
    """Return how many messages after the newest one a command's effect is published."""
    with started(1000, 1000, 'launch.spin:=0.0'), Watch.running() as node:
        seen: list[Odometry] = []
        node.create_subscription(Odometry, 'odom', seen.append, DEEP)
        send = node.create_publisher(WrenchStamped, 'cmd_moment', 10)
        while len(seen) < 500 or not send.get_subscription_count():
            rclpy.spin_once(node, timeout_sec=0.1)
        torque = WrenchStamped()
        torque.header.frame_id = 'disc'
        torque.wrench.torque.z = 0.001
        before = len(seen)
        send.publish(torque)
        while seen[-1].twist.twist.angular.z == seen[before - 1].twist.twist.angular.z:
            rclpy.spin_once(node, timeout_sec=0.1)
        still = seen[before - 1].twist.twist.angular.z
        return next(i for i, m in enumerate(seen[before:]) if m.twist.twist.angular.z != still) + 1


def start_time(**environment: str) -> float:
    """Return the time from the start of the process to its first message [s]."""
    rclpy.init()
    try:
        node = rclpy.create_node('listener')
        seen: list[Odometry] = []
        node.create_subscription(Odometry, 'odom', seen.append, DEEP)
        start = time.monotonic()
        with started(1000, 1000, **environment):
            while not seen:
                rclpy.spin_once(node, timeout_sec=0.1)
            return time.monotonic() - start
    finally:
        rclpy.shutdown()


# ---- roles of other processes ----


def listen(*names: str) -> None:
    """Count the messages of the first of these topics, and print how many a second."""
    rclpy.init()
    node = rclpy.create_node('listener')
    subscriptions = [node.create_subscription(TYPES[name], name, print, DEEP) for name in names]
    readers = [(s.handle, TYPES[name]) for s, name in zip(subscriptions, names, strict=True)]
    counts = [0] * len(readers)
    first = None
    try:
        while True:
            for k, (reader, kind) in enumerate(readers):
                while reader.take_message(kind, True) is not None:  # noqa: FBT003 - raw
                    counts[k] += 1
            if first is None and counts[0]:
                first, counts[0] = time.monotonic(), 0
            time.sleep(1e-3)
    except KeyboardInterrupt:
        print(counts[0] / (time.monotonic() - (first or 0.0)))


def command(rate: str) -> None:
    """Send coefficients at a rate."""
    rclpy.init()
    node = rclpy.create_node('commander')
    send = node.create_publisher(Vector3Stamped, topics.CMD_COEFFICIENTS, 10)
    message = Vector3Stamped()
    message.vector.x = 1e-6
    epoch, i = time.monotonic(), 0
    try:
        while True:
            send.publish(message)
            i += 1
            time.sleep(max(0.0, epoch + i / float(rate) - time.monotonic()))
    except KeyboardInterrupt:
        pass


def naive(rate: str) -> None:
    """Be the node that one writes first."""
    rclpy.init()
    node = rclpy.create_node('naive')
    setup = Setup(disc=catalogue.load('frisbee'), step=1.0 / float(rate))
    sim = FlightSimulator(setup, Launch(height=HIGH).state(), ground=False)
    odom = node.create_publisher(Odometry, 'odom', DEEP)
    pose = node.create_publisher(PoseStamped, 'pose', DEEP)

    def on_command(message: Vector3Stamped) -> None:
        sim.control = Control(message.vector.x, message.vector.y, message.vector.z)

    def on_timer() -> None:
        sim.advance(1)
        stamp = node.get_clock().now().to_msg()
        x, y, z, qx, qy, qz, qw, *twist = conversions.odometry(sim.state)
        at = PoseStamped()
        at.header.stamp, at.header.frame_id = stamp, 'map'
        at.pose.position.x, at.pose.position.y, at.pose.position.z = x, y, z
        q = at.pose.orientation
        q.x, q.y, q.z, q.w = qx, qy, qz, qw
        message = Odometry(child_frame_id='disc')
        message.header = at.header
        message.pose.pose = at.pose
        linear, angular = message.twist.twist.linear, message.twist.twist.angular
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = twist
        odom.publish(message)
        pose.publish(at)

    node.create_subscription(Vector3Stamped, topics.CMD_COEFFICIENTS, on_command, DEEP)
    node.create_timer(1.0 / float(rate), on_timer)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass


if __name__ == '__main__':
    roles = {'listen': listen, 'command': command, 'naive': naive}
    if len(sys.argv) > 1 and sys.argv[1] in roles:
        roles[sys.argv[1]](*sys.argv[2:])
    else:
        main()
