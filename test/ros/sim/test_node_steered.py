"""sim_node in its own process: commands and throws act as `physics` predicts.

The messages in a bag are enough to simulate the flight again, to the last bit.
"""

from dataclasses import replace
import json
import math

from numpy.testing import assert_allclose, assert_array_equal
import pytest
from scipy.spatial.transform import Rotation
import yaml

from sample_discs import FRISBEE

pytest.importorskip('rclpy')

from nav_msgs.msg import Odometry

from disc_sim_ros import topics
from disc_sim_ros.cli import fly as fly_command
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.ros import messages
from ros.sim.paused_sim import (
    AXES_OF,
    MS,
    NOT_PERIODIC,
    SECOND,
    SHORT,
    START,
    PausedSim,
    applied,
    assert_flown,
    coefficients,
    control_change,
    launch_parameters,
    moment,
    ns,
    numbers,
    resimulated,
    stamped,
    wind,
    wind_change,
)

pytestmark = pytest.mark.ros


# ---- commands ----

TIMEOUT = 0.1503  # s, no whole number of steps
# Commands, stamped relative to the release [ns]; steps at which each begins and ends to act.
CASES = {
    'disc': ([moment(50 * MS, 'disc', 0.02, -0.03, 0.002)], [(50, 201)]),
    'disc_body': ([moment(50 * MS, 'disc_body', 0.02, -0.03, 0.002)], [(50, 201)]),
    'disc_air': ([moment(50 * MS, 'disc_air', 0.02, -0.03, 0.002)], [(50, 201)]),
    'no frame': ([moment(50 * MS, '', 0.02, -0.03, 0.002)], [(50, 201)]),
    'coefficients': ([coefficients(50 * MS, 0.02, -0.01, 0.001)], [(50, 201)]),
    'between steps': ([coefficients(50 * MS + 1, 0.02, -0.01, 0.001)], [(51, 202)]),
    'before a step': ([coefficients(51 * MS - 1, 0.02, -0.01, 0.001)], [(51, 202)]),
    'in the past': ([coefficients(-1, 0.02, -0.01, 0.001)], [(0, 151)]),
    'long ago': ([moment(-START, 'disc', 0.02, -0.03, 0.002)], [(0, 151)]),
    'renewed': (
        [coefficients(x * MS, 0.02, -0.01, 0.001) for x in (0, 100, 200)],
        [(0, None), (100, None), (200, 351)],
    ),
    'superseded': (
        [coefficients(50 * MS, 1.0, 1.0, 1.0), coefficients(50 * MS, 0.02, 0.0, 0.0)],
        [(50, 201)],
    ),
    'out of order': (
        [coefficients(100 * MS, 0.02, 0.0, 0.0), coefficients(50 * MS, 0.0, 0.03, 0.0)],
        [(50, None), (100, 251)],
    ),
}


def test_commands_act_as_physics_predicts(ros):
    parameters = launch_parameters(SHORT) | {'command_timeout': TIMEOUT}
    node = PausedSim(ros, parameters, *NOT_PERIODIC).ready()
    count = 81  # 0.4 s
    setup = Setup(disc=FRISBEE)
    _, untouched = resimulated(setup, SHORT.state(), count, 5)
    for case, (commands, spans) in CASES.items():
        node.reset()
        node.throw()
        release = ns(node.all_of(topics.RELEASE, 1)[0])
        node.send(*(shifted(command, release) for command in commands))
        node.go()
        odometry = node.wait_for(count)
        ros.pause(node.sim)

        topic, last = commands[-1]
        in_order = sorted(commands, key=lambda command: ns(command[1]))[-len(spans) :]
        changes, expected = [], []
        for (_, message), (begin, end) in zip(in_order, spans, strict=True):
            if topic == topics.CMD_MOMENT:
                x, y, z = numbers([message], messages.WRENCH_FIELDS[3:])[0].tolist()
                on = {'L': x, 'M': -y, 'N': -z, 'axes': AXES_OF[message.header.frame_id]}
                off = dict.fromkeys('LMN', 0.0)
            else:
                x, y, z = numbers([message], messages.VECTOR_FIELDS)[0].tolist()
                on, off = {'C_L': x, 'C_M': y, 'C_N': z}, dict.fromkeys(('C_L', 'C_M', 'C_N'), 0.0)
            changes.append((begin, control_change(**on)))
            if not expected or expected[-1][1:] != (x, y, z):
                expected.append((begin * MS, x, y, z))
            if end is not None:
                changes.append((end, control_change(**off)))
                expected.append((end * MS, 0.0, 0.0, 0.0))
        _, states = resimulated(setup, SHORT.state(), count, 5, changes)
        assert [s[:3] for s in states] != [s[:3] for s in untouched], case
        assert_flown(odometry, states)

        # Each change is published with the step from which it acts, also the fall to zero.
        if topic == topics.CMD_MOMENT:
            published = node.all_of(topics.APPLIED_MOMENT, len(expected))
            paths = messages.WRENCH_FIELDS[3:]
            frame = last.header.frame_id or 'disc_air'
            assert published[0].header.frame_id == frame, case
        else:
            published = node.all_of(topics.APPLIED_COEFFICIENTS, len(expected))
            paths = messages.VECTOR_FIELDS
        assert applied(published, paths, release) == expected, case
        ended = release + expected[-1][0]
        node.wait_for_event('command expired')
        expiries = [event['stamp_s'] for event in node.events('command expired')]
        assert expiries == [f'{ended // SECOND}.{ended % SECOND:09d}'], case


