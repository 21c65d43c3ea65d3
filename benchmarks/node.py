"""CPU, lateness and start-up time of sim_node, beside a naive node and a C++ program.

Every figure is measured in this run with real processes: the node, one that subscribes to `odom`
and `pose`, one that sends commands. CPU is that of the node's process, per cent of one core. The
naive node runs the same physics in an rclpy timer, builds new messages, and takes commands in
callbacks of the executor. The C++ program, benchmarks/rcl_loop.cpp, calls rcl itself; it is built
and measured where g++ is.

usage: benchmarks/node.py [seconds of each measurement]
"""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
import os
from pathlib import Path
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
import rclpy
from rclpy.node import Node

from disc_sim_ros.physics.simulator import warm_up
from disc_sim_ros.ros import processes
from lines import Line, print_lines
from node_roles import DEEP, HIGH, TYPES

TICK = os.sysconf('SC_CLK_TCK')
MOST_CPP = 1.3  # times the C++ program, with odom, pose and commands at 1 kHz
MOST_IDLE = 5.0  # per cent of a core, at 200 Hz without subscribers
MOST_LATE = 2.0  # times the p99 of the bare thread
MOST_STEPS = 3  # two steps and one period, from a command to its effect
MOST_START, MOST_COLD_START = 1.5, 15.0  # s
KEPT_UP = 0.999  # of real time, and of the messages
SIM_NODE = (sys.executable, '-m', 'disc_sim_ros.ros.sim')
PYTHON_LOOP = """
import runpy
from disc_sim_ros.ros.sim import loop
loop.compiled_loop = lambda *_: None
runpy.run_module('disc_sim_ros.ros.sim', run_name='__main__')
"""
DEADLINE = 60.0  # s, for a process to be ready


def main() -> None:
    """Print the results."""
    print_lines(lines(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0, topics_too=True))


def lines(seconds: float = 10.0, *, topics_too: bool = False) -> tuple[Line, ...]:
    """Measure in a ROS domain of its own, print a table and return the main results.

    Args:
        seconds: Duration of each measurement.
        topics_too: Also print the cost of each optional topic.
    """
    with processes.own_domain():
        return _lines(seconds, topics_too=topics_too)


