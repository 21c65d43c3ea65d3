"""Faults around a node must not affect the flight.

Each flight is compared with that of `physics` to the last bit, its stamps must be evenly spaced,
and the diagnostics must be true. No test depends on the speed of the machine.
"""

from decimal import Decimal
from itertools import pairwise
import math
import mmap
from pathlib import Path
import shutil
import signal
import struct
import subprocess
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
import numpy as np
from numpy.testing import assert_array_equal
import pytest

pytest.importorskip('rclpy')

from rclpy.context import Context
from rclpy.node import Node
from std_srvs.srv import SetBool

from disc_sim_ros import topics
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.cli import analyse_bag
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.ros import messages, qos
from ros.recorder_process import Recorder
from ros.sim.sim_messages import patience

pytestmark = pytest.mark.ros

# A flight of 4.8 s, in a time of its own.
HIGH = {'launch.height': 5.0, 'auto_throw': False, 'publish_rate': 200.0, 'start_time': 0.0}
PERIOD = 5_000_000  # ns
HOUR = 3600
SETUP = Setup(disc=disc_file.load_disc('frisbee'), step=1e-3)  # that of sim_node
LAUNCH = Launch(height=5.0)
EXPECTED = fly(LAUNCH, SETUP)
NUMBERS = 7 + 36 + 6 + 36  # what a serialised Odometry ends with, covariances after each part
STATE = [*range(7), *range(43, 49)]  # pose and twist among them


def ns(message: bytes) -> int:
    """Return the stamp of a serialised message that begins with a header [ns]."""
    seconds, nanoseconds = struct.unpack_from('<iI', message, 4)
    return seconds * 1_000_000_000 + nanoseconds


def values_of(event):
    return {pair.key: pair.value for pair in event.values}


