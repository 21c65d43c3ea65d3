"""policy_node: in lockstep the disc of a real simulator flies the path of the environment."""

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('gymnasium')

from nav_msgs.msg import Odometry

from disc_sim_ros import topics
from disc_sim_ros.envs.policy import trained_policy
from disc_sim_ros.envs.steer import SteerEnv
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import frames
from disc_sim_ros.ros.policy.node import _read
from disc_sim_ros.ros.policy.options import policy_config
from forked import start
from ros.sim.sim_messages import wall
from ros.sim_process import DEADLINE

pytestmark = pytest.mark.ros

LAUNCH = {'speed': 15.2, 'pitch': 14.0, 'roll': -3.0, 'yaw': 4.0, 'spin': 33.0, 'height': 1.2}
WIND = (1.5, -2.5, 0.0)
TARGET = (24.0, 1.0)
RATES = {'physics_rate': 100.0, 'publish_rate': 20.0}


def path_of_environment() -> tuple[np.ndarray, dict]:
    """The numbers of odometry at the release and after each action, and the infos of the end."""
    env, policy = SteerEnv(), trained_policy()
    row, _ = env.reset(options={'launch': LAUNCH, 'wind': WIND, 'target': TARGET})
    states, ended = [env.vector.simulator.columns[:, 0]], False
    while not ended:
        row, _, ended, _, info = env.step(policy(row[np.newaxis])[0])
        states.append(env.vector.simulator.columns[:, 0])
    return frames.odometry_array(states[:-1]), info


def test_in_lockstep_the_path_is_that_of_the_environment_to_the_bit(ros, tmp_path):
    launch = {f'launch.{name}': value for name, value in LAUNCH.items()}
    wind = {f'wind.{axis}': value for axis, value in zip('xyz', WIND, strict=True)}
    sim = ros.start({'auto_throw': False, **RATES, **launch, **wind})
    messages = ros.subscribe(Odometry, topics.ODOM)
    ros.spin_until(lambda: messages, 'odometry')  # then the subscription is matched
    arguments = ['--ros-args', '-p', f'target:={list(TARGET)}', '-p', 'lockstep:=true']
    log = tmp_path / 'policy.txt'
    node = start('disc_sim_ros.ros.policy', arguments, log)
    try:
        ros.spin_until(lambda: node.poll() is not None, 'the end of policy_node', 2 * DEADLINE)
    finally:
        node.kill()
    errors = log.read_text()
    assert node.returncode == 0, errors + sim.stderr
    expected, info = path_of_environment()
    flying = [numbers for _, numbers in map(_read, messages) if any(numbers[7:])]
    assert len(expected) > 40
    assert np.array_equal(np.array(flying), expected)
    ros.spin_until(lambda: not any(_read(messages[-1])[1][7:]), 'the landed disc')
    assert _read(messages[-1])[1][:2] == tuple(info['landing'])
    x, y = info['landing']
    line = f'landed at x {x:.2f} m, y {y:.2f} m, {info["miss"]:.2f} m from the target'
    assert line in errors


def test_a_disc_that_is_put_back_in_flight_has_not_landed(ros, tmp_path):
    """It is at rest, as after a landing, and its landing afterwards is told."""
    sim = ros.start({'auto_throw': False, 'launch.height': 5.0, 'real_time_factor': 2.0})
    messages = ros.subscribe(Odometry, topics.ODOM)
    log = tmp_path / 'policy.txt'
    node = start('disc_sim_ros.ros.policy', ['--ros-args', '-p', 'target:=[9,0]'], log)
    try:
        ros.spin_until(lambda: 'steering to' in log.read_text(), 'the node')
        ros.publisher(Odometry, 'throw')  # as long as it takes to match endpoints
        for _ in range(2):
            assert ros.call(sim, 'throw').success
            ros.spin_until(lambda: messages and any(_read(messages[-1])[1][7:]), 'the flight')
            ros.spin_until(wall(0.5))
            assert 'landed' not in log.read_text()
            if 'reset' not in log.read_text():
                assert ros.call(sim, 'reset').success
                ros.spin_until(
                    lambda: 'ended without a landing: reset' in log.read_text(), 'its words'
                )
        ros.spin_until(lambda: 'landed at x' in log.read_text(), 'the landing')
    finally:
        node.kill()
        node.wait()


@pytest.mark.parametrize(
    ('name', 'value', 'allowed'),
    [
        ('target', (1e6, 0.0), '10000'),
        ('target', (1.0,), '2 numbers'),
        ('policy', 'none.npz', 'npz file of weights'),
        ('lockstop', True, 'no such parameter'),
    ],
)
def test_bad_parameters_are_refused(name, value, allowed):
    with pytest.raises(ConfigError, match=allowed) as refusal:
        policy_config({name: value})
    assert '\n' not in str(refusal.value)