def _lines(seconds: float, *, topics_too: bool) -> tuple[Line, ...]:
    warm_up()
    print(f'{"":54s} {"CPU %":>7s} {"odom/s":>8s} {"rtf":>7s} {"late p50":>9s} {"p99, us":>9s}')
    bare = bare_thread(1e-3, seconds)
    print(f'{"bare sleeping thread at 1 kHz":54s} {bare[0]:7.1f} {"":8s} {"":7s} '
          f'{bare[1] * 1e6:9.0f} {bare[2] * 1e6:9.0f}')  # fmt: skip
    idle = measured('sim_node 200 Hz, no subscribers', 1000, 200, [], 0, seconds)
    plain = measured('sim_node 1 kHz, no subscribers', 1000, 1000, [], 0, seconds)
    both = ['odom', 'pose']
    pairs = measured('sim_node 1 kHz, odom + pose 1 kHz', 1000, 1000, both, 0, seconds)
    line = 'sim_node 1 kHz, odom + pose + commands 1 kHz'
    full = measured(line, 1000, 1000, both, 1000, seconds)
    naive, python = (
        measured(f'{kind}, the same', 1000, 1000, both, 1000, seconds, kind=kind)
        for kind in ('naive', 'Python loop')
    )
    fast = measured('sim_node 10 kHz, odom + pose 10 kHz', 10000, 10000, both, 0, seconds)
    cpp = fast_cpp = None
    if shutil.which('g++'):
        line = 'C++ on rcl, odom + pose + commands 1 kHz'
        cpp = measured(line, 1000, 1000, both, 1000, seconds, kind='C++')
        line = 'C++ on rcl, odom + pose 10 kHz'
        fast_cpp = measured(line, 10000, 10000, both, 0, seconds, kind='C++')
    every, python_every = (
        measured(f'{kind} 1 kHz, all topics', 1000, 1000, list(TYPES), 0, seconds, kind=kind)
        for kind in ('sim_node', 'Python loop')
    )
    print(f'\nodom + pose cost {pairs[0] - plain[0]:.1f} % more than no subscribers')
    if topics_too:
        print('cost of an optional topic at 1 kHz, beyond no subscribers, CPU %:')
        for topic in [name for name in TYPES if name not in both]:
            cost = measured(topic, 1000, 1000, [topic], 0, seconds / 2, show=False)[0] - plain[0]
            print(f'  {topic:14s} {cost:5.1f}')
    steps = [command_to_effect() for _ in range(5)]
    warm = min(start_time() for _ in range(3))
    with tempfile.TemporaryDirectory() as empty:
        cold = start_time(XDG_CACHE_HOME=empty)
    late = full[3] / bare[2]
    return (
        Line(
            what='`sim_node` at 200 Hz, no subscribers',
            ours=f'{idle[0]:.1f} % of a core',
            bound=f'at most {MOST_IDLE:g} %',
            kept=idle[0] <= MOST_IDLE,
        ),
        Line(
            what='`sim_node` at 1 kHz, no subscribers',
            ours=f'{plain[0]:.1f} % of a core',
            beside=f'a bare sleeping thread {bare[0]:.1f} %',
            ratio=plain[0] / bare[0],
        ),
        Line(
            what='`odom`, `pose` and commands at 1 kHz',
            ours=f'{full[0]:.1f} % of a core',
            beside=f'rclpy timer, new messages {naive[0]:.1f} %',
            ratio=naive[0] / full[0],
            short=True,
        ),
        Line(
            what='the same',
            ours=f'{full[0]:.1f} % of a core',
            beside='C++ on rcl: no g++, not measured'
            if cpp is None
            else f'C++ on rcl {cpp[0]:.1f} %',
            ratio=None if cpp is None else cpp[0] / full[0],
            bound=f'at most {MOST_CPP:g} times the C++ program',
            kept=None if cpp is None else full[0] <= MOST_CPP * cpp[0],
        ),
        Line(
            what='the same',
            ours=f'{full[0]:.1f} % of a core',
            beside=f'its loop in Python {python[0]:.1f} %',
            ratio=python[0] / full[0],
        ),
        Line(
            what=f'{len(TYPES)} topics at 1 kHz',
            ours=f'{every[0]:.1f} % of a core',
            beside=f'its loop in Python {python_every[0]:.1f} %',
            ratio=python_every[0] / every[0],
        ),
        Line(
            what='the same, lateness p99',
            ours=f'{full[3] * 1e6:.0f} us',
            beside=f'a bare sleeping thread {bare[2] * 1e6:.0f} us',
            ratio=late,
            bound=f'at most {MOST_LATE:g} times',
            kept=late <= MOST_LATE,
        ),
        Line(
            what='physics, `odom` and `pose` at 10 kHz',
            ours=f'{fast[1]:,.0f} messages a second, {fast[0]:.0f} % of a core',
            beside='real time' if fast_cpp is None else f'C++ on rcl {fast_cpp[0]:.0f} %',
            ratio=fast[2] if fast_cpp is None else fast_cpp[0] / fast[0],
            bound='kept up',
            kept=fast[2] >= KEPT_UP and fast[1] >= KEPT_UP * 10_000,
        ),
        Line(
            what='command to published effect, 1 kHz, 5 times',
            ours=f'at most {max(steps)} messages later',
            bound=f'at most {MOST_STEPS}',
            kept=max(steps) <= MOST_STEPS,
        ),
        Line(
            what='`sim_node`, start to first message',
            ours=f'{warm:.2f} s',
            beside=f'first time on a machine {cold:.1f} s',
            ratio=cold / warm,
            bound=f'at most {MOST_START:g} s, {MOST_COLD_START:g} s the first time',
            kept=warm <= MOST_START and cold <= MOST_COLD_START,
        ),
    )


