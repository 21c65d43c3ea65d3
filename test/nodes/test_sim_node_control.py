"""sim_node in a process of its own obeys, refuses, tells and ends as it should."""

from collections import Counter
import copy
import math
import os
from pathlib import Path
import re
import signal
import struct
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMessage
from nodes.sim_process import DEADLINE
from rcl_interfaces.msg import ParameterType
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64, String
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray
import yaml

from disc_sim_ros.nodes import topics
from disc_sim_ros.nodes.commands import MOST_WAITING
from disc_sim_ros.nodes.conversions import Quantities
from disc_sim_ros.nodes.parameter_table import TABLE
from disc_sim_ros.nodes.sim_node import SimNode
from disc_sim_ros.nodes.wire import assign

pytestmark = pytest.mark.ros

SECOND = 1_000_000_000  # ns
PERIOD = 5_000_000  # ns, from message to message by default
HELD = {'auto_throw': False, 'start_time': 0.0}
LONG = HELD | {'launch.height': 1000.0}  # a flight that outlasts a test


def patience(seconds: float) -> float:
    """A time limit [s], longer on a machine that has more to do than it can."""
    return seconds * max(1.0, os.getloadavg()[0] / os.cpu_count())


# ---- what is heard ----


def ns(cdr: bytes) -> int:
    """The stamp of a serialised message that begins with a header."""
    seconds, nanoseconds = struct.unpack_from('<iI', cdr, 4)
    return seconds * SECOND + nanoseconds


def stamp(message) -> int:
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def told(response, pattern: str) -> int:
    """A time in seconds that a service's answer tells, in ns."""
    assert response.success, response.message
    found = re.fullmatch(pattern.replace('TIME', r'(\d+\.\d{9}) s'), response.message)
    assert found, response.message
    return round(float(found[1]) * SECOND)


def throw(ros, sim, flight: int) -> int:
    """Throw; return the stamp of the release."""
    return told(ros.call(sim, 'throw'), f'flight {flight}, released at TIME')


def since(odom: list[bytes], release: int, until: float = math.inf) -> dict[int, bytes]:
    """All but the stamps of a flight's messages, by time since the release [ns]."""
    return {ns(m) - release: m[12:] for m in odom if release <= ns(m) <= until}


def names(events) -> list[str]:
    return [event.name.partition(': ')[2] for event in events]


def fly_until(ros, odom, time_: float) -> None:
    """Take messages until one has a stamp [ns] at least so late."""
    ros.spin_until(lambda: odom and ns(odom[-1]) >= time_, f'odom at {time_ / SECOND} s')


def time_of(ros, sim) -> tuple[int, float]:
    """The present stamp [ns], and the wall time of asking [s]."""
    response = ros.call(sim, 'pause', SetBool, data=True)
    ros.pause(sim, still=False)
    return told(response, 'time stands still at TIME'), time.monotonic()


def wall(seconds: float):
    """A condition that holds once a wall time has passed."""
    end = time.monotonic() + seconds
    return lambda: time.monotonic() >= end


def diagnostics_of(heard) -> dict[str, str]:
    """The newest values of /diagnostics."""
    return {pair.key: pair.value for pair in heard[-1].status[0].values} if heard else {}


def accepted(diagnostics, topic: str) -> int:
    return int(diagnostics_of(diagnostics).get(f'{topic} accepted', 0))


def release_of(x=0.0, z=100.0, spin=-30.0) -> Odometry:
    message = Odometry()
    message.pose.pose.position.x = x
    message.pose.pose.position.z = z
    message.pose.pose.orientation.w = 1.0
    message.twist.twist.linear.x = 12.0
    message.twist.twist.angular.z = spin
    return message


# ---- pause, step, reset, throw ----


def test_services_do_what_they_say_in_any_order(ros):
    sim = ros.start(HELD | {'launch.height': 20.0})
    events = ros.listen(DiagnosticStatus, 'flight_events')
    odom = ros.listen(Odometry, 'odom', raw=True)
    fly_until(ros, odom, 0)

    refused = ros.call(sim, 'step')
    assert not refused.success
    assert '~/pause' in refused.message
    assert ros.call(sim, 'reset').success  # before any throw
    release = throw(ros, sim, 1)
    fly_until(ros, odom, release + 0.1 * SECOND)

    now = told(ros.call(sim, 'pause', SetBool, data=True), 'time stands still at TIME')
    assert told(ros.call(sim, 'pause', SetBool, data=True), 'time stands still at TIME') == now
    for _ in range(2):
        now += PERIOD
        assert told(ros.call(sim, 'step'), 'now at TIME') == now
    fly_until(ros, odom, now)
    assert list(since(odom, release)) == list(range(0, now - release + 1, PERIOD))

    def shown(height: float, speed: float) -> bool:
        newest = deserialize_message(odom[-1], Odometry)
        linear = newest.twist.twist.linear
        moving = math.hypot(linear.x, linear.y, linear.z)
        return newest.pose.pose.position.z == height and moving == pytest.approx(speed)

    assert throw(ros, sim, 2) == now  # also while time stands still
    ros.spin_until(lambda: ns(odom[-1]) == now and shown(20.0, 15.0), 'the second release')
    for _ in range(2):
        assert ros.call(sim, 'reset').success
    ros.spin_until(lambda: shown(20.0, 0.0), 'the disc at rest')
    assert ns(odom[-1]) == now

    flights = []
    for _ in range(2):  # after a reset the first flight comes again
        release = throw(ros, sim, 1)
        landings = names(events).count('landed')
        for _ in range(2):
            assert ros.call(sim, 'pause', SetBool, data=False).success
        assert not ros.call(sim, 'step').success
        assert ros.set(sim, {'real_time_factor': 5.0}).successful
        ros.spin_until(lambda before=landings: names(events).count('landed') > before, 'landed')
        ros.spin_until(lambda: shown(0.0, 0.0), 'the disc on the ground')
        flights.append(since(odom, release, ns(odom[-1])))
        assert ros.call(sim, 'reset').success
        ros.spin_until(lambda: shown(20.0, 0.0), 'the disc at rest')
    first, again = flights
    both = first.keys() & again.keys()
    assert len(both) > 200
    assert [first[t] for t in sorted(both)] == [again[t] for t in sorted(both)]
    expected = ['reset', 'thrown', 'thrown', 'reset', 'reset', *['thrown', 'landed', 'reset'] * 2]
    ros.spin_until(lambda: len(events) == len(expected), 'the last event')
    assert names(events) == expected


