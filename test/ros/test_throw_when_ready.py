"""The program of launch files throws when a recorder or a predictor is ready, and not before."""

import signal
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped

from disc_sim_ros.analysis.flights import flights
from disc_sim_ros.analysis.recording import discs
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.ros.client import recorded_messages
from disc_sim_ros.ros.processes import started
from disc_sim_ros.topics import PredictorTopic
from forked import start
from ros.recorder_process import Recorder
from ros.sim.sim_messages import names, wall

pytestmark = pytest.mark.ros
PROGRAM = 'disc_sim_ros.ros.throw_when_ready'


def test_it_throws_when_all_topics_are_recorded(ros, tmp_path):
    ros.start({'auto_throw': False})
    events = ros.subscribe(DiagnosticStatus, 'flight_events')
    bag = tmp_path / 'bag'
    throw = subprocess.Popen([sys.executable, '-m', PROGRAM, '--bag', bag])
    try:
        ros.spin_until(wall(3.0))
        assert throw.poll() is None  # there is no recorder yet
        assert 'thrown' not in names(events)  # time may jump on a machine under load
        recorder = Recorder(ros, bag, {})
        try:
            ros.spin_until(lambda: throw.poll() is not None, 'the throw')
            ros.spin_until(lambda: 'landed' in names(events), 'the landing')
            # It came here; to the recorder it may come later.
            since = len(events) - names(events).index('thrown')
            ros.spin_until(lambda: recorded_messages(bag, '/flight_events') >= since, 'its record')
            assert throw.returncode == 0
            assert recorder.end() == 0
        finally:
            recorder.process.kill()
    finally:
        throw.kill()
        throw.wait()
    (flight,) = flights(discs(open_bag(bag))[0])
    assert flight.release is not None
    assert flight.landing is not None
    assert flight.starts_late < 0.006


def test_topics_that_others_alone_have_subscribed_to_are_not_recorded(ros, tmp_path):
    """A viewer looks at each topic; the recorder leaves out one of them."""
    ros.start({'auto_throw': False})
    events = ros.subscribe(DiagnosticStatus, 'flight_events')
    bag = tmp_path / 'bag'
    recorder = Recorder(ros, bag, {'exclude': '.*/flight_events'})
    throw = start(PROGRAM, ['--bag', str(bag)], tmp_path / 'throw.txt')
    try:
        ros.spin_until(lambda: recorded_messages(bag, '/odom'), 'a recorder that works')
        ros.spin_until(wall(3.0))
        assert throw.poll() is None
        assert 'thrown' not in names(events)
    finally:
        throw.kill()
        throw.wait()
        recorder.process.kill()
        recorder.process.wait()


def test_it_throws_when_a_predictor_follows(ros, tmp_path):
    """The first prediction belongs to the first flight."""
    ros.start({'auto_throw': False, 'publish_rate': 50.0})
    events = ros.subscribe(DiagnosticStatus, 'flight_events')
    landings = ros.subscribe(PoseWithCovarianceStamped, PredictorTopic.LANDING)
    throw = start(PROGRAM, ['--predictor'], tmp_path / 'throw.txt')
    try:
        ros.spin_until(wall(2.0))
        assert throw.poll() is None  # there is no predictor yet
        assert 'thrown' not in names(events)
        parameters = {'sources': 'odom', 'disc': 'frisbee', 'disc_uncertainty': 0.0}
        with started('predictor_node', parameters, tmp_path) as predictor:
            ros.spin_until(lambda: throw.poll() is not None, 'the throw')
            assert throw.returncode == 0
            ros.spin_until(lambda: landings, 'a prediction')
            ros.spin_until(lambda: 'landed' in names(events), 'the landing')
            predictor.end()
    finally:
        throw.kill()
        throw.wait()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_quietly_while_it_waits(ros, tmp_path, number):
    said = tmp_path / 'throw.txt'
    waiting = start(PROGRAM, ['--bag', str(tmp_path / 'bag')], said)
    ros.spin_until(lambda: 'demo' in ros.node.get_node_names(), 'the program')
    waiting.send_signal(number)
    assert (waiting.wait(10.0), said.read_text()) == (0, '')