def shifted(command, release):
    """Return a command whose stamp relative to the release is made absolute."""
    topic, message = command
    at = stamped(type(message), ns(message) + release, (), (), message.header.frame_id)
    message = type(message)(**{f: getattr(message, f) for f in _fields(message)})
    message.header = at.header
    return topic, message


def _fields(message):
    return message.get_fields_and_field_types()


def test_the_spiral_turn_is_that_of_fly(ros, capsys):
    """The paper's Fig. 11: renewed commands for 18 s, down from 50 m."""
    arguments = '--roll -45 --pitch -30 --alpha 5 --speed 13.5 --advance-ratio 0.5 --height 50'
    control = '--control 0.1 0 0 --samples 50 --step 0.001 --json'
    assert fly_command.main([*arguments.split(), *control.split()]) == 0
    flown = json.loads(capsys.readouterr().out)
    launch = flown['launch']
    parameters = {
        'launch.roll': -45.0,
        'launch.pitch': -30.0,
        'launch.angle_of_attack': 5.0,
        'launch.speed': 13.5,
        'launch.spin': launch['spin_rad_s'],
        'launch.height': 50.0,
        'publish_rate': 50.0,
    }
    node = PausedSim(ros, parameters, *NOT_PERIODIC).ready()
    renewals = range(0, math.ceil(flown['flight_time_s'] * 1000.0), 400)
    node.send(*(coefficients(START + x * MS, 0.1, 0.0, 0.0) for x in renewals))
    node.throw()
    node.go()
    odometry = node.wait_for(len(flown['t_s']))
    published = numbers(odometry, messages.ODOMETRY_FIELDS)
    assert_array_equal(published[:, :3], flown['position_m'])
    assert_array_equal(-published[:, 12], flown['spin_rad_s'])
    velocity = Rotation.from_quat(published[:, 3:7]).apply(published[:, 7:10])
    assert_allclose(velocity, flown['velocity_m_s'], rtol=0.0, atol=1e-13)
    landed = node.wait_for_event('landed')
    assert float(landed['flight_time_s']) == flown['flight_time_s'] > 10.0
    assert float(landed['range_m']) == flown['range_m']
    assert [float(landed[f'landing_{x}_m']) for x in 'xy'] == flown['landing_position_m'][:2]
    assert float(landed['spin_rad_s']) == flown['end_spin_rad_s']
    assert not node.events('command expired')


# ---- messages are enough to simulate a flight again ----


