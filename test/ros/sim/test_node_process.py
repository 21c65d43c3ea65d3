"""sim_node as a process: start, end, pace, and what it publishes to which subscribers."""

from collections import Counter
import math
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TransformStamped, WrenchStamped
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMessage
from rclpy.parameter import Parameter
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker, MarkerArray
import yaml

from disc_sim_ros.ros import qos
from disc_sim_ros.ros.messages import Quantities
from disc_sim_ros.ros.sim.node import SimNode
from forked import Forked
from ros.sim.sim_messages import (
    LONG,
    PERIOD,
    SECOND,
    diagnostics_of,
    fly_until,
    ns,
    patience,
    stamp,
    throw,
    wall,
)
from ros.sim_process import DEADLINE

pytestmark = pytest.mark.ros


# ---- start and end ----


WRONG = {  # arguments, a pattern of the error line
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


def test_wrong_arguments_end_it_with_one_line_before_it_publishes(ros, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, values in FILES.items():
        (tmp_path / name).write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}))
    published = ros.subscribe(Odometry, 'odom'), ros.subscribe(DiagnosticArray, '/diagnostics')
    waiting = list(WRONG.items())
    running: dict[Forked, tuple[Path, str]] = {}
    while waiting or running:
        while waiting and len(running) < 3:
            arguments, pattern = waiting.pop()
            output, errors = (tmp_path / f'{len(waiting)}.{name}' for name in ('out', 'err'))
            output.touch()
            errors.touch()
            words = ['--ros-args', *arguments]
            running[Forked('disc_sim_ros.ros.sim', words, output, errors=errors)] = errors, pattern
        ros.spin_until(lambda: any(p.poll() is not None for p in running), 'an end')
        for process in [p for p in running if p.poll() is not None]:
            errors, pattern = running.pop(process)
            error = errors.read_text()
            assert re.fullmatch(f'sim_node: error: .*{pattern}.*\n', error), error
            assert process.returncode == 2, error
    assert not any(published)


def catches_sigterm(pid: int) -> bool:
    """Return True if a process has a handler of its own for SIGTERM."""
    caught = re.search(r'SigCgt:\s+([0-9a-f]+)', Path(f'/proc/{pid}/status').read_text())
    return bool(int(caught[1], 16) >> (signal.SIGTERM - 1) & 1)


def test_a_signal_ends_it_quietly_whatever_it_does(ros):
    """In flight, twice, while paused, with a service call pending."""
    states = {'/flying': {}, '/twice': {}, '/paused': {}, '/called': {'real_time_factor': 0.001}}
    sims = {space: ros.start(LONG | more, namespace=space) for space, more in states.items()}
    for sim in sims.values():
        throw(ros, sim, 1)
    ros.pause(sims['/paused'])
    ros._client(sims['/called'], 'throw', Trigger).call_async(Trigger.Request())
    signals = {
        '/flying': [signal.SIGINT],
        '/twice': [signal.SIGINT, signal.SIGTERM, signal.SIGINT],
        '/paused': [signal.SIGHUP],
        '/called': [signal.SIGTERM],
    }
    begin = time.monotonic()
    for space, sim in sims.items():
        for number in signals[space]:
            sim.process.send_signal(number)
    for space, sim in sims.items():
        assert sim.wait() == 0, f'{space} {sim.stderr}'
        assert not re.search('Traceback|[Ee]rror', sim.stderr), f'{space} {sim.stderr}'
    assert time.monotonic() - begin < patience(2.0)


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
    begin = time.monotonic()
    process.send_signal(number)
    process.send_signal(number)
    assert process.wait(DEADLINE) == 0
    assert time.monotonic() - begin < patience(2.0)
    assert 'Traceback' not in stderr.read_text()


# ---- pace ----