def measured(
    label: str,
    physics: int,
    publish: int,
    subscribed: list[str],
    command_rate: int,
    seconds: float,
    *,
    kind: str = 'sim_node',
    show: bool = True,
    **environment: str,
) -> tuple[float, float, float, float]:
    """Return CPU per cent, messages a second, real-time factor and lateness p99 [s].

    Variables of the environment are for the process of the node.
    """
    arguments = (physics, publish, subscribed, command_rate, seconds)
    try:
        used, rate, factor, p50, p99 = tried(*arguments, kind=kind, **environment)
    except TimeoutError as error:  # no result about their cost
        print(f'repeated, the processes did not discover each other: {error}')
        used, rate, factor, p50, p99 = tried(*arguments, kind=kind, **environment)
    if show:
        print(f'{label:54s} {used:7.1f} {rate:8.0f} {factor:7.4f} '
              f'{p50 * 1e6:9.0f} {p99 * 1e6:9.0f}')  # fmt: skip
    return used, rate, factor, p99


def tried(
    physics: int,
    publish: int,
    subscribed: list[str],
    command_rate: int,
    seconds: float,
    *,
    kind: str,
    **environment: str,
) -> tuple[float, float, float, float, float]:
    """Return CPU per cent, messages a second, real-time factor and lateness p50, p99 [s].

    Raises:
        TimeoutError: The subscriber gets no message.
    """
    with ExitStack() as stack:
        node = stack.enter_context(simulator(physics, publish, kind, **environment))
        subscriber = None
        if subscribed:
            subscriber = stack.enter_context(role('subscribe', *subscribed))
        if command_rate:
            stack.enter_context(role('command', str(command_rate)))
        watch = stack.enter_context(Watch.running())
        if kind not in {'naive', 'C++'}:
            watch.wait()
        if subscriber is not None:
            wait_for_line(subscriber)
        time.sleep(1.0)  # until commands are matched, too
        cpu, start = cpu_time(node.pid), time.monotonic()
        watch.spin(seconds)
        elapsed = time.monotonic() - start
        used = (cpu_time(node.pid) - cpu) / elapsed * 100
        rate = 0.0
        if subscriber is not None:
            subscriber.send_signal(signal.SIGINT)
            rate = float(subscriber.communicate()[0].split()[-1])
    return used, rate, *watch.medians()


@contextmanager
def simulator(
    physics: int, publish: int, kind: str, **environment: str
) -> Iterator[subprocess.Popen]:
    """Run a node in a process of its own: 'sim_node', its 'Python loop', 'naive' or 'C++'."""
    if kind == 'naive':
        with role('naive', str(physics)) as process:
            yield process
    elif kind == 'C++':
        with ExitStack() as stack:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            yield stack.enter_context(role('rcl', str(build_rcl_loop(folder)), str(physics)))
    else:
        python_loop = kind == 'Python loop'
        with started(physics, publish, python_loop=python_loop, **environment) as process:
            yield process


def build_rcl_loop(folder: Path) -> Path:
    """Build benchmarks/rcl_loop.cpp with the headers of the ROS that rclpy belongs to."""
    maps = Path('/proc/self/maps').read_text(encoding='utf-8').splitlines()
    root = next(Path(line.split()[-1]) for line in maps if line.endswith('/librcl.so')).parents[1]
    library = folder / 'librcl_loop.so'
    command = ['g++', '-O2', '-std=c++17', '-shared', '-fPIC', '-Wall', '-Wextra']
    for path in (root / 'include').iterdir():
        command += ['-isystem', str(path)]
    command += [str(Path(__file__).with_name('rcl_loop.cpp')), '-o', str(library)]
    command += [f'-L{root / "lib"}', '-Wl,--allow-shlib-undefined']
    command += ['-lrcl', '-lrcutils', '-lrosidl_runtime_c']
    for package in ('nav_msgs', 'geometry_msgs'):
        command += [f'-l{package}__rosidl_typesupport_c', f'-l{package}__rosidl_generator_c']
    subprocess.run(command, check=True)
    return library