def test_a_thrown_message_replaces_the_flight(ros):
    sim = ros.start(LONG)
    events = ros.listen(DiagnosticStatus, 'flight_events')
    releases = ros.listen(Odometry, 'release', qos=topics.LATCHED_QOS)
    diagnostics = ros.listen(DiagnosticArray, '/diagnostics')
    odom = ros.listen(Odometry, 'odom')
    thrower = ros.publisher(Odometry, 'throw')
    ros.spin_until(lambda: odom, 'odom')
    throw(ros, sim, 1)
    ros.spin_until(lambda: odom[-1].twist.twist.linear.x > 0.0, 'the flight')

    thrower.publish(release_of(x=1.0))
    ros.spin_until(lambda: len(releases) == 2, 'the second release')
    assert releases[1].pose == release_of(x=1.0).pose
    assert releases[1].twist == release_of(x=1.0).twist
    ros.spin_until(lambda: stamp(odom[-1]) > stamp(releases[1]), 'the second flight')
    at_release = [m for m in odom if m.header.stamp == releases[1].header.stamp]
    assert [m.pose for m in at_release] == [releases[1].pose]  # announced, and at a message

    ros.pause(sim)
    for x in (2.0, 3.0):
        thrower.publish(release_of(x=x))
    ros.spin_until(lambda: accepted(diagnostics, 'throw') == 3, 'both')
    assert ros.call(sim, 'step').success
    ros.spin_until(lambda: len(releases) == 3, 'a third')
    assert releases[2].pose.pose.position.x == 3.0  # the newest of two at the same time
    later = release_of(x=4.0)
    later.header.stamp.sec = stamp(releases[2]) // SECOND + 1
    thrower.publish(later)
    ros.pause(sim, still=False)
    ros.spin_until(lambda: len(releases) == 4, 'a fourth')
    assert releases[3].header.stamp == later.header.stamp
    ros.spin_until(lambda: names(events) == ['thrown'] * 4, 'four events')


def test_fifty_throws_a_second_are_all_answered(ros):
    """The messages stay evenly spaced, each throw begins at one, and the pace is kept."""
    sim = ros.start(LONG)
    releases = ros.listen(Odometry, 'release', qos=topics.LATCHED_QOS)
    odom = ros.listen(Odometry, 'odom', raw=True)
    client = ros._client(sim, 'throw', Trigger)
    ros._reach(sim)
    ros.spin_until(lambda: odom, 'odom')
    begun, first = time.monotonic(), ns(odom[-1])
    answers = []
    while len(answers) < 100:
        pending = [client.call_async(Trigger.Request()) for _ in range(5)]
        ros.spin_until(lambda: all(f.done() for f in pending), 'answers')  # noqa: B023
        answers += [future.result() for future in pending]
    took = time.monotonic() - begun
    assert took < patience(2.0)
    released = [told(a, f'flight {i}, released at TIME') for i, a in enumerate(answers, start=1)]
    fly_until(ros, odom, released[-1] + PERIOD)
    stamps = [ns(m) for m in odom]
    assert set(np.diff(stamps)) == {PERIOD}
    assert set(released) <= set(stamps)
    assert released[-1] - first == pytest.approx(took * SECOND, abs=patience(0.2) * SECOND)
    assert {stamp(m) for m in releases} <= set(released)


@pytest.mark.parametrize('slow', [{'publish_rate': 0.1}, {'real_time_factor': 1e-6}])
def test_nobody_waits_for_a_message_that_is_due_in_minutes(ros, slow):
    sim = ros.start(LONG | slow)
    odom = ros.listen(Odometry, 'odom', raw=True)
    ros.spin_until(lambda: ros.call(sim, 'reset').success and odom, 'odom')
    begun = time.monotonic()
    ros.pause(sim)
    ros.pause(sim, still=False)
    release = throw(ros, sim, 1)
    ros.spin_until(lambda: ns(odom[-1]) == release, 'the release')
    assert ros.set(sim, {'real_time_factor': 1000.0}).successful
    fly_until(ros, odom, release + 20 * SECOND)
    assert time.monotonic() - begun < patience(5.0)  # the message is due in 10 s at least


# ---- parameters ----


def answer(ros, future):
    ros.spin_until(future.done, 'an answer')
    return future.result()


def all_values(ros, client) -> dict[str, object]:
    """What `ros2 param dump` shows."""
    listed = list(answer(ros, client.list_parameters()).result.names)
    found = answer(ros, client.get_parameters(listed)).values
    values = zip(listed, map(parameter_value_to_python, found), strict=True)
    return {name: list(x) if hasattr(x, 'typecode') else x for name, x in values}