def test_diagnostics_report_once_a_second_how_it_keeps_pace(ros):
    sim = ros.start(LONG)
    arrays = ros.subscribe(DiagnosticArray, '/diagnostics')
    arrived = []
    ros.node.create_subscription(
        DiagnosticArray, '/diagnostics', lambda _: arrived.append(time.monotonic()), 10
    )
    odom = ros.subscribe(Odometry, 'odom', raw=True)
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
        """Stop the process; return for how long [s], and the values of /diagnostics afterwards."""
        begin = time.monotonic()
        sim.process.send_signal(signal.SIGSTOP)
        ros.spin_until(wall(seconds))
        sim.process.send_signal(signal.SIGCONT)
        duration = time.monotonic() - begin
        count, worst = len(arrays), []

        def reported_twice() -> bool:
            worst.extend(
                float(p.value)
                for a in arrays[count + len(worst) :]
                for p in a.status[0].values
                if p.key == 'worst_lateness_s'
            )
            return len(worst) >= 2

        ros.spin_until(reported_twice, 'diagnostics')
        return duration, diagnostics_of(arrays) | {'worst': max(worst)}

    slips = int(values['slips'])
    duration, values = stall(0.5)
    assert int(values['slips']) > slips
    assert float(values['slipped_s']) >= duration - 0.1 - 0.05
    assert values['worst'] >= duration - 0.05
    assert 'behind the wall clock' in sim.stderr
    for _ in range(10):  # a busy machine makes a short stall a long one
        slips = values['slips']
        duration, values = stall(0.05)
        if values['worst'] < 0.1:
            break
    assert values['worst'] >= 0.04
    assert values['slips'] == slips
    fly_until(ros, odom, ns(odom[-1]) + SECOND / 10)
    assert set(np.diff([ns(m) for m in odom])) == {PERIOD}


# ---- subscribers ----


def test_messages_without_subscribers_are_neither_built_nor_published(ros, ros_context):
    """The node runs in this process; what its two loops publish is counted."""
    sim = SimNode(
        context=ros_context,
        parameter_overrides=[Parameter(name, value=x) for name, x in LONG.items()],
    )
    out = sim.loop._publishers
    motion = {
        'odom': (Odometry, out.odom),
        'pose': (PoseStamped, out.pose),
        'transform': (TransformStamped, out.transform),
        'imu': (Imu, out.imu),
        'aero_wrench': (WrenchStamped, out.aero_wrench),
        'path': (PathMessage, out.path),
        **{
            name: (Float64, sink)
            for name, sink in zip(Quantities._fields, out.quantities, strict=True)
        },
    }
    published = Counter()
    for name, (_, sink) in motion.items():

        def count(data, name=name, publish=sink._publish):
            published[name] += 1
            publish(data)

        sink._publish = count
    compiled = sim.loop._compiled

    def all_published():
        if compiled is not None:
            rows = zip(compiled._messages, compiled._wanted, strict=True)
            published.update(m.sink.publisher.topic.lstrip('/') for m, wanted in rows if wanted)
        return set(published)

    ros._executor.add_node(sim)
    sim.start()
    try:
        sim.loop.submit(sim.loop.throw).result(DEADLINE)
        ros.spin_until(lambda: sim.loop.clock.now > SECOND / 2, 'half a second')
        assert not all_published()
        for name, (message_type, sink) in motion.items():
            published.clear()
            received = []
            subscription = ros.node.create_subscription(message_type, name, received.append, 10)
            ros.spin_until(lambda received=received: len(received) > 1, name)
            assert all_published() == {name}
            ros.node.destroy_subscription(subscription)
            ros.spin_until(lambda sink=sink: not sink.has_subscribers, f'the end of {name}')
    finally:
        sim.stop()
        ros._executor.remove_node(sim)
        sim.destroy_node()


def test_a_late_subscriber_gets_the_disc_and_its_path(ros):
    sim = ros.start(LONG | {'auto_throw': True, 'real_time_factor': 5.0})
    odom = ros.subscribe(Odometry, 'odom')
    ros.spin_until(lambda: len(odom) > 100, 'odom')
    latched = {
        message_type: ros.subscribe(message_type, name, qos=qos.LATCHED_QOS)
        for name, message_type in (('configuration', String), ('markers', MarkerArray))
    }
    releases = ros.subscribe(Odometry, 'release', qos=qos.LATCHED_QOS)
    paths = ros.subscribe(PathMessage, 'path')
    transforms = ros.subscribe(TransformStamped, 'transform')
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
    release = throw(ros, sim, 2, replaced=1)
    ros.spin_until(lambda: stamp(paths[-1]) > release, 'the new path')
    assert stamp(paths[-1].poses[0]) == release
    ros.spin_until(lambda: len(releases) == len(latched[String]) == 2, 'the second throw')
    assert len(latched[MarkerArray]) == 2
