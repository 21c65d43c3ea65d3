"""sim_node in its own process: services, parameters, simulated time."""

import math
import re
import sys
import time

import numpy as np
import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterType
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger
import yaml

from disc_sim_ros.ros import qos
from disc_sim_ros.ros.sim.parameters import TABLE
from ros.sim.sim_messages import (
    AT_LAUNCH,
    LONG,
    PERIOD,
    SECOND,
    accepted,
    fly_until,
    names,
    ns,
    patience,
    release_of,
    since,
    stamp,
    throw,
    time_in,
    time_of,
    wall,
)

pytestmark = pytest.mark.ros
ENDED = 'ended in the air'


# ---- pause, step, reset, throw ----


def test_services_work_in_any_order(ros):
    sim = ros.start(AT_LAUNCH | {'launch.height': 20.0})
    events = ros.subscribe(DiagnosticStatus, 'flight_events')
    odom = ros.subscribe(Odometry, 'odom', raw=True)
    fly_until(ros, odom, 0)

    refused = ros.call(sim, 'step')
    assert not refused.success
    assert '~/pause' in refused.message
    assert ros.call(sim, 'reset').success  # before any throw
    release = throw(ros, sim, 1)
    fly_until(ros, odom, release + 0.1 * SECOND)

    now = time_in(ros.call(sim, 'pause', SetBool, data=True), 'paused at TIME')
    assert time_in(ros.call(sim, 'pause', SetBool, data=True), 'paused at TIME') == now
    for _ in range(2):
        now += PERIOD
        assert time_in(ros.call(sim, 'step'), 'stepped to TIME') == now
    fly_until(ros, odom, now)
    assert list(since(odom, release)) == list(range(0, now - release + 1, PERIOD))

    def shown(height: float, speed: float) -> bool:
        newest = deserialize_message(odom[-1], Odometry)
        linear = newest.twist.twist.linear
        moving = math.hypot(linear.x, linear.y, linear.z)
        return newest.pose.pose.position.z == height and moving == pytest.approx(speed)

    assert throw(ros, sim, 2, replaced=1) == now  # also while paused
    ros.spin_until(lambda: ns(odom[-1]) == now and shown(20.0, 15.0), 'the second release')
    for _ in range(2):
        assert ros.call(sim, 'reset').success
    ros.spin_until(lambda: shown(20.0, 0.0), 'the disc at rest')
    assert ns(odom[-1]) == now

    flights = []
    for _ in range(2):  # a reset repeats the first flight
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


def test_a_throw_message_replaces_the_flight(ros):
    sim = ros.start(LONG)
    events = ros.subscribe(DiagnosticStatus, 'flight_events')
    releases = ros.subscribe(Odometry, 'release', qos=qos.LATCHED_QOS)
    diagnostics = ros.subscribe(DiagnosticArray, '/diagnostics')
    odom = ros.subscribe(Odometry, 'odom')
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
    assert [m.pose for m in at_release] == [releases[1].pose]  # published, and at a message

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
    ros.resume(sim)
    ros.spin_until(lambda: len(releases) == 4, 'a fourth')
    assert releases[3].header.stamp == later.header.stamp
    ros.spin_until(lambda: names(events) == ['thrown'] * 4, 'four events')
    # Each throw but the first says that it ended the flight before, in the log as well.
    said = [event.message.partition('; ')[2] for event in events]
    assert said == ['', *(f'flight {n} {ENDED}' for n in (1, 2, 3))]
    replaced = [{v.key: v.value for v in e.values}.get('replaced_flight') for e in events]
    assert replaced == [None, '1', '2', '3']
    line = re.compile(r'flight (\d) thrown: [^;\n]*(?:; (.*))?\n')
    lines = [(str(n), text) for n, text in enumerate(said, start=1)]
    ros.spin_until(lambda: line.findall(sim.stderr) == lines, 'the log')


def test_a_throw_after_a_landing_or_a_reset_replaces_nothing(ros):
    sim = ros.start(AT_LAUNCH | {'launch.height': 2.0, 'real_time_factor': 5.0})
    events = ros.subscribe(DiagnosticStatus, 'flight_events')
    throw(ros, sim, 1)
    ros.spin_until(lambda: names(events) == ['thrown', 'landed'], 'the landing')
    throw(ros, sim, 2)
    assert ros.call(sim, 'reset').success
    throw(ros, sim, 1)
    ros.spin_until(lambda: names(events).count('landed') == 2, 'the last landing')
    assert not any('in the air' in event.message for event in events)


def test_fifty_throws_a_second_are_all_answered(ros):
    """Stamps stay evenly spaced, each release is at a message, and the pace is kept."""
    sim = ros.start(LONG)
    releases = ros.subscribe(Odometry, 'release', qos=qos.LATCHED_QOS)
    odom = ros.subscribe(Odometry, 'odom', raw=True)
    client = ros._client(sim, 'throw', Trigger)
    ros._reach(sim)
    ros.spin_until(lambda: odom, 'odom')
    begin, first = time.monotonic(), ns(odom[-1])
    responses = []
    while len(responses) < 100:
        pending = [client.call_async(Trigger.Request()) for _ in range(5)]
        ros.spin_until(lambda: all(f.done() for f in pending), 'answers')  # noqa: B023
        responses += [future.result() for future in pending]
    duration = time.monotonic() - begin
    assert duration < patience(2.0)
    released = [
        time_in(response, f'flight {i}, released at TIME{f"; flight {i - 1} {ENDED}" * (i > 1)}')
        for i, response in enumerate(responses, start=1)
    ]
    fly_until(ros, odom, released[-1] + PERIOD)
    stamps = [ns(m) for m in odom]
    assert set(np.diff(stamps)) == {PERIOD}
    assert set(released) <= set(stamps)
    assert released[-1] - first == pytest.approx(duration * SECOND, abs=patience(0.2) * SECOND)
    assert {stamp(m) for m in releases} <= set(released)