def test_parameters_are_listed_described_and_refused_as_a_whole(ros):
    sim = ros.start(LONG)
    ros._reach(sim)
    client = ros._parameters[sim]
    before = all_values(ros, client)
    expected = {
        e.name: list(e.default) if e.unit and isinstance(e.default, tuple) else e.default
        for e in TABLE
    }
    assert {name: before[name] for name in expected} == expected | LONG

    described = answer(ros, client.describe_parameters([entry.name for entry in TABLE]))
    for entry, shown in zip(TABLE, described.descriptors, strict=True):
        assert shown.name == entry.name
        assert entry.meaning in shown.description
        assert f'Unit: {entry.unit}.' in shown.description or not entry.unit
        assert shown.read_only == (entry.effect == 'fixed')
        assert not shown.dynamic_typing
        for range_ in [*shown.floating_point_range, *shown.integer_range]:
            assert (range_.from_value, range_.to_value) == (entry.lowest, entry.highest)
        numbers = (ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_INTEGER)
        assert (shown.type in numbers) == bool(
            shown.floating_point_range or shown.integer_range
        ), entry.name

    for impossible, why in {
        ('launch.speed', 20.0, 'physics_rate', 300.0): 'publish_rate: 200 .* whole multiple',
        ('launch.speed', 20.0, 'launch.height', -1.0): 'launch.height: -1 .* ground',
        ('wind.x', 3.0, 'disc', 'brick'): "disc: 'brick' .* frisbee",
        ('wind.x', 3.0, 'launch.speed', math.nan): 'launch.speed',
        ('launch.speed', 20.0, 'launch.pitch', 'steep'): 'DOUBLE',
        ('launch.speed', 20.0, 'launch.pitch', 181.0): 'launch.pitch',
        ('launch.speed', 20.0, 'start_time', 5.0): 'start_time',
        ('launch.speed', 20.0, 'launch.sped', 5.0): 'undeclared',
        ('aero', 'table', 'disc', 'flat_plate'): 'aero',
    }.items():
        changes = dict(zip(impossible[::2], impossible[1::2], strict=True))
        result = ros.set(sim, changes)
        assert not result.successful, changes
        assert re.search(why, result.reason), result.reason
    assert all_values(ros, client) == before

    # Not atomically, each is judged for itself.
    changes = [Parameter('launch.speed', value=20), Parameter('launch.pitch', value=181.0)]
    results = answer(ros, client.set_parameters(changes)).results
    assert [result.successful for result in results] == [True, False]
    assert all_values(ros, client) == before | {'launch.speed': 20.0}
    assert ros.set(sim, {'physics_rate': 300.0, 'publish_rate': 100.0}).successful


NEXT_THROW = {
    'disc': 'ultrastar',
    'model': 'precession',
    'moment_axes': 'wind',
    'air_density': 1.1,
    'gravity': 9.0,
    'ground': False,
    'launch.speed': 18.0,
    'launch.spin': 50.0,
    'launch.height': 900.0,
    'physics_rate': 2000.0,
    'publish_rate': 100.0,
    'wind.turbulence': 5.0,
    'wind.seed': 3,
}


def test_changes_take_effect_when_they_should(ros):
    sim = ros.start(LONG)
    twin = ros.start(LONG, namespace='/twin')
    winds = ros.listen(Vector3Stamped, 'applied_wind')
    configurations = ros.listen(String, 'configuration', qos=topics.LATCHED_QOS)
    odom = ros.listen(Odometry, 'odom', raw=True)
    twin_odom = ros.listen(Odometry, '/twin/odom', raw=True)
    fly_until(ros, odom, 0)
    fly_until(ros, twin_odom, 0)
    release, twin_release = throw(ros, sim, 1), throw(ros, twin, 1)
    winds.clear()

    fly_until(ros, odom, release + 0.1 * SECOND)
    assert ros.set(sim, NEXT_THROW).successful
    fly_until(ros, odom, ns(odom[-1]) + 0.3 * SECOND)
    assert not winds or all(w.vector.y == 0.0 for w in winds)
    assert ros.set(sim, {'wind.y': 3.0}).successful
    ros.spin_until(lambda: any(w.vector.y == 3.0 for w in winds), 'the wind')
    blows = stamp(winds[-1])
    assert blows <= time_of(ros, sim)[0]
    fly_until(ros, odom, blows + 0.2 * SECOND)
    flown = since(odom, release)
    fly_until(ros, twin_odom, twin_release + max(flown))
    calm = since(twin_odom, twin_release)
    assert all(flown[t] == calm[t] for t in flown if t <= blows - release)
    assert all(flown[t] != calm[t] for t in flown if t > blows - release)

    release = throw(ros, sim, 2)
    ros.spin_until(lambda: len(configurations) == 2, 'the configuration')
    old, new = (yaml.safe_load(text.data) for text in configurations)
    assert (old['disc'], old['physics_rate'], old['gravity']) == ('frisbee', 1000.0, 9.81)
    assert (new['disc'], new['model'], new['moment_axes']) == ('ultrastar', 'precession', 'wind')
    assert (new['physics_rate'], new['publish_rate']) == (2000.0, 100.0)
    assert (new['air_density'], new['gravity'], new['ground']) == (1.1, 9.0, False)
    assert (new['wind']['y'], new['wind']['turbulence'], new['wind']['seed']) == (
        3.0,
        5.0,
        4,
    )  # each flight its own
    assert new['release']['Z'] == -900.0
    fly_until(ros, odom, release + 0.1 * SECOND)
    assert set(np.diff(list(since(odom, release)))) == {2 * PERIOD}

    for factor in (5.0, 0.1):
        assert ros.set(sim, {'real_time_factor': factor}).successful
        (first, begun), _, (last, ended) = (
            time_of(ros, sim),
            ros.spin_until(wall(0.4)),
            time_of(ros, sim),
        )
        assert (last - first) / SECOND / (ended - begun) == pytest.approx(factor, rel=0.5)


