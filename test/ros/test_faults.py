"""What happens around a node that runs for weeks must not reach the flight.

Each flight is compared with the core's to the last bit, its stamps have to be even, and what the
diagnostics tell has to be true. How quick the machine is, no test here asks.
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
from nav_msgs.msg import Odometry
import numpy as np
from numpy.testing import assert_array_equal
import pytest

pytest.importorskip('rclpy')

from rclpy.context import Context
from rclpy.node import Node

from disc_sim_ros import topics
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.cli import analyse_bag
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.ros import messages, qos
from ros.recorder_process import Recorder

pytestmark = pytest.mark.ros

HIGH = {'launch.height': 5.0, 'auto_throw': False, 'publish_rate': 200.0}  # a flight of 4.8 s
PERIOD = 5_000_000  # ns
HOUR = 3600
SETUP = Setup(disc=disc_file.load_disc('frisbee'))
LAUNCH = Launch(height=5.0)
EXPECTED = fly(LAUNCH, SETUP)
NUMBERS = 7 + 36 + 6 + 36  # what a serialised Odometry ends with, covariances after each part
STATE = [*range(7), *range(43, 49)]  # pose and twist among them


def ns(message: bytes) -> int:
    """The stamp of a serialised message that begins with a header."""
    seconds, nanoseconds = struct.unpack_from('<iI', message, 4)
    return seconds * 1_000_000_000 + nanoseconds


def values_of(event):
    return {pair.key: pair.value for pair in event.values}


def computed(period):
    """Pose and twist while in the air, a period [ns] apart, as the core has them."""
    disc = FlightSimulator(SETUP, LAUNCH.state())
    found = []
    for _ in range(math.ceil(EXPECTED.time * 1e9 / period)):
        found.append(messages.odometry(disc.state))
        disc.advance(period // 1_000_000)
    return np.array(found)


class Flight:
    """A flight under way, and what is heard of it."""

    def __init__(self, ros, sim):
        self.ros, self.sim = ros, sim
        self.events = ros.listen(DiagnosticStatus, topics.FLIGHT_EVENTS)
        self.odom = ros.listen(Odometry, topics.ODOM, raw=True)
        self.diagnostics = ros.listen(DiagnosticArray, '/diagnostics')
        self.told = {}
        ros.spin_until(lambda: self.odom and self.diagnostics, 'the simulator')

    def throw(self):
        assert self.ros.call(self.sim, 'throw').success

    def goes_on(self, seconds):
        """Wait for so much more of simulated time."""
        until = ns(self.odom[-1]) + seconds * 1e9
        self.ros.spin_until(lambda: ns(self.odom[-1]) >= until, f'{seconds} s more')

    def offset(self):
        """Wait 0.5 s of simulated time; return by how much it is behind the steady clock [s]."""
        least, seen = math.inf, len(self.odom)
        until = ns(self.odom[-1]) + 0.5e9
        while ns(self.odom[-1]) < until:
            self.ros.spin_until(lambda old=seen: len(self.odom) > old, 'odom')
            seen = len(self.odom)
            least = min(least, time.monotonic() - ns(self.odom[-1]) * 1e-9)
        return least

    def behind(self):
        """Return `offset`, and what is told as slipped, of a time without a slip [s]."""
        told = float(self.tells()[1]['slipped_s'])
        for _ in range(30):  # a busy machine may hold it up at any time
            offset, before = self.offset(), told
            told = float(self.tells()[1]['slipped_s'])
            if told == before:
                return offset, told
        pytest.fail('never a second without a slip')

    def tells(self):
        """Wait for the next diagnostics, and return them."""
        self.diagnostics.clear()
        found = []

        def heard():  # a recorder tells of itself, too
            found[:] = [m.status[0] for m in self.diagnostics if m.status[0].hardware_id == 'disc']
            return found

        self.ros.spin_until(heard, 'diagnostics')
        return found[-1], values_of(found[-1])

    def event(self, name):
        """Wait for an event; return the values of the last of them."""
        found = []

        def heard():
            found[:] = [e for e in self.events if e.name.endswith(f': {name}')]
            return found

        self.ros.spin_until(heard, name, 60.0)
        return values_of(found[-1])

    def lands_as_computed(self, period=PERIOD):
        """Wait for the landing: all odom and it are the core's, no stamp is missing or uneven."""
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
        told = {
            stamp: np.frombuffer(message, '<f8', NUMBERS, len(message) - 8 * NUMBERS)
            for stamp, message in zip(stamps, self.odom, strict=True)
        }
        assert_array_equal([told[stamp][STATE] for stamp in at], expected)