def computed(period):
    """Return pose and twist of `FlightSimulator` in the air, a period [ns] apart."""
    disc = FlightSimulator(SETUP, LAUNCH.state())
    rows = []
    for _ in range(math.ceil(EXPECTED.time * 1e9 / period)):
        rows.append(messages.odometry(disc.state))
        disc.advance(period // 1_000_000)
    return np.array(rows)


class Flight:
    """A simulator, and the messages that it publishes."""

    def __init__(self, ros, sim):
        self.ros, self.sim = ros, sim
        self.events = ros.subscribe(DiagnosticStatus, topics.FLIGHT_EVENTS)
        self.odom = ros.subscribe(Odometry, topics.ODOM, raw=True)
        self.diagnostics = ros.subscribe(DiagnosticArray, '/diagnostics')
        ros.spin_until(lambda: self.odom and self.diagnostics, 'the simulator')

    def throw(self):
        assert self.ros.call(self.sim, 'throw').success

    def goes_on(self, seconds):
        """Wait for so many more seconds of simulated time."""
        until = ns(self.odom[-1]) + seconds * 1e9
        self.ros.spin_until(lambda: ns(self.odom[-1]) >= until, f'{seconds} s more')

    def offset(self):
        """Wait 0.5 s of simulated time; return by how much it is behind the steady clock [s]."""
        least, count = math.inf, len(self.odom)
        until = ns(self.odom[-1]) + 0.5e9
        while ns(self.odom[-1]) < until:
            self.ros.spin_until(lambda old=count: len(self.odom) > old, 'odom')
            count = len(self.odom)
            least = min(least, time.monotonic() - ns(self.odom[-1]) * 1e-9)
        return least

    def behind(self):
        """Return `offset`, and the reported `slipped_s`, of a time without a slip [s]."""
        slipped = float(self.next_diagnostics()[1]['slipped_s'])
        for _ in range(30):  # a busy machine may stall it at any time
            offset, before = self.offset(), slipped
            slipped = float(self.next_diagnostics()[1]['slipped_s'])
            if slipped == before:
                return offset, slipped
        pytest.fail('never a second without a slip')

    def next_diagnostics(self):
        """Wait for the next diagnostics of the simulator; return status and values."""
        self.diagnostics.clear()
        statuses = []

        def arrived():  # a recorder publishes diagnostics, too
            statuses[:] = [
                m.status[0] for m in self.diagnostics if m.status[0].hardware_id == 'disc'
            ]
            return statuses

        self.ros.spin_until(arrived, 'diagnostics')
        return statuses[-1], values_of(statuses[-1])

    def event(self, name):
        """Wait for an event; return the values of the last one."""
        events = []

        def arrived():
            events[:] = [e for e in self.events if e.name.endswith(f': {name}')]
            return events

        self.ros.spin_until(arrived, name, 60.0)
        return values_of(events[-1])

    def lands_as_computed(self, period=PERIOD):
        """Wait for the landing: it and all odom are as computed, no stamp is missing or uneven."""
        landed, thrown = self.event('landed'), self.event('thrown')
        x, y, _ = EXPECTED.position
        assert float(landed['flight_time_s']) == EXPECTED.time
        assert (float(landed['landing_x_m']), float(landed['landing_y_m'])) == (x, y)
        expected = computed(period)
        released = int(Decimal(thrown['stamp_s']) * 10**9)
        at = [released + k * period for k in range(len(expected))]
        # Topics overtake each other: the event may be here before the last odom.
        self.ros.spin_until(lambda: ns(self.odom[-1]) >= at[-1], 'the last odom')
        stamps = [ns(message) for message in self.odom]
        assert {b - a for a, b in pairwise(stamps)} <= {period, 0}  # 0: shown again at a throw
        published = {
            stamp: np.frombuffer(message, '<f8', NUMBERS, len(message) - 8 * NUMBERS)
            for stamp, message in zip(stamps, self.odom, strict=True)
        }
        assert_array_equal([published[stamp][STATE] for stamp in at], expected)


@pytest.fixture
def start(ros):
    """A function that starts a simulator and subscribes to it."""

    def start_flight(**more):
        return Flight(ros, ros.start(HIGH | more))

    return start_flight


def memory(pid: int) -> float:
    """Return the resident set of a process [MiB]."""
    pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
    return pages * mmap.PAGESIZE / 2**20


def open_files(pid: int) -> int:
    return sum(1 for _ in Path(f'/proc/{pid}/fd').iterdir())


@pytest.fixture
def record(tmp_path, request):
    """A function that records a flight from before the throw on, and throws."""

    def recording(flight):
        recorder = Recorder(flight.ros, tmp_path / 'bag', {})
        request.addfinalizer(recorder.process.kill)
        recorder.wait_for_topics('/odom', '/flight_events', '/configuration', '/release')
        before = len(flight.odom)
        flight.throw()

        def assert_complete():
            """End the recorder: all odom is in the bag, and the flight is verified from it."""
            last, bag = flight.odom[-1], []

            def has_last():
                bag[:] = [message.data for message in open_bag(recorder.bag).raw(['/odom'])]
                return last in bag

            flight.ros.spin_until(has_last, 'the last odom in the bag')
            assert recorder.end() == 0
            assert open_bag(recorder.bag).complete
            assert set(bag) >= set(flight.odom[before : flight.odom.index(last)])
            assert analyse_bag.main([str(recorder.bag), '--verify']) == 0

        return recorder, assert_complete

    return recording


def test_stopped_processes_go_on_exactly_and_report_the_slip(start, record, capsys):
    flight = start()
    recorder, assert_complete = record(flight)
    before, slipped = flight.behind()
    process = flight.sim.process
    for stopped in (0.05, 0.5):
        process.send_signal(signal.SIGSTOP)
        time.sleep(stopped)
        process.send_signal(signal.SIGCONT)
        status, values = flight.next_diagnostics()
        while float(values['worst_lateness_s']) < 0.8 * stopped:  # the first may be from before
            status, values = flight.next_diagnostics()
        assert status.level == DiagnosticStatus.WARN
        assert 'ms late' in status.message
    offset, reported = flight.behind()
    assert offset - before > 0.3  # of 0.5 s, all but 0.1 s are given up
    # The stamps show what the diagnostics report; the fastest message takes less than 50 ms.
    assert reported - slipped == pytest.approx(offset - before, abs=0.05)
    assert 'does not make up for it' in flight.sim.stderr
    recorder.process.send_signal(signal.SIGSTOP)
    time.sleep(0.5)
    recorder.process.send_signal(signal.SIGCONT)
    flight.lands_as_computed()
    assert_complete()
    assert 'identical to the last bit' in capsys.readouterr().out


def test_after_a_pause_and_a_slip_commands_for_now_act_now(ros, start, record, capsys):
    """Time jumps to the wall clock, is even otherwise, and the recorded flight is verified."""
    flight = start(start_time=-1.0)
    applied = ros.subscribe(Vector3Stamped, topics.APPLIED_COEFFICIENTS)
    steer = ros.publisher(Vector3Stamped, topics.CMD_COEFFICIENTS)
    ros.call(flight.sim, 'pause', SetBool, data=False)  # also matches the new endpoints
    _, assert_complete = record(flight)
    first = len(flight.odom)

    def command(value):
        """Send a command for now; return by how much later than that it acts [s]."""
        message = Vector3Stamped()
        sent = time.time_ns()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(sent, 10**9)
        message.vector.y = value
        steer.publish(message)
        ros.spin_until(lambda: any(m.vector.y == value for m in applied), 'the command')
        stamp = next(m.header.stamp for m in applied if m.vector.y == value)
        return (stamp.sec * 10**9 + stamp.nanosec - sent) / 1e9

    flight.goes_on(0.4)
    assert command(0.01) < patience(0.1)
    ros.pause(flight.sim)
    time.sleep(1.5)
    ros.resume(flight.sim)
    assert command(-0.01) < patience(0.1)
    process = flight.sim.process
    process.send_signal(signal.SIGSTOP)
    time.sleep(0.8)
    process.send_signal(signal.SIGCONT)
    flight.goes_on(0.2)
    assert command(0.005) < patience(0.1)
    flight.event('landed')
    flight.goes_on(0.1)
    jumps = [values_of(e) for e in flight.events if e.name.endswith(': time jumped')]
    jump_at = {
        int(Decimal(v['stamp_s']) * 10**9): int(Decimal(v['jump_s']) * 10**9) for v in jumps
    }
    assert {'pause', 'slip'} <= {values['cause'] for values in jumps}
    assert 1.5 + 0.8 - 0.1 - 0.05 < sum(jump_at.values()) / 1e9 < patience(2.6)
    stamps = [ns(message) for message in flight.odom[first:]]
    for before, after in pairwise(stamps):
        shift = sum(by for at, by in jump_at.items() if before < at <= after)
        assert after - before - shift in {PERIOD, 0}
    assert int(flight.next_diagnostics()[1]['time_jumps']) >= 2
    assert_complete()
    assert 'identical to the last bit' in capsys.readouterr().out


@pytest.fixture
def wall_clock(tmp_path, monkeypatch):
    """A function that shifts the wall clock [s] of the processes started from now on."""
    compiler = shutil.which('cc') or shutil.which('gcc')
    if compiler is None:
        pytest.skip('no C compiler')
    library, shift = tmp_path / 'clock_shim.so', tmp_path / 'shift'
    source = Path(__file__).with_name('clock_shim.c')
    subprocess.run([compiler, '-shared', '-fPIC', '-O1', '-o', library, source], check=True)
    shift.write_bytes(bytes(8))
    monkeypatch.setenv('LD_PRELOAD', str(library))
    monkeypatch.setenv('CLOCK_SHIFT', str(shift))
    python = [sys.executable, '-c', 'import time; print(time.time(), time.monotonic())']

    def shifted(seconds):
        with shift.open('r+b') as file:
            file.write(struct.pack('<q', seconds))

    def read_there():
        there = subprocess.run(python, capture_output=True, check=True, text=True).stdout.split()
        return float(there[0]) - time.time(), float(there[1]) - time.monotonic()

    shifted(HOUR)
    wall, steady = read_there()
    assert wall == pytest.approx(HOUR, abs=30.0)  # the shim shifts this clock alone
    assert steady == pytest.approx(0.0, abs=30.0)
    shifted(0)
    return shifted


def test_the_wall_clock_may_be_set_while_it_flies_and_is_recorded(
    start, wall_clock, record, capsys
):
    flight = start()
    recorder, assert_complete = record(flight)
    for seconds in (HOUR, -HOUR, 0):
        flight.goes_on(0.4)
        wall_clock(seconds)
        flight.next_diagnostics()  # once a second by the steady clock
        flight.next_diagnostics()
    flight.lands_as_computed()
    recorder.wait_for_log('the wall clock was set by +3600.0 s; log times go on')
    assert_complete()
    assert 'identical to the last bit' in capsys.readouterr().out


NEVER_READS = """
import rclpy
from nav_msgs.msg import Odometry
from geometry_msgs.msg import PoseStamped
from rclpy.qos import QoSProfile, HistoryPolicy
rclpy.init()
node = rclpy.create_node('sleeper')
for kind, name in ((Odometry, 'odom'), (PoseStamped, 'pose')):
    node.create_subscription(kind, name, print, QoSProfile(history=HistoryPolicy.KEEP_ALL))
input()
"""


def test_subscribers_that_never_read_cost_neither_flight_nor_memory(start, request):
    flight = start(publish_rate=1000.0)
    sleepers = [
        subprocess.Popen([sys.executable, '-c', NEVER_READS], stdin=subprocess.PIPE)
        for _ in range(2)
    ]
    for sleeper in sleepers:
        request.addfinalizer(sleeper.communicate)
        request.addfinalizer(sleeper.kill)
    node, pid = flight.ros.node, flight.sim.process.pid
    flight.ros.spin_until(lambda: node.count_subscribers('pose') == 2, 'the sleepers')
    for sleeper in sleepers:
        sleeper.send_signal(signal.SIGSTOP)
    flight.throw()
    flight.goes_on(2.5)  # to fill the 2000 messages that a publisher keeps
    before = memory(pid)
    flight.goes_on(3.0)
    # A history for the sleepers would hold 3,000 messages of 0.7 and 0.1 kB, 2.5 MB.
    assert memory(pid) - before < 1.0
    flight.lands_as_computed(1_000_000)


def test_peers_that_come_and_go_and_changed_parameters_do_not_affect_the_flight(ros, start):
    flight = start()
    pid = flight.sim.process.pid

    def visit():
        """Let four participants come and go: each subscribes and may throw."""
        contexts = [Context() for _ in range(4)]
        for context in contexts:
            context.init(args=[])
        guests = [Node('guest', context=c, start_parameter_services=False) for c in contexts]
        publishers = []
        for guest in guests:
            guest.create_subscription(Odometry, topics.ODOM, print, qos.STATE_QOS)
            publishers.append(guest.create_publisher(Odometry, topics.THROW, qos.COMMAND_QOS))
        ros.spin_until(
            lambda: all(p.get_subscription_count() for p in publishers), 'the simulator'
        )
        for guest, context in zip(guests, contexts, strict=True):
            guest.destroy_node()
            context.try_shutdown()

    visit()
    before = open_files(pid)
    flight.throw()
    for n in range(15):
        if n % 3 == 0:
            visit()
        assert ros.set(flight.sim, {'launch.speed': 10.0 + n, 'path_rate': 5.0 + n}).successful
        refused = ros.set(flight.sim, {'launch.speed': 20.0, 'publish_rate': 300.0})
        assert not refused.successful
        assert 'publish_rate' in refused.reason
    flight.lands_as_computed()
    ros.spin_until(lambda: open_files(pid) <= before, 'closed sockets')
    assert ros.call(flight.sim, 'throw').success
    ros.spin_until(lambda: flight.events[-1].name.endswith(': thrown'), 'the next throw')
    assert float(flight.event('thrown')['speed_m_s']) == pytest.approx(24.0)