def resimulated_from_messages(node, flight, count):
    """Simulate a flight again from the messages of the node alone; see `resimulated`."""
    document = yaml.safe_load(node.all_of(topics.CONFIGURATION, flight)[flight - 1].data)
    release = ns(node.all_of(topics.RELEASE, flight)[flight - 1])
    wind_values = document['wind']
    mean = (wind_values.pop('x'), -wind_values.pop('y'), -wind_values.pop('z'))
    setup = Setup(
        disc=disc_file.disc_from_document(document['disc'], document['disc_file']),
        model=document['model'],
        aero=document['aero'],
        moment_axes=document['moment_axes'],
        air=Air(density=document['air_density'], gravity=document['gravity']),
        wind=Wind(mean=mean, **wind_values),
        step=1.0 / document['physics_rate'],
    )
    changes = []

    def change(message, act):
        step = round((ns(message) - release) * document['physics_rate'] / SECOND)
        changes.append((max(step, 0), act))

    for message in node[topics.APPLIED_MOMENT]:
        x, y, z = numbers([message], messages.WRENCH_FIELDS[3:])[0].tolist()
        frame = AXES_OF[message.header.frame_id]
        change(message, control_change(L=x, M=-y, N=-z, axes=frame))
    for message in node[topics.APPLIED_COEFFICIENTS]:
        x, y, z = numbers([message], messages.VECTOR_FIELDS)[0].tolist()
        change(message, control_change(C_L=x, C_M=y, C_N=z))
    for message in node[topics.APPLIED_WIND]:
        if ns(message) >= release:
            change(message, wind_change(*numbers([message], messages.VECTOR_FIELDS)[0].tolist()))
    every = round(document['physics_rate'] / document['publish_rate'])
    return resimulated(setup, State(**document['release']), count, every, changes)


@pytest.mark.parametrize('model', ['exact', 'precession'])
def test_messages_are_enough_to_simulate_a_flight_again(ros, tmp_path, model):
    """With commands at any time, a disc whose file is deleted, and gusts."""
    file = tmp_path / 'heavy.yaml'
    file.write_text('based_on: ultrastar\nmass_kg: 0.18\n')
    parameters = launch_parameters(replace(SHORT, height=1.5, pitch=5.0)) | {
        'disc': str(file),
        'model': model,
        'physics_rate': 3000.0,
        'publish_rate': 100.0,
        'air_density': 1.1,
        'gravity': 9.7,
        'wind.x': -2.0,
        'wind.y': 3.3,
        'wind.roughness_length': 0.1,
        'wind.turbulence': 12.0,
        'wind.seed': 2**62 + 3,
        'command_timeout': 0.2,
    }
    node = PausedSim(ros, parameters, *NOT_PERIODIC).ready()
    node.send(moment(0, 'disc_body', 0.03, 0.0, 0.0))  # acts already at the release
    assert ros.call(node.sim, 'step').success
    ros.forget()  # a recording that begins here is enough
    node.throw()
    node.go(2.0)
    file.unlink()
    node.wait_for(15)
    node.send(coefficients(0, 0.011, -0.007, 1e-5), wind(0, 0.1, -4.2, 0.3))
    node.wait_for(30)
    node.send(coefficients(0, -0.013, 0.0, 0.0), moment(0, 'disc_air', 0.0, 0.021, -1e-5))
    landing = node.wait_for_event('landed')

    release = ns(node.all_of(topics.RELEASE, 1)[0])
    assert release == START + 10 * MS
    assert len(node.all_of(topics.APPLIED_COEFFICIENTS, 3)) == 3
    assert len(node.all_of(topics.APPLIED_MOMENT, 4)) == 4
    node.all_of(topics.APPLIED_WIND, 2)
    ros.spin_until(lambda: len(node[topics.ODOM]) > float(landing['flight_time_s']) * 100 + 3)
    odometry = node[topics.ODOM]
    sim, states = resimulated_from_messages(node, 1, len(odometry))
    assert_flown(odometry, states)

    assert float(landing['flight_time_s']) == sim.touch_time > 0.5
    x, y, _ = frames.flip_yz(sim.touch[:3])
    assert (float(landing['landing_x_m']), float(landing['landing_y_m'])) == (x, y)
    assert float(landing['range_m']) == math.hypot(x, y)
    assert float(landing['spin_rad_s']) == sim.touch.r
    at = release + round(sim.touch_time * SECOND)
    assert landing['stamp_s'] == f'{at // SECOND}.{at % SECOND:09d}'
    (thrown,) = node.events('thrown')
    assert thrown['stamp_s'] == f'{release // SECOND}.{release % SECOND:09d}'
    assert float(thrown['speed_m_s']) == pytest.approx(SHORT.speed, rel=1e-15)
    assert float(thrown['spin_rad_s']) == SHORT.spin
    assert thrown['flight'] == landing['flight'] == '1'


# ---- throws ----