@pytest.mark.parametrize(
    ('slow', 'flown'), [({'publish_rate': 0.1}, 20), ({'real_time_factor': 1e-6}, 2)]
)
def test_services_do_not_wait_for_a_message_that_is_due_in_minutes(ros, slow, flown):
    sim = ros.start(LONG | slow)
    odom = ros.subscribe(Odometry, 'odom', raw=True)
    ros.spin_until(lambda: ros.call(sim, 'reset').success and odom, 'odom')
    begin = time.monotonic()
    ros.pause(sim)
    ros.resume(sim)
    release = throw(ros, sim, 1)
    ros.spin_until(lambda: ns(odom[-1]) == release, 'the release')
    assert ros.set(sim, {'real_time_factor': 1000.0}).successful
    fly_until(ros, odom, release + flown * SECOND)
    assert time.monotonic() - begin < patience(5.0)  # the message is due in 10 s or more


# ---- parameters ----


def response_of(ros, future):
    ros.spin_until(future.done, 'an answer')
    return future.result()


def all_values(ros, client) -> dict[str, object]:
    """Return what `ros2 param dump` shows."""
    listed = list(response_of(ros, client.list_parameters()).result.names)
    messages = response_of(ros, client.get_parameters(listed)).values
    values = zip(listed, map(parameter_value_to_python, messages), strict=True)
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

    described = response_of(ros, client.describe_parameters([entry.name for entry in TABLE]))
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
        ('launch.speed', 20.0, 'launch.pitch', 'steep'): 'parameter type, expected',
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

    # Not atomically, each is checked by itself.
    changes = [Parameter('launch.speed', value=20), Parameter('launch.pitch', value=181.0)]
    results = response_of(ros, client.set_parameters(changes)).results
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
    winds = ros.subscribe(Vector3Stamped, 'applied_wind')
    configurations = ros.subscribe(String, 'configuration', qos=qos.LATCHED_QOS)
    odom = ros.subscribe(Odometry, 'odom', raw=True)
    twin_odom = ros.subscribe(Odometry, '/twin/odom', raw=True)
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
    change = stamp(winds[-1])
    assert change <= time_of(ros, sim)[0]
    fly_until(ros, odom, change + 0.2 * SECOND)
    flown = since(odom, release)
    fly_until(ros, twin_odom, twin_release + max(flown))
    calm = since(twin_odom, twin_release)
    assert all(flown[t] == calm[t] for t in flown if t <= change - release)
    assert all(flown[t] != calm[t] for t in flown if t > change - release)

    release = throw(ros, sim, 2, replaced=1)
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
        (first, begin), _, (last, end) = (
            time_of(ros, sim),
            ros.spin_until(wall(0.4)),
            time_of(ros, sim),
        )
        assert (last - first) / SECOND / (end - begin) == pytest.approx(factor, rel=0.5)


# ---- time ----


def test_nodes_with_use_sim_time_follow_the_clock(ros, ros_context):
    """The simulator may have use_sim_time, too: it must not wait for its own clock."""
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
    begin, first = time.monotonic(), clock.now().nanoseconds
    ros.spin_until(lambda: clock.now().nanoseconds >= first + 5 * SECOND, '5 s')
    assert time.monotonic() - begin == pytest.approx(1.0, abs=patience(0.3))
    assert len(ticks) == pytest.approx(50, abs=25)  # rclpy skips ticks that it is late for
    assert SECOND / 10 in np.diff(ticks)

    now = time_in(ros.call(sim, 'pause', SetBool, data=True), 'paused at TIME')
    ros.spin_until(lambda: clock.now().nanoseconds == now, 'the time of the pause')
    count = len(ticks)
    ros.spin_until(wall(0.5))
    assert clock.now().nanoseconds == now
    assert len(ticks) - count <= 1
    assert time_in(ros.call(sim, 'step'), 'stepped to TIME') == now + PERIOD
    ros.spin_until(lambda: clock.now().nanoseconds == now + PERIOD, 'the step')
    ros.resume(sim)
    ros.spin_until(lambda: len(ticks) > count + 5, 'time to go on')
    ros._executor.remove_node(follower)
    follower.destroy_node()


def test_the_clock_is_published_at_its_own_rate(ros):
    """100 to 200 Hz of wall time, whatever the publish rate, also while paused."""
    clocks = {}
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
        clocks[name] = ros.subscribe(Clock, f'{name}_clock', raw=True)
    ros.pause(ros.sims[-1])
    ros.spin_until(lambda: all(clocks.values()), 'the clocks')
    measured = []
    for _ in range(6):  # a machine under load holds messages back, or delivers many at once
        ros.forget()
        begin = time.monotonic()
        ros.spin_until(wall(1.5))
        duration = time.monotonic() - begin
        for name, ticks in clocks.items():
            stamps = [ns(cdr) for cdr in ticks]
            assert (len(set(stamps)) == 1) if name == 'usual' else all(np.diff(stamps) > 0)
        measured.append({name: len(ticks) / duration for name, ticks in clocks.items()})
        if all(40 < rate < 215 for rate in measured[-1].values()):
            break
        sys.stderr.write(f'measured again, because the rates were {measured[-1]}\n')
    else:
        pytest.fail(f'no 1.5 s with 40 to 215 messages a second: {measured}')
