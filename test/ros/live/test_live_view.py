"""live_view: its options, its server, and the page of a real simulator in a real browser."""

from collections.abc import Iterator
import contextlib
import http.client
import json
import re
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('trimesh')
pytest.importorskip('websockets.asyncio')

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

import browser
from disc_sim_ros import Launch, Setup, fly, load_disc, topics
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics import frames
from disc_sim_ros.ros import qos
from disc_sim_ros.ros.live import discs
from disc_sim_ros.ros.live.node import SENT
from disc_sim_ros.ros.live.options import live_config
from disc_sim_ros.ros.live.server import LiveServer
from disc_sim_ros.units import METRIC
from forked import start
from ros.sim_process import DEADLINE

pytestmark = pytest.mark.ros
PAGE = b'<!DOCTYPE html><title>x</title>'
THROW = {'speed': 12.0, 'pitch': 10.0, 'spin': 40.0, 'height': 1.0}
ON_GROUND = 1e-3  # m; a disc sinks by more in a period


# ---- options ----


def test_the_defaults_are_this_machine_alone():
    config = live_config({})
    assert config.is_local
    assert config.rate == 30.0


@pytest.mark.parametrize(
    ('name', 'value', 'allowed'),
    [
        ('address', 'example.org', 'numeric address'),
        ('port', 70_000, '65535'),
        ('rate', 0.0, '120'),
        ('units', 'feet', 'metric, us'),
        ('speed', 1.0, 'no such parameter'),
    ],
)
def test_bad_values_are_refused(name, value, allowed):
    with pytest.raises(ConfigError, match=allowed):
        live_config({name: value})


def test_the_whole_network_is_not_local():
    assert not live_config({'address': '0.0.0.0'}).is_local


# ---- server ----


@contextlib.contextmanager
def serving(throw=lambda _: 'thrown') -> Iterator[tuple[LiveServer, str]]:
    server = LiveServer('127.0.0.1', 0, PAGE, throw)
    address = server.start_serving()
    try:
        yield server, address
    finally:
        server.end()


def port_of(address: str) -> int:
    return int(re.match(r'http://127\.0\.0\.1:(\d+)/#', address)[1])


def socket_of(address: str) -> str:
    return f'ws://127.0.0.1:{port_of(address)}/live'


def answer(connection, **values) -> str:
    connection.send(json.dumps(values))
    while 'answer' not in (message := json.loads(connection.recv(DEADLINE))):
        pass
    return message['answer']


def test_it_serves_one_page():
    with serving() as (_, address):
        for path, status, body in (('/', 200, PAGE), ('/x', 404, b'there is one page: /')):
            connection = http.client.HTTPConnection(
                '127.0.0.1', port_of(address), timeout=DEADLINE
            )
            connection.request('GET', path)
            response = connection.getresponse()
            assert (response.status, response.read()) == (status, body)
            connection.close()


def test_a_page_of_another_server_gets_nothing():
    with (
        serving() as (_, address),
        pytest.raises(InvalidStatus, match='403'),
        connect(socket_of(address), origin='http://example.org'),
    ):
        pass


def test_the_address_of_all_interfaces_names_the_machine():
    server = LiveServer('0.0.0.0', 0, PAGE, str)
    try:
        assert server.start_serving().startswith(f'http://{socket.gethostname()}:')
    finally:
        server.end()


def test_only_who_has_the_token_throws():
    thrown = []

    def throw(values):
        if values.get('speed') == 0.0:
            raise DiscSimError('too slow')
        thrown.append(values)
        return 'thrown'

    with serving(throw) as (server, address), connect(socket_of(address)) as viewer:
        for token in ('', 'x' * len(server.token), server.token.swapcase()):
            assert answer(viewer, speed=1.0, token=token).startswith('error: open the page')
        assert answer(viewer, speed=1.0).startswith('error: open the page')
        assert not thrown
        assert answer(viewer, speed=1.0, token=server.token) == 'thrown'
        assert answer(viewer, speed=0.0, token=server.token) == 'error: too slow'
        for text in ('not JSON', '[' * 4000):
            viewer.send(text)
            assert json.loads(viewer.recv(DEADLINE)) == {'answer': 'error: not JSON'}
    assert thrown == [{'speed': 1.0}]