# ---- time ----


def test_nodes_with_use_sim_time_follow_the_clock(ros, ros_context):
    """Also the simulator itself may have use_sim_time, which must not make it wait for itself."""
    sim = ros.start(LONG | {'publish_clock': True, 'real_time_factor': 5.0, 'use_sim_time': True})
    follower = Node(
        'follower',
        context=ros_context,
        parameter_overrides=[Parameter('use_sim_time', value=True)],
    )
    ros._executor.add_node(follower)
    clock = follower.get_clock()
    ticks = []
    follower.create_timer(0.1, lambda: ticks.append(clock.now().nanoseconds))
    ros.spin_until(lambda: ticks, 'a tick')
    begun, first = time.monotonic(), clock.now().nanoseconds
    ros.spin_until(lambda: clock.now().nanoseconds >= first + 5 * SECOND, '5 s')
    assert time.monotonic() - begun == pytest.approx(1.0, abs=patience(0.3))
    assert len(ticks) == pytest.approx(50, abs=25)  # rclpy leaves out what it is late for
    assert SECOND / 10 in np.diff(ticks)

    now = told(ros.call(sim, 'pause', SetBool, data=True), 'time stands still at TIME')
    ros.spin_until(lambda: clock.now().nanoseconds == now, 'the time at which it stands')
    count = len(ticks)
    ros.spin_until(wall(0.5))
    assert clock.now().nanoseconds == now
    assert len(ticks) - count <= 1
    assert told(ros.call(sim, 'step'), 'now at TIME') == now + PERIOD
    ros.spin_until(lambda: clock.now().nanoseconds == now + PERIOD, 'the step')
    ros.pause(sim, still=False)
    ros.spin_until(lambda: len(ticks) > count + 5, 'time to go on')
    ros._executor.remove_node(follower)
    follower.destroy_node()


def test_the_clock_ticks_at_a_rate_of_its_own(ros):
    """100 to 200 Hz of wall time, whatever the messages do, also while time stands still."""
    heard = {}
    for name, parameters in {
        'dense': {'publish_rate': 1000.0},
        'fast': {'real_time_factor': 20.0},
        'sparse': {'publish_rate': 1.0},
        'usual': {},
    }.items():
        ros.start(
            LONG | {'publish_clock': True} | parameters,
            '-r',
            f'/clock:=/{name}_clock',
            namespace=f'/{name}',
        )
        heard[name] = ros.listen(Clock, f'{name}_clock', raw=True)
    ros.pause(ros.sims[-1])
    ros.spin_until(lambda: all(heard.values()), 'the clocks')
    ros.forget()
    begun = time.monotonic()
    ros.spin_until(wall(1.5))
    took = time.monotonic() - begun
    rates = {name: len(ticks) / took for name, ticks in heard.items()}
    assert all(40 < rate < 215 for rate in rates.values()), rates
    for name, ticks in heard.items():
        stamps = [ns(cdr) for cdr in ticks]
        assert (len(set(stamps)) == 1) if name == 'usual' else (min(np.diff(stamps)) > 0)


# ---- more than one ----


def test_discs_side_by_side_do_not_mix(ros):
    red = ros.start(LONG | {'frame_prefix': 'red/', 'launch.speed': 10.0}, namespace='/red')
    blue = ros.start(LONG | {'frame_prefix': 'blue/', 'launch.speed': 20.0}, namespace='/blue')
    other = ros.start(LONG, '-r', 'odom:=/other/odom', '-r', '__node:=third')
    other.name = '/third'
    heard = {
        sim: {
            Odometry: ros.listen(Odometry, odom),
            TransformStamped: ros.listen(TransformStamped, transform),
            WrenchStamped: ros.listen(WrenchStamped, moment),
        }
        for sim, odom, transform, moment in (
            (red, '/red/odom', '/red/transform', '/red/applied_moment'),
            (blue, '/blue/odom', '/blue/transform', '/blue/applied_moment'),
            (other, '/other/odom', '/transform', '/applied_moment'),
        )
    }
    diagnostics = ros.listen(DiagnosticArray, '/diagnostics')
    torque = ros.publisher(WrenchStamped, '/red/cmd_moment')
    ros.spin_until(lambda: all(sum(map(len, h.values())) > 1 for h in heard.values()), 'odom')
    for sim in heard:
        throw(ros, sim, 1)
    command = WrenchStamped()
    command.header.frame_id = 'red/disc'
    command.wrench.torque.x = 0.001
    torque.publish(command)
    ros.spin_until(lambda: heard[red][WrenchStamped], 'the moment')

    def fly() -> bool:
        return all(any(m.twist.twist.linear.x > 0.0 for m in h[Odometry]) for h in heard.values())

    ros.spin_until(fly, 'all three in the air')
    ros.spin_until(lambda: len({a.status[0].name for a in diagnostics}) == 3, 'diagnostics')
    for sim, speed, prefix in ((red, 10.0, 'red/'), (blue, 20.0, 'blue/'), (other, 15.0, '')):
        odom = heard[sim][Odometry]
        assert {(m.header.frame_id, m.child_frame_id) for m in odom} == {('map', f'{prefix}disc')}
        fastest = max(m.twist.twist.linear.x for m in odom)
        assert fastest == pytest.approx(speed, rel=0.01)
        frames = {(m.header.frame_id, m.child_frame_id) for m in heard[sim][TransformStamped]}
        assert frames == {('map', f'{prefix}disc'), (f'{prefix}disc', f'{prefix}disc_body')}
        assert set(np.diff([stamp(m) for m in odom])) == {PERIOD}
    assert not heard[blue][WrenchStamped]
    assert not heard[other][WrenchStamped]
    assert {a.status[0].name for a in diagnostics} == {
        'red/sim_node: simulation',
        'blue/sim_node: simulation',
        'third: simulation',
    }
    assert not ros.node.count_publishers('/odom')