@contextmanager
def started(
    physics: int, publish: int, *more: str, python_loop: bool = False, **environment: str
) -> Iterator[subprocess.Popen]:
    """Run sim_node with a disc that stays in the air, with its compiled loop or without."""
    parameters = (
        f'physics_rate:={float(physics)}', f'publish_rate:={float(publish)}',
        f'launch.height:={HIGH}', 'ground:=false', 'command_timeout:=0.5', *more,
    )  # fmt: skip
    command = [sys.executable, '-c', PYTHON_LOOP] if python_loop else [*SIM_NODE]
    command.append('--ros-args')
    for parameter in parameters:
        command += ['-p', parameter]
    with ended(subprocess.Popen(command, env={**os.environ, **environment})) as process:
        yield process


@contextmanager
def role(*words: str) -> Iterator[subprocess.Popen]:
    """Run a role of benchmarks/node_roles.py."""
    command = [sys.executable, str(Path(__file__).with_name('node_roles.py')), *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    with ended(process):
        yield process


@contextmanager
def ended(process: subprocess.Popen) -> Iterator[subprocess.Popen]:
    """End a process after the block."""
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def wait_for_line(process: subprocess.Popen) -> None:
    """Wait until a process has printed a line.

    Raises:
        TimeoutError: It prints none in time.
    """
    if not select.select([process.stdout], [], [], DEADLINE)[0] or not process.stdout.readline():
        raise TimeoutError(f'{process.args}: no message within {DEADLINE:g} s')


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
    """Subscribes to the diagnostics of the simulator."""

    @classmethod
    @contextmanager
    def running(cls) -> Iterator['Watch']:
        """Yield a node that exists while the block runs."""
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
        """Take messages for a while [s]."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            rclpy.spin_once(self, timeout_sec=0.1)

    def wait(self) -> None:
        """Wait for the first diagnostics, which do not count."""
        until = time.monotonic() + DEADLINE
        while not self._values and time.monotonic() < until:
            rclpy.spin_once(self, timeout_sec=0.1)

    def medians(self) -> tuple[float, float, float]:
        """Return medians of real-time factor, lateness p50 and p99 [s]; zeros of a naive node."""
        rows = self._values[1:] or self._values
        if not rows:
            return 0.0, 0.0, 0.0
        names = ('real_time_factor', 'lateness_p50_s', 'lateness_p99_s')
        columns = (sorted(float(row[name]) for row in rows) for name in names)
        factor, p50, p99 = (column[len(column) // 2] for column in columns)
        return factor, p50, p99


def command_to_effect() -> int:
    """Return how many messages after the command its effect is published."""
    with started(1000, 1000, 'launch.spin:=0.0'), Watch.running() as node:
        odom: list[Odometry] = []
        node.create_subscription(Odometry, 'odom', odom.append, DEEP)
        publisher = node.create_publisher(WrenchStamped, 'cmd_moment', 10)
        while len(odom) < 500 or not publisher.get_subscription_count():
            rclpy.spin_once(node, timeout_sec=0.1)
        torque = WrenchStamped()
        torque.header.frame_id = 'disc'
        torque.wrench.torque.z = 0.001
        before = len(odom)
        publisher.publish(torque)
        while odom[-1].twist.twist.angular.z == odom[before - 1].twist.twist.angular.z:
            rclpy.spin_once(node, timeout_sec=0.1)
        spin = odom[before - 1].twist.twist.angular.z
        return next(i for i, m in enumerate(odom[before:]) if m.twist.twist.angular.z != spin) + 1


def start_time(**environment: str) -> float:
    """Return the time from the start of the process to its first message [s]."""
    rclpy.init()
    try:
        node = rclpy.create_node('subscriber')
        odom: list[Odometry] = []
        node.create_subscription(Odometry, 'odom', odom.append, DEEP)
        start = time.monotonic()
        with started(1000, 1000, **environment):
            while not odom:
                rclpy.spin_once(node, timeout_sec=0.1)
            return time.monotonic() - start
    finally:
        rclpy.shutdown()


if __name__ == '__main__':
    main()