@pytest.fixture
def start(ros):
    """A function that starts a simulator and what listens to it."""

    def started(**more):
        return Flight(ros, ros.start(HIGH | more))

    return started


def memory(pid: int) -> float:
    """Resident set of a process [MiB]."""
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
        recorder.listens_to('/odom', '/flight_events', '/configuration', '/release')
        begun = len(flight.odom)
        flight.throw()

        def has_it_all():
            """End the recorder: all odom is in the bag, and the flight can be flown from it."""
            last, bag = flight.odom[-1], []

            def there():
                bag[:] = [message.data for message in open_bag(recorder.bag).raw(['/odom'])]
                return last in bag

            flight.ros.spin_until(there, 'the last odom in the bag')
            assert recorder.end() == 0
            assert open_bag(recorder.bag).complete
            assert set(bag) >= set(flight.odom[begun : flight.odom.index(last)])
            assert analyse_bag.main([str(recorder.bag), '--verify']) == 0

        return recorder, has_it_all

    return recording


def test_stopped_processes_go_on_exactly_and_tell_how_long_they_stood(start, record, capsys):
    flight = start()
    recorder, has_it_all = record(flight)
    before, slipped = flight.behind()
    process = flight.sim.process
    for stopped in (0.05, 0.5):
        process.send_signal(signal.SIGSTOP)
        time.sleep(stopped)
        process.send_signal(signal.SIGCONT)
        status, values = flight.tells()
        while float(values['worst_lateness_s']) < 0.8 * stopped:  # it may have been on its way
            status, values = flight.tells()
        assert status.level == DiagnosticStatus.WARN
        assert 'ms late' in status.message
    offset, told = flight.behind()
    assert offset - before > 0.3  # of 0.5 s, all but 0.1 s are given up
    # What the messages show is what the diagnostics tell; the quickest takes less than 50 ms.
    assert told - slipped == pytest.approx(offset - before, abs=0.05)
    assert 'does not make up for it' in flight.sim.stderr
    recorder.process.send_signal(signal.SIGSTOP)
    time.sleep(0.5)
    recorder.process.send_signal(signal.SIGCONT)
    flight.lands_as_computed()
    has_it_all()
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
    assert wall == pytest.approx(HOUR, abs=30.0)  # the shim is at work, on this clock alone
    assert steady == pytest.approx(0.0, abs=30.0)
    shifted(0)
    return shifted


def test_the_wall_clock_may_be_set_while_it_flies_and_is_recorded(
    start, wall_clock, record, capsys
):
    flight = start()
    recorder, has_it_all = record(flight)
    for seconds in (HOUR, -HOUR, 0):
        flight.goes_on(0.4)
        wall_clock(seconds)
        flight.tells()  # once a second by the steady clock, whatever time it is
        flight.tells()
    flight.lands_as_computed()
    recorder.wait_for('the wall clock was set by +3600.0 s; log times go on')
    has_it_all()
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
    flight.goes_on(1.5)
    before = memory(pid)
    flight.goes_on(3.0)
    # 3,000 messages of 0.7 and 0.1 kB are 2.5 MB, which a history for the sleepers would hold.
    assert memory(pid) - before < 1.0
    flight.lands_as_computed(1_000_000)


def test_peers_that_come_and_go_and_parameters_set_all_the_time_change_nothing(ros, start):
    flight = start()
    pid = flight.sim.process.pid

    def visit():
        """Four participants at a time: each listens and may throw."""
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
    ros.spin_until(lambda: open_files(pid) <= before, 'sockets of those who left to be closed')
    assert ros.call(flight.sim, 'throw').success
    ros.spin_until(lambda: flight.events[-1].name.endswith(': thrown'), 'the next throw')
    assert float(flight.event('thrown')['speed_m_s']) == pytest.approx(24.0)