# ---- bad input ----


def bad(message, **changes):
    """A command with changed fields, `__` for the dots."""
    message = copy.deepcopy(message)
    for path, value in changes.items():
        assign(message, path.replace('__', '.'), value)
    return message


THROW, TORQUE, VECTOR = release_of(), WrenchStamped(), Vector3Stamped()
AT, TURN = 'pose__pose__position', 'pose__pose__orientation'
BAD = {  # for each topic, messages and why they are dropped
    'cmd_moment': [
        (bad(TORQUE, wrench__torque__x=math.nan), 'torque.x: nan'),
        (bad(TORQUE, wrench__torque__y=-math.inf), 'torque.y: -inf'),
        (bad(TORQUE, wrench__torque__z=1e300), 'torque.z: 1e.300 .* N m'),
        (bad(TORQUE, wrench__force__x=1e-9), 'force.x: 1e-09 .* torques, not forces'),
        (bad(TORQUE, wrench__force__z=math.nan), 'force.z: nan .* torques, not forces'),
        (bad(TORQUE, header__frame_id='base_link'), "frame_id: 'base_link' .* disc_air"),
    ],
    'cmd_coefficients': [
        (bad(VECTOR, vector__x=math.nan), 'vector.x: nan'),
        (bad(VECTOR, vector__y=math.inf), 'vector.y: inf'),
        (bad(VECTOR, vector__z=-1e300), 'vector.z: -1e.300'),
        (bad(VECTOR, header__frame_id='disc'), "frame_id: 'disc' .* disc_air"),
    ],
    'wind': [
        (bad(VECTOR, vector__x=math.nan), 'vector.x: nan'),
        (bad(VECTOR, vector__y=math.inf), 'vector.y: inf'),
        (bad(VECTOR, vector__z=1e300), 'vector.z: 1e.300 .* m/s'),
        (bad(VECTOR, header__frame_id='disc'), "frame_id: 'disc' .* map"),
    ],
    'throw': [
        (bad(THROW, **{f'{AT}__x': math.nan}), 'position.x: nan'),
        (bad(THROW, **{f'{AT}__y': math.inf}), 'position.y: inf'),
        (bad(THROW, twist__twist__linear__x=1e300), 'linear.x: 1e.300'),
        (bad(THROW, twist__twist__angular__y=math.nan), 'angular.y: nan'),
        (bad(THROW, **{f'{TURN}__w': 0.0}), 'orientation: .* length 1'),
        (bad(THROW, **{f'{TURN}__x': 0.1}), 'orientation: .* length 1'),
        (bad(THROW, **{f'{TURN}__w': math.nan}), 'orientation.w: nan'),
        (bad(THROW, twist__twist__angular__z=0.0), 'angular.z: 0 .* needs spin'),
        (bad(THROW, **{f'{AT}__z': -0.5}), 'height: -0.5 .* ground'),
        (bad(THROW, header__frame_id='odom'), "header.frame_id: 'odom' .* map"),
        (bad(THROW, child_frame_id='base_link'), "child_frame_id: 'base_link' .* disc"),
    ],
}  # fmt: skip


def test_bad_commands_are_dropped_with_a_reason_and_the_flight_goes_on(ros):
    """Bit for bit as that of a simulator that nobody talks to; some simulators share the work."""
    spaces = ('/a', '/b', '/c')
    for space in (*spaces, '/alone'):
        ros.start(LONG | {'real_time_factor': 2.0}, namespace=space)
    diagnostics = ros.listen(DiagnosticArray, '/diagnostics')
    odom = {s: ros.listen(Odometry, f'{s}/odom', raw=True) for s in (*spaces, '/alone')}
    publishers = {
        (space, topic): ros.publisher(type(messages[0][0]), f'{space}/{topic}')
        for space in spaces
        for topic, messages in BAD.items()
    }
    ros.spin_until(lambda: all(odom.values()), 'odom')
    release = {sim.name[: -len('/sim_node')]: throw(ros, sim, 1) for sim in ros.sims}

    def newest(space: str) -> dict[str, str]:
        own = [a for a in diagnostics if a.status[0].name.startswith(f'{space[1:]}/')]
        return diagnostics_of(own)

    todo = {topic: list(messages) for topic, messages in BAD.items()}
    begun, sent = time.monotonic(), Counter()
    while any(todo.values()):
        expected = {}
        for space in spaces:
            for topic, messages in todo.items():
                if messages:
                    message, expected[space, topic] = messages.pop(0)
                    publishers[space, topic].publish(message)
                    sent[space, topic] += 1

        def is_told(space: str, topic: str, why: str) -> bool:
            values = newest(space)
            return values.get(f'{topic} dropped') == str(sent[space, topic]) and bool(
                re.search(why, values[f'{topic} last reason'])
            )

        ros.spin_until(
            lambda: all(is_told(*key, why) for key, why in expected.items()),  # noqa: B023
            f'dropped: {expected}',
        )
    took = time.monotonic() - begun

    flown = {space: since(odom[space], release[space]) for space in odom}
    common = set.intersection(*(set(flight) for flight in flown.values()))
    assert max(common) > 2 * SECOND
    for space in spaces:
        assert all(flown[space][t] == flown['/alone'][t] for t in common)
        values = newest(space)
        assert int(values['dropped_commands']) == sum(
            n for (s, _), n in sent.items() if s == space
        )
        assert [values[f'{topic} accepted'] for topic in BAD] == ['0'] * 4
        assert values['throws'] == '1'
    for sim in ros.sims:
        warnings = [line for line in sim.stderr.splitlines() if 'dropped: ' in line]
        # One a second and topic.
        at_most = 0 if sim.name.startswith('/alone') else len(BAD) * (took + 2)
        assert bool(at_most) <= len(warnings) <= at_most
        assert not re.search('Traceback|Error', sim.stderr)