def test_periodic_throws_have_successive_seeds(ros):
    parameters = {'throw_period': 0.4, 'wind.turbulence': 20.0, 'wind.seed': 40, 'imu.seed': 5}
    noise = {'imu.gyroscope_noise': 0.1}
    node = PausedSim(
        ros, launch_parameters(SHORT) | parameters | noise, *NOT_PERIODIC, topics.IMU
    ).ready()
    node.throw()
    node.go(4.0)
    odometry, imus = node.wait_for(241), node[topics.IMU]
    documents = node.all_of(topics.CONFIGURATION, 3)
    noises = []
    for n in range(3):
        document = yaml.safe_load(documents[n].data)
        assert (document['flight'], document['wind']['seed']) == (n + 1, 40 + n)
        setup = Setup(disc=FRISBEE, wind=Wind(turbulence=20.0, seed=40 + n))
        _, states = resimulated(setup, SHORT.state(), 80, 5)
        assert_flown(odometry[80 * n : 80 * (n + 1)], states)
        noises.append(imus[80 * n].angular_velocity.z + SHORT.spin)
    assert len(set(noises)) == 3
    assert ns(odometry[240]) == START + 1200 * MS


def test_a_throw_of_another_node_in_mid_flight(ros):
    """The disc has the state of the message at the first odom not before its stamp."""
    node = PausedSim(ros, launch_parameters(SHORT), *NOT_PERIODIC).ready()
    thrown = Launch(speed=9.0, pitch=20.0, roll=-30.0, yaw=50.0, sideslip=10.0, spin=-35.0,
                    roll_rate=1.0, pitch_rate=2.0, height=2.0)  # fmt: skip
    state = thrown.state()._replace(X=3.0, Y=-4.0)
    message = stamped(
        Odometry,
        START + 101 * MS,
        messages.odometry(state),
        messages.ODOMETRY_FIELDS,
        'map',
    )
    node.throw()
    node.send((topics.THROW, message))
    node.go(1.0)
    odometry = node.wait_for(100)
    _, first = resimulated(Setup(disc=FRISBEE), SHORT.state(), 21, 5)
    assert_flown(odometry[:21], first)
    release = node.all_of(topics.RELEASE, 2)[1]
    assert ns(release) == ns(odometry[21]) == START + 105 * MS
    values = numbers([release], messages.ODOMETRY_FIELDS)[0]
    assert_allclose(values, messages.odometry(state), rtol=0.0, atol=1e-14)
    assert_array_equal(values, numbers(odometry[21:22], messages.ODOMETRY_FIELDS)[0])
    _, second = resimulated_from_messages(node, 2, 79)
    assert_flown(odometry[21:100], second)

    # A throw without a stamp acts at the next message.
    now = len(node[topics.ODOM])
    message.header.stamp.sec = message.header.stamp.nanosec = 0
    node.send((topics.THROW, message))
    third = ns(node.all_of(topics.RELEASE, 3)[2])
    assert third > ns(node[topics.ODOM][now - 1])
    assert (third - START) % (5 * MS) == 0
    assert_flown(node.since(third, 40), resimulated_from_messages(node, 3, 40)[1])


def test_wind_of_another_node_acts_at_once(ros):
    node = PausedSim(ros, launch_parameters(SHORT), *NOT_PERIODIC, topics.AIRSPEED).ready()
    node.throw()
    node.send(wind(START + 50 * MS, 1.0, -2.0, 0.5))
    node.go(1.0)
    node.wait_for(40)
    node.send(wind(0, 5.0, 0.0, 0.0))
    node.wait_for(100)
    published = applied(node.all_of(topics.APPLIED_WIND, 3), messages.VECTOR_FIELDS)
    (at, *_) = published[-1]
    assert published == [(0, 0.0, 0.0, 0.0), (50 * MS, 1.0, -2.0, 0.5), (at, 5.0, 0.0, 0.0)]
    assert 39 * 5 * MS <= at < 100 * 5 * MS
    assert at % MS == 0
    sim, states = resimulated_from_messages(node, 1, 100)
    assert_flown(node[topics.ODOM][:100], states)
    # The air has the new wind in the message of the step at which it begins.
    airspeed = node[topics.AIRSPEED][11].data
    s = states[11]
    assert airspeed == pytest.approx(math.dist(s[3:6], (1.0, 2.0, -0.5)), rel=1e-14)
    assert sim.setup.wind.mean == (5.0, 0.0, 0.0)
