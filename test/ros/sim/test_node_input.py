"""sim_node in its own process: neither other nodes nor bad input disturb it."""

from collections import Counter
import copy
import math
from pathlib import Path
import re
import time

import numpy as np
import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message

from disc_sim_ros.ros.cdr_template import assign
from disc_sim_ros.ros.sim.commands import MOST_WAITING
from ros.sim.sim_messages import (
    LONG,
    PERIOD,
    SECOND,
    accepted,
    diagnostics_of,
    fly_until,
    ns,
    release_of,
    since,
    stamp,
    throw,
)

pytestmark = pytest.mark.ros


# ---- more than one ----


def test_discs_side_by_side_do_not_mix(ros):
    red = ros.start(LONG | {'frame_prefix': 'red/', 'launch.speed': 10.0}, namespace='/red')
    blue = ros.start(LONG | {'frame_prefix': 'blue/', 'launch.speed': 20.0}, namespace='/blue')
    other = ros.start(LONG, '-r', 'odom:=/other/odom', '-r', '__node:=third')
    other.name = '/third'
    received = {
        sim: {
            Odometry: ros.subscribe(Odometry, odom),
            TransformStamped: ros.subscribe(TransformStamped, transform),
            WrenchStamped: ros.subscribe(WrenchStamped, moment),
        }
        for sim, odom, transform, moment in (
            (red, '/red/odom', '/red/transform', '/red/applied_moment'),
            (blue, '/blue/odom', '/blue/transform', '/blue/applied_moment'),
            (other, '/other/odom', '/transform', '/applied_moment'),
        )
    }
    diagnostics = ros.subscribe(DiagnosticArray, '/diagnostics')
    torque = ros.publisher(WrenchStamped, '/red/cmd_moment')
    ros.spin_until(
        lambda: all(sum(map(len, topics.values())) > 1 for topics in received.values()), 'odom'
    )
    for sim in received:
        throw(ros, sim, 1)
    command = WrenchStamped()
    command.header.frame_id = 'red/disc'
    command.wrench.torque.x = 0.001
    torque.publish(command)
    ros.spin_until(lambda: received[red][WrenchStamped], 'the moment')

    def all_fly() -> bool:
        return all(
            any(m.twist.twist.linear.x > 0.0 for m in topics[Odometry])
            for topics in received.values()
        )

    ros.spin_until(all_fly, 'all three in the air')
    ros.spin_until(lambda: len({a.status[0].name for a in diagnostics}) == 3, 'diagnostics')
    for sim, speed, prefix in ((red, 10.0, 'red/'), (blue, 20.0, 'blue/'), (other, 15.0, '')):
        odom = received[sim][Odometry]
        assert {(m.header.frame_id, m.child_frame_id) for m in odom} == {('map', f'{prefix}disc')}
        fastest = max(m.twist.twist.linear.x for m in odom)
        assert fastest == pytest.approx(speed, rel=0.01)
        frames = {(m.header.frame_id, m.child_frame_id) for m in received[sim][TransformStamped]}
        assert frames == {('map', f'{prefix}disc'), (f'{prefix}disc', f'{prefix}disc_body')}
        assert set(np.diff([stamp(m) for m in odom])) == {PERIOD}
    assert not received[blue][WrenchStamped]
    assert not received[other][WrenchStamped]
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
BAD = {  # for each topic, messages and patterns of the reason why they are dropped
    'cmd_moment': [
        (bad(TORQUE, wrench__torque__x=math.nan), 'torque.x: nan'),
        (bad(TORQUE, wrench__torque__y=-math.inf), 'torque.y: -inf'),
        (bad(TORQUE, wrench__torque__z=1e300), 'torque.z: 1e.300 .* N m'),
        (bad(TORQUE, wrench__force__x=1e-9), 'force.x: 1e-09 .* torques, not forces'),
        (bad(TORQUE, wrench__force__z=math.nan), 'force.z: nan .* torques, not forces'),
        (bad(TORQUE, header__frame_id='base_link'), "frame_id: 'base_link' .* disc_air"),
        (bad(TORQUE, header__stamp__nanosec=4_000_000_000), 'nanosec: 4000000000 .* 1000000000'),
        (bad(TORQUE, header__stamp__nanosec=1_000_000_000), 'nanosec: 1000000000 .* 1000000000'),
        (bad(TORQUE, header__stamp__sec=2_145_916_800), 'sec: 2145916800 .* 2038'),
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
    """The flight is bit for bit that of a simulator without commands; three share the commands."""
    spaces = ('/a', '/b', '/c')
    for space in (*spaces, '/alone'):
        ros.start(LONG | {'real_time_factor': 2.0, 'publish_rate': 50.0}, namespace=space)
    diagnostics = ros.subscribe(DiagnosticArray, '/diagnostics')
    odom = {s: ros.subscribe(Odometry, f'{s}/odom', raw=True) for s in (*spaces, '/alone')}
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
    begin, sent = time.monotonic(), Counter()
    while any(todo.values()):
        expected = {}
        for space in spaces:
            for topic, messages in todo.items():
                if messages:
                    message, expected[space, topic] = messages.pop(0)
                    publishers[space, topic].publish(message)
                    sent[space, topic] += 1

        def is_reported(space: str, topic: str, why: str) -> bool:
            values = newest(space)
            return values.get(f'{topic} dropped') == str(sent[space, topic]) and bool(
                re.search(why, values[f'{topic} last reason'])
            )

        ros.spin_until(
            lambda: all(is_reported(*key, why) for key, why in expected.items()),  # noqa: B023
            f'dropped: {expected}',
        )
    duration = time.monotonic() - begin

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
        # One per second and topic.
        at_most = 0 if sim.name.startswith('/alone') else len(BAD) * (duration + 2)
        assert bool(at_most) <= len(warnings) <= at_most
        assert not re.search('Traceback|Error', sim.stderr)


def memory(sim) -> int:
    """Return the resident memory of a simulator [bytes]."""
    status = Path(f'/proc/{sim.process.pid}/status').read_text()
    return int(re.search(r'VmRSS:\s+(\d+) kB', status)[1]) * 1024


def test_a_flood_of_commands_breaks_neither_pace_nor_memory(ros):
    sim = ros.start(LONG)
    applied = ros.subscribe(WrenchStamped, 'applied_moment')
    diagnostics = ros.subscribe(DiagnosticArray, '/diagnostics')
    odom = ros.subscribe(Odometry, 'odom', raw=True)
    torque = ros.publisher(WrenchStamped, 'cmd_moment')
    fly_until(ros, odom, 0)
    throw(ros, sim, 1)
    ros.spin_until(lambda: diagnostics, 'diagnostics')
    before, count, begin = memory(sim), len(diagnostics), time.monotonic()
    message = serialize_message(WrenchStamped())
    sent, due = 0, begin
    while due < begin + 1.0:
        for _ in range(100):
            torque.publish(message)
        sent, due = sent + 100, due + 0.005
        ros.spin_until(lambda: time.monotonic() >= min(due, begin + 1.0))  # noqa: B023
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


def test_commands_for_the_future_are_limited_in_number_and_those_for_now_are_not(ros):
    """Of those for now only the newest waits, also while paused."""
    sim = ros.start(LONG)
    diagnostics = ros.subscribe(DiagnosticArray, '/diagnostics')
    applied = ros.subscribe(WrenchStamped, 'applied_moment')
    odom = ros.subscribe(Odometry, 'odom', raw=True)
    torque = ros.publisher(WrenchStamped, 'cmd_moment')
    coefficients = ros.publisher(Vector3Stamped, 'cmd_coefficients')
    fly_until(ros, odom, 0)
    throw(ros, sim, 1)
    ros.pause(sim)

    now, future = WrenchStamped(), Vector3Stamped()
    future.header.stamp.sec = 1_000_000
    sent, batch = 0, 50  # the subscription keeps 100
    while sent < MOST_WAITING + batch:
        for _ in range(batch):
            sent += 1
            now.wrench.torque.x = 1e-6 * sent
            torque.publish(now)
            coefficients.publish(future)
        before = ns(odom[-1])  # the topics are polled at a step
        ros.call(sim, 'step')
        fly_until(ros, odom, before + 1)

    def taken() -> bool:
        values = diagnostics_of(diagnostics)
        kinds = ('accepted', 'waiting', 'dropped')
        return sum(int(values.get(f'cmd_coefficients {kind}', 0)) for kind in kinds) == sent

    ros.spin_until(taken, 'all taken')
    values = diagnostics_of(diagnostics)
    assert values['cmd_coefficients dropped'] == str(batch)
    assert values['cmd_coefficients accepted'] == '0'
    assert values['cmd_coefficients waiting'] == str(MOST_WAITING)
    assert 999_900 < float(values['cmd_coefficients furthest lead_s']) < 1_000_000
    assert 'cmd_coefficients waits 9999' in diagnostics[-1].status[0].message
    assert sim.stderr.count('is the sender on use_sim_time?') == 1
    assert f'{MOST_WAITING} commands at most' in values['cmd_coefficients last reason']
    assert f'cmd_coefficients dropped: {values["cmd_coefficients last reason"]}' in sim.stderr
    assert (values['cmd_moment accepted'], values['cmd_moment dropped']) == (str(sent), '0')
    applied.clear()

    # A controller goes on while the simulator is paused; then its newest command acts.
    for _ in range(0, MOST_WAITING + batch, batch):
        for _ in range(batch):
            sent += 1
            now.wrench.torque.x = 1e-6 * sent
            torque.publish(now)
        ros.pause(sim)  # a round trip, during which the topic is polled
    ros.spin_until(lambda: accepted(diagnostics, 'cmd_moment') == sent, 'all taken')
    assert diagnostics_of(diagnostics)['cmd_moment dropped'] == '0'
    assert not applied
    ros.resume(sim)
    ros.spin_until(lambda: applied, 'a moment')
    assert applied[0].wrench.torque.x == now.wrench.torque.x