def memory(sim) -> int:
    """Resident memory of a simulator [bytes]."""
    status = Path(f'/proc/{sim.process.pid}/status').read_text()
    return int(re.search(r'VmRSS:\s+(\d+) kB', status)[1]) * 1024


def test_a_flood_of_commands_breaks_neither_pace_nor_memory(ros):
    sim = ros.start(LONG)
    applied = ros.listen(WrenchStamped, 'applied_moment')
    diagnostics = ros.listen(DiagnosticArray, '/diagnostics')
    odom = ros.listen(Odometry, 'odom', raw=True)
    torque = ros.publisher(WrenchStamped, 'cmd_moment')
    fly_until(ros, odom, 0)
    throw(ros, sim, 1)
    ros.spin_until(lambda: diagnostics, 'diagnostics')
    before, count, begun = memory(sim), len(diagnostics), time.monotonic()
    message = serialize_message(WrenchStamped())
    sent, due = 0, begun
    while due < begun + 1.0:
        for _ in range(100):
            torque.publish(message)
        sent, due = sent + 100, due + 0.005
        ros.spin_until(lambda: time.monotonic() >= min(due, begun + 1.0))  # noqa: B023
    last = WrenchStamped()
    last.wrench.torque.x = 0.001
    torque.publish(last)
    ros.spin_until(lambda: applied and applied[-1].wrench.torque.x == 0.001, 'the last')
    ros.spin_until(lambda: len(diagnostics) > count + 2, 'diagnostics')
    assert memory(sim) - before < 20e6
    values = [diagnostics_of([message]) for message in diagnostics[count:]]
    # About 1 on an idle machine, though the flood takes most of a core.
    assert min(float(v['real_time_factor']) for v in values) > 0.2
    assert 100 < int(values[-1]['cmd_moment accepted']) <= sent + 1
    assert values[-1]['dropped_commands'] == '0'
    fly_until(ros, odom, stamp(applied[-1]) + SECOND)
    assert set(np.diff([ns(m) for m in odom])) == {PERIOD}


def test_commands_for_the_future_are_limited_and_those_for_now_are_not(ros):
    """Of those for now only the newest waits, also while time stands still."""
    sim = ros.start(LONG)
    diagnostics = ros.listen(DiagnosticArray, '/diagnostics')
    applied = ros.listen(WrenchStamped, 'applied_moment')
    odom = ros.listen(Odometry, 'odom', raw=True)
    torque = ros.publisher(WrenchStamped, 'cmd_moment')
    coefficients = ros.publisher(Vector3Stamped, 'cmd_coefficients')
    fly_until(ros, odom, 0)
    throw(ros, sim, 1)
    ros.pause(sim)

    now, future = WrenchStamped(), Vector3Stamped()
    future.header.stamp.sec = 1_000_000
    sent, batch = 0, 50  # a reader holds 100
    while sent < MOST_WAITING + batch:
        for _ in range(batch):
            sent += 1
            now.wrench.torque.x = 1e-6 * sent
            torque.publish(now)
            coefficients.publish(future)
        before = ns(odom[-1])  # the topics are polled while the disc flies on
        ros.call(sim, 'step')
        fly_until(ros, odom, before + 1)

    def taken() -> bool:
        values = diagnostics_of(diagnostics)
        both = ('cmd_coefficients accepted', 'cmd_coefficients dropped')
        return sum(int(values.get(name, 0)) for name in both) == sent

    ros.spin_until(taken, 'all taken')
    values = diagnostics_of(diagnostics)
    assert values['cmd_coefficients dropped'] == str(batch)
    assert f'{MOST_WAITING} commands at most' in values['cmd_coefficients last reason']
    assert f'cmd_coefficients dropped: {values["cmd_coefficients last reason"]}' in sim.stderr
    assert (values['cmd_moment accepted'], values['cmd_moment dropped']) == (str(sent), '0')
    applied.clear()

    # A controller that goes on while time stands still, and what acts when it moves again.
    for _ in range(0, MOST_WAITING + batch, batch):
        for _ in range(batch):
            sent += 1
            now.wrench.torque.x = 1e-6 * sent
            torque.publish(now)
        ros.pause(sim)  # a round trip, while the topic is polled
    ros.spin_until(lambda: accepted(diagnostics, 'cmd_moment') == sent, 'all taken')
    assert diagnostics_of(diagnostics)['cmd_moment dropped'] == '0'
    assert not applied
    ros.pause(sim, still=False)
    ros.spin_until(lambda: applied, 'a moment')
    assert applied[0].wrench.torque.x == now.wrench.torque.x


# ---- beginning and ending ----


