"""CPU, lateness and start-up time of sim_node, beside a naive node and a C++ program.

Every figure is measured in this run with real processes: the node, one that subscribes to `odom`
and `pose`, one that sends commands. CPU is that of the node's process, per cent of one core. The
naive node runs the same physics in an rclpy timer, builds new messages, and takes commands in
callbacks of the executor. The C++ program, benchmarks/rcl_loop.cpp, calls rcl itself; it is built
and measured where g++ is. Lateness is how long after its deadline a thread wakes up: the median of
the quantiles of some 1,000 deadlines each.

usage: benchmarks/node.py [seconds of each measurement]
"""

from contextlib import ExitStack
import math
import os
from pathlib import Path
import shutil
import signal
import sys
import tempfile
import time

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
import rclpy

from disc_sim_ros.physics.simulator import warm_up
from disc_sim_ros.ros import processes
from lines import Line, print_lines
from node_processes import Watch, role, simulator, started, wait_for_line
from node_roles import DEEP, TYPES

TICK = os.sysconf('SC_CLK_TCK')
MOST_CPP = 1.3  # times the C++ program, with odom, pose and commands at 1 kHz
MOST_IDLE = 5.0  # per cent of a core, at 200 Hz without subscribers
MOST_LATE = 2.0  # times the p99 of the bare thread
WINDOW = 1000  # deadlines, as in the diagnostics of sim_node
MOST_STEPS = 3  # two steps and one period, from a command to its effect
MOST_START, MOST_COLD_START = 1.5, 15.0  # s
KEPT_UP = 0.999  # of real time, and of the messages


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
    cpp = beside = fast_cpp = None
    if shutil.which('g++'):
        line = 'C++ on rcl, odom + pose + commands 1 kHz'
        cpp = measured(line, 1000, 1000, both, 1000, seconds, kind='C++')
        line = 'the same, with a sleeping thread beside it'
        beside = measured(line, 1000, 1000, both, 1000, seconds, kind='C++ and thread')
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
    steps = [command_to_effect() for _ in range(10)]
    print('messages from a command to its effect:', *sorted(steps))
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
            what='the same, lateness p99',
            ours=f'{full[3] * 1e6:.0f} us',
            beside='C++ on rcl: no g++, not measured'
            if cpp is None or beside is None
            else f'C++ on rcl {cpp[3] * 1e6:.0f} us; a sleeping thread beside it '
            f'{beside[3] * 1e6:.0f} us',
            ratio=None if cpp is None else full[3] / cpp[3],
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
            what=f'command to published effect, 1 kHz, {len(steps)} times',
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
        sleeper = None
        if kind == 'C++ and thread':
            sleeper = stack.enter_context(role('sleep', str(physics)))
        elif kind == 'C++':
            sleeper = node
        subscriber = None
        if subscribed:
            subscriber = stack.enter_context(role('subscribe', *subscribed))
        if command_rate:
            stack.enter_context(role('command', str(command_rate)))
        watch = stack.enter_context(Watch.running())
        if kind != 'naive' and sleeper is None:  # the others have no diagnostics
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
        if sleeper is not None:
            sleeper.send_signal(signal.SIGINT)
            late = [float(line) for line in sleeper.communicate()[0].split()]
            return used, rate, 0.0, *quantiles(late)
    return used, rate, *watch.medians()


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
    return used, *quantiles(late)


def quantiles(late: list[float]) -> tuple[float, float]:
    """Return the medians, over windows, of the median and the p99 of lateness."""
    count = max(1, len(late) // WINDOW)
    windows = [sorted(late[i * WINDOW : (i + 1) * WINDOW]) for i in range(count)]
    p50, p99 = (sorted(w[int(share * len(w))] for w in windows) for share in (0.5, 0.99))
    return p50[count // 2], p99[count // 2]


def command_to_effect() -> int:
    """Return how many messages after the command its effect is published.

    That is by their stamps, which are wall time: messages from before the command can arrive later
    than it was sent.
    """
    with started(1000, 1000, 'launch.spin:=0.0'), Watch.running() as node:
        odom: list[Odometry] = []
        node.create_subscription(Odometry, 'odom', odom.append, DEEP)
        publisher = node.create_publisher(WrenchStamped, 'cmd_moment', 10)
        while len(odom) < 500 or not publisher.get_subscription_count():
            rclpy.spin_once(node, timeout_sec=0.1)
        torque = WrenchStamped()
        torque.header.frame_id = 'disc'
        torque.wrench.torque.z = 0.001
        spin = odom[-1].twist.twist.angular.z
        sent = time.time_ns()
        publisher.publish(torque)
        while odom[-1].twist.twist.angular.z == spin:
            rclpy.spin_once(node, timeout_sec=0.1)
        stamp = odom[-1].header.stamp
        return max(1, math.ceil((stamp.sec * 10**9 + stamp.nanosec - sent) / 1e6))


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