def test_a_port_in_use_is_refused():
    with socket.socket() as taken:
        taken.bind(('127.0.0.1', 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError, match=r'port.*Address already in use'):
            LiveServer('127.0.0.1', port, PAGE, str).start_serving()


# ---- one state ----


def test_a_state_is_that_of_the_arrays():
    numbers = np.array([1.0, -2.0, 3.0, 0.1, -0.5, 0.3, 0.8, 11.0, -1.0, 2.0, 0.3, -0.2, -31.0])
    numbers[3:7] /= np.linalg.norm(numbers[3:7])
    (expected,) = frames.states_from_odometry(numbers[None])
    state = discs._state_of(tuple(numbers))
    assert state == pytest.approx(expected, abs=1e-12)  # rounding
    phi, theta, _ = np.degrees(frames.euler_from_quaternion(expected[6:10]))
    assert discs._pitch_and_roll(state) == pytest.approx((theta, phi), abs=1e-10)


def test_a_disc_without_attitude_lies_level():
    state = discs._state_of((0.0,) * 13)
    assert state[6:10] == (1.0, 0.0, 0.0, 0.0)


# ---- the node ----


@pytest.fixture
def live(ros, tmp_path):
    """The process of live_view and the address of its page."""
    log = tmp_path / 'live.txt'
    process = start('disc_sim_ros.ros.live', ['--ros-args', '-p', 'port:=0'], log)
    try:
        end = time.monotonic() + DEADLINE
        while (match := re.search(r'http://\S+', log.read_text())) is None:
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < end, log.read_text()
            time.sleep(0.05)
        yield process, match[0]
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(DEADLINE) == 0, log.read_text()
        assert 'Traceback' not in log.read_text()


def states(viewer, until) -> list[dict]:
    """Return the states of the disc until a condition of them holds."""
    received: list[dict] = []
    end = time.monotonic() + DEADLINE
    while not received or not until(received):
        assert time.monotonic() < end, received[-3:]
        message = json.loads(viewer.recv(DEADLINE))
        received += list(message.get('discs', {}).values())
    return received


def test_a_launch_that_the_simulator_refuses_is_not_called_thrown(ros, live):
    """It is in the range of the page, and too fast for the steps of this simulator."""
    slow = {'auto_throw': False, 'physics_rate': 50.0, 'publish_rate': 50.0}
    sim = ros.start(slow)
    _, address = live
    token = address.partition('#')[2]
    with connect(socket_of(address)) as viewer:
        throw_when_ready(viewer, token)
        said = answer(viewer, disc='', token=token, **THROW | {'spin': 1000.0})
    ros.spin_until(lambda: 'throw dropped' in sim.stderr, 'the refusal')
    assert said == SENT


def throw_when_ready(viewer, token: str) -> None:
    """Throw as soon as the simulator and live_view have discovered each other."""
    end = time.monotonic() + DEADLINE
    while (said := answer(viewer, disc='', token=token, **THROW)) != SENT:
        assert said == 'error: no simulator takes throws for this disc'
        assert time.monotonic() < end
        time.sleep(0.1)


def test_odometry_from_before_a_release_that_was_taken_first_begins_no_flight(ros):
    """It was taken for time that was set back, and the flight ran ahead by as much."""
    disc = discs.LiveDisc(ros.node, '')
    latched = qos.LATCHED_QOS
    releases = ros.node.create_publisher(Odometry, topics.RELEASE, latched)
    odometry = ros.node.create_publisher(Odometry, topics.ODOM, 10)

    def sent(publisher, milliseconds: int):
        message = Odometry()
        message.header.stamp.sec = 10
        message.header.stamp.nanosec = milliseconds * 1_000_000
        message.pose.pose.position.x = 1e-3 * milliseconds
        message.pose.pose.orientation.w = 1.0
        publisher.publish(message)

    def state_with(milliseconds: int):
        """Return the time of the state that this odometry gives; it may take until it is known."""
        end = time.monotonic() + DEADLINE
        while time.monotonic() < end:
            sent(odometry, milliseconds)
            if (state := disc.update(METRIC)) is not None:
                return state['t']
            time.sleep(0.01)
        return None

    assert state_with(100) == 0.0  # no release is known: the first one begins the flight
    sent(releases, 500)
    end = time.monotonic() + DEADLINE
    while disc.about()['flight'] < 2:
        assert time.monotonic() < end
        disc.update(METRIC)
        time.sleep(0.01)
    for late in (400, 450):
        sent(odometry, late)
        for _ in range(20):
            assert disc.update(METRIC) is None
            time.sleep(0.005)
    assert state_with(700) == pytest.approx(0.2)
    assert disc.about()['flight'] == 2
    assert state_with(300) == 0.0  # time was set back
    assert disc.about()['flight'] == 3


def test_the_states_are_those_of_the_flight(ros, live):
    sim = ros.start({'auto_throw': False})
    _, address = live
    token = address.partition('#')[2]
    expected = fly(Launch(**THROW), Setup(disc=load_disc('frisbee'), step=1e-3))
    with connect(socket_of(address)) as viewer:
        throw_when_ready(viewer, token)
        said = answer(viewer, disc='', token=token, speed=1e6)
        assert said.startswith('error: speed: ')
        assert '200' in said
        assert 'choose from speed' in answer(viewer, disc='', token=token, mass=1.0)
        assert 'no simulator' in answer(viewer, disc='/red', token=token)
        prediction = PoseWithCovarianceStamped()
        prediction.pose.pose.position.x = 17.0
        landings = ros.publisher(PoseWithCovarianceStamped, topics.PredictorTopic.LANDING)

        landing_time = expected.time - 5e-5  # s; times have four places
        assert expected.position[2] == pytest.approx(0.0, abs=ON_GROUND)

        def landed(s):
            landings.publish(prediction)  # each time: the subscriber may know the publisher late
            # After a slip of a late machine the disc is still in the air then.
            return s[-1]['t'] >= landing_time and s[-1]['position'][2] <= ON_GROUND

        flown = states(viewer, landed)
    assert sim.process.poll() is None
    assert [17.0, 0.0, 0.0] in [state.get('landing') for state in flown]
    times = [state['t'] for state in flown]
    assert times == sorted(times)
    last = flown[-1]  # the first ones may come before the configuration, which says what flies
    assert (last['name'], last['diameter'], last['wind']) == ('frisbee', 0.275, None)
    # The last state is the first one after the landing: a period of 1/30 s later, if the machine
    # is in time. A disc at rest gives no further states.
    assert landing_time <= times[-1] < expected.time + 1.0
    assert flown[-1]['position'][:2] == pytest.approx(expected.position[:2], abs=0.05)
    turned = flown[-2]['spin'] - flown[0]['spin']
    # Clockwise from above is negative about z up; the spin falls by a few percent from 40 rad/s.
    assert turned == pytest.approx(-39.5 * (times[-2] - times[0]), rel=0.03)


@pytest.mark.skipif(browser.program() is None, reason=browser.MISSING)
def test_the_button_throws_and_the_page_shows_it(ros, live):
    ros.start({'auto_throw': False})
    _, address = live
    with browser.Browser(700, 700) as tab:
        tab.open(address)
        tab.wait('discView.ready')
        tab.wait(f'discView.throws() === "{SENT}"')
        tab.wait('discView.flights.length === 1 && discView.time > 0.5')
        first = tab.value('discView.pose(0).position')
        tab.wait(f'discView.pose(0).position[0] > {first[0] + 2.0}')
        tab.wait('document.querySelectorAll("figure svg path").length === 6')
        assert 'airspeed' in tab.value('document.getElementById("now").textContent')
        assert tab.problems == []
        hosts = {r.partition('//')[2].partition('/')[0] for r in tab.requests if '//' in r}
    assert hosts <= {address.partition('//')[2].partition('/')[0]}


def test_an_argument_that_is_not_allowed_ends_with_2(ros_environment):
    command = [sys.executable, '-m', 'disc_sim_ros.ros.live', '--ros-args', '-p', 'rate:=1000.0']
    done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE, check=False)
    assert done.returncode == 2
    assert re.search(r'live_view: error: rate: .*120', done.stderr)