WRONG = {  # arguments, what the one line says
    ('-p', 'launch.sped:=3.0'): 'launch.sped: 3 .* did you mean launch.speed',
    ('-p', 'launch.speed:=fast'): "launch.speed: 'fast' .* number",
    ('-p', 'qos_overrides./odom.publisher.dept:=5'): 'qos_overrides./odom.publisher.dept',
    ('-p', 'launch.speed'): "'-p launch.speed'",
    ('--params-file', 'misspelt.yaml'): 'wind.gusts: 3 .* no such parameter',
    ('--params-file', 'wrong_type.yaml'): r'imu.offset: \[1.0, 2.0\] .* 3 numbers',
    ('--junk', '3'): '--junk',
    ('--', '--pitch', '10'): '--pitch 10',
}
FILES = {
    'misspelt.yaml': {'wind': {'x': 1.0, 'gusts': 3.0}},
    'wrong_type.yaml': {'imu': {'offset': [1.0, 2.0]}},
}


def test_wrong_arguments_end_it_with_one_line_before_it_publishes(ros, tmp_path):
    for name, values in FILES.items():
        (tmp_path / name).write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}))
    heard = ros.listen(Odometry, 'odom'), ros.listen(DiagnosticArray, '/diagnostics')
    waiting = list(WRONG.items())
    running: dict[subprocess.Popen, str] = {}
    while waiting or running:
        while waiting and len(running) < 3:
            arguments, why = waiting.pop()
            command = [sys.executable, '-m', 'disc_sim_ros.nodes.sim_node', '--ros-args']
            process = subprocess.Popen(
                [*command, *arguments], cwd=tmp_path, stderr=subprocess.PIPE, text=True
            )
            running[process] = why
        ros.spin_until(lambda: any(p.poll() is not None for p in running), 'an end')
        for process in [p for p in running if p.poll() is not None]:
            error, why = process.stderr.read(), running.pop(process)
            process.stderr.close()
            assert re.fullmatch(f'sim_node: error: .*{why}.*\n', error), error
            assert process.returncode == 2, error
    assert not any(heard)


def catches_sigterm(pid: int) -> bool:
    """Say whether a process has a handler of its own for SIGTERM."""
    caught = re.search(r'SigCgt:\s+([0-9a-f]+)', Path(f'/proc/{pid}/status').read_text())
    return bool(int(caught[1], 16) >> (signal.SIGTERM - 1) & 1)


def test_a_signal_ends_it_quietly_whatever_it_does(ros):
    """In flight, twice, while time stands still, with a service call pending."""
    states = {'/flying': {}, '/twice': {}, '/paused': {}, '/asked': {'real_time_factor': 0.001}}
    sims = {space: ros.start(LONG | more, namespace=space) for space, more in states.items()}
    for sim in sims.values():
        throw(ros, sim, 1)
    ros.pause(sims['/paused'])
    ros._client(sims['/asked'], 'throw', Trigger).call_async(Trigger.Request())
    signals = {
        '/flying': [signal.SIGINT],
        '/twice': [signal.SIGINT, signal.SIGTERM, signal.SIGINT],
        '/paused': [signal.SIGTERM],
        '/asked': [signal.SIGTERM],
    }
    begun = time.monotonic()
    for space, sim in sims.items():
        for number in signals[space]:
            sim.process.send_signal(number)
    for space, sim in sims.items():
        assert sim.wait() == 0, f'{space} {sim.stderr}'
        assert not re.search('Traceback|[Ee]rror', sim.stderr), f'{space} {sim.stderr}'
    assert time.monotonic() - begun < patience(2.0)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('when', ['loading', 'compiling'])
def test_a_signal_ends_it_quietly_while_it_starts(ros_environment, tmp_path, number, when):
    environment = os.environ | {'NUMBA_CACHE_DIR': str(tmp_path)}
    stderr = tmp_path / 'stderr'
    with stderr.open('wb') as file:
        command = [sys.executable, '-c', 'from disc_sim_ros.cli.sim_node import main; main()']
        process = subprocess.Popen(command, env=environment, stderr=file)
    end = time.monotonic() + 20.0
    ready = {
        'loading': lambda: catches_sigterm(process.pid),
        'compiling': lambda: 'compiling' in stderr.read_text(),
    }[when]
    while not ready():
        assert time.monotonic() < end
        assert process.poll() is None
    begun = time.monotonic()
    process.send_signal(number)
    process.send_signal(number)
    assert process.wait(DEADLINE) == 0
    assert time.monotonic() - begun < patience(2.0)
    assert 'Traceback' not in stderr.read_text()


# ---- keeping up ----


def test_diagnostics_tell_once_a_second_how_it_keeps_up(ros):
    sim = ros.start(LONG)
    arrays = ros.listen(DiagnosticArray, '/diagnostics')
    arrived = []
    ros.node.create_subscription(
        DiagnosticArray, '/diagnostics', lambda _: arrived.append(time.monotonic()), 10
    )
    odom = ros.listen(Odometry, 'odom', raw=True)
    fly_until(ros, odom, 0)
    throw(ros, sim, 1)
    ros.spin_until(lambda: len(arrived) >= 3, 'three times')
    assert np.diff(arrived).mean() == pytest.approx(1.0, abs=patience(0.1))
    (status,) = arrays[-1].status
    values = diagnostics_of(arrays)
    assert float(values['real_time_factor']) == pytest.approx(1.0, abs=patience(0.1))
    assert 0.0 < float(values['worst_lateness_s']) < patience(0.1)
    assert int(values['missed_deadlines']) >= 0
    assert (values['paused'], values['throws'], values['dropped_commands']) == ('False', '1', '0')
    assert status.name == 'sim_node: simulation'
    assert status.hardware_id == 'disc'

    def stall(seconds: float) -> tuple[float, dict[str, str]]:
        """Stop the process; return for how long, and what /diagnostics says afterwards."""
        begun = time.monotonic()
        sim.process.send_signal(signal.SIGSTOP)
        ros.spin_until(wall(seconds))
        sim.process.send_signal(signal.SIGCONT)
        took = time.monotonic() - begun
        count, worst = len(arrays), []

        def told_since() -> bool:
            worst.extend(
                float(p.value)
                for a in arrays[count + len(worst) :]
                for p in a.status[0].values
                if p.key == 'worst_lateness_s'
            )
            return len(worst) >= 2

        ros.spin_until(told_since, 'diagnostics')
        return took, diagnostics_of(arrays) | {'worst': max(worst)}

    slips = int(values['slips'])
    took, values = stall(0.5)
    assert int(values['slips']) > slips
    assert float(values['slipped_s']) >= took - 0.1 - 0.05
    assert values['worst'] >= took - 0.05
    assert 'fallen' in sim.stderr
    for _ in range(10):  # a busy machine makes a short stall a long one
        slips = values['slips']
        took, values = stall(0.05)
        if values['worst'] < 0.1:
            break
    assert values['worst'] >= 0.04
    assert values['slips'] == slips
    fly_until(ros, odom, ns(odom[-1]) + SECOND / 10)
    assert set(np.diff([ns(m) for m in odom])) == {PERIOD}


# ---- who listens ----


def test_what_nobody_hears_is_neither_made_nor_sent(ros, ros_context):
    """The node in this process, its channels counted."""
    sim = SimNode(
        context=ros_context,
        parameter_overrides=[Parameter(name, value=x) for name, x in LONG.items()],
    )
    out = sim.loop._outputs
    motion = {
        'odom': (Odometry, out.odom),
        'pose': (PoseStamped, out.pose),
        'transform': (TransformStamped, out.transform),
        'imu': (Imu, out.imu),
        'aero_wrench': (WrenchStamped, out.aero_wrench),
        'path': (PathMessage, out.path),
        **{
            name: (Float64, channel)
            for name, channel in zip(Quantities._fields, out.quantities, strict=True)
        },
    }
    sent = Counter()
    for name, (_, channel) in motion.items():

        def count(data, name=name, publish=channel._publish):
            sent[name] += 1
            publish(data)

        channel._publish = count
    ros._executor.add_node(sim)
    sim.start()
    try:
        sim.loop.submit(sim.loop.throw).result(DEADLINE)
        ros.spin_until(lambda: sim.loop.timeline.now > SECOND / 2, 'half a second')
        assert not sent
        for name, (kind, channel) in motion.items():
            sent.clear()
            heard = []
            subscription = ros.node.create_subscription(kind, name, heard.append, 10)
            ros.spin_until(lambda heard=heard: len(heard) > 1, name)
            assert set(sent) == {name}
            ros.node.destroy_subscription(subscription)
            ros.spin_until(lambda channel=channel: not channel.heard, f'nobody hears {name}')
    finally:
        sim.stop()
        ros._executor.remove_node(sim)
        sim.destroy_node()


def test_who_comes_late_sees_the_disc_and_its_path(ros):
    sim = ros.start(LONG | {'auto_throw': True, 'real_time_factor': 5.0})
    odom = ros.listen(Odometry, 'odom')
    ros.spin_until(lambda: len(odom) > 100, 'odom')
    latched = {
        kind: ros.listen(kind, name, qos=topics.LATCHED_QOS)
        for name, kind in (('configuration', String), ('markers', MarkerArray))
    }
    releases = ros.listen(Odometry, 'release', qos=topics.LATCHED_QOS)
    paths = ros.listen(PathMessage, 'path')
    transforms = ros.listen(TransformStamped, 'transform')
    ros.spin_until(
        lambda: releases and all(latched.values()) and len(paths) > 3 and len(transforms) > 8,
        'all of them',
    )
    assert yaml.safe_load(latched[String][0].data)['flight'] == 1
    assert stamp(releases[0]) == 0
    (marker,) = latched[MarkerArray][0].markers
    assert (marker.type, marker.action) == (Marker.TRIANGLE_LIST, Marker.ADD)
    assert marker.frame_locked
    assert marker.header.frame_id == 'disc_body'
    assert stamp(marker) == 0  # the newest transform, not that of one time
    assert len(marker.points) == len(marker.colors) > 0
    assert len(marker.points) % 3 == 0
    assert len({(c.r, c.g, c.b) for c in marker.colors}) >= 3  # so that the spin can be seen
    assert max(math.hypot(p.x, p.y) for p in marker.points) == pytest.approx(0.1375)

    pairs = {(m.header.frame_id, m.child_frame_id): stamp(m) for m in transforms}
    assert set(pairs) == {('map', 'disc'), ('disc', 'disc_body')}
    times = Counter(stamp(m) for m in transforms)
    assert {times[t] for t in sorted(times)[1:-1]} == {2}

    lengths = [len(path.poses) for path in paths]
    assert set(np.diff(lengths)) == {1}
    assert {stamp(paths[-1].poses[0]), stamp(paths[-1].poses[-1])} == {0, stamp(paths[-1])}
    spacing = np.diff([stamp(pose) for pose in paths[-1].poses])
    assert set(spacing) == {SECOND // 20}
    assert {pose.header.frame_id for pose in paths[-1].poses} == {'map'}
    release = throw(ros, sim, 2)
    ros.spin_until(lambda: stamp(paths[-1]) > release, 'the new path')
    assert stamp(paths[-1].poses[0]) == release
    ros.spin_until(lambda: len(releases) == len(latched[String]) == 2, 'the second throw')
    assert len(latched[MarkerArray]) == 2
