"""sim_node in a process of its own does with commands and throws what the core predicts.

What a bag holds is enough to fly it again, to the last bit.
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
from disc_sim_ros.ros import messages as conversions
from ros.bench import (
    AXES_OF,
    MS,
    ONCE,
    SECOND,
    SHORT,
    START,
    Bench,
    applied,
    assert_flown,
    blown,
    coefficients,
    launch_parameters,
    moment,
    ns,
    numbers,
    replayed,
    stamped,
    steered,
    wind,
)

pytestmark = pytest.mark.ros


# ---- commands ----

TIMEOUT = 0.1503  # s, no whole number of steps
# Commands, stamped relative to the release [ns]; steps at which the core is steered.
STEERED = {
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
    'overtaken': (
        [coefficients(50 * MS, 1.0, 1.0, 1.0), coefficients(50 * MS, 0.02, 0.0, 0.0)],
        [(50, 201)],
    ),
    'out of order': (
        [coefficients(100 * MS, 0.02, 0.0, 0.0), coefficients(50 * MS, 0.0, 0.03, 0.0)],
        [(50, None), (100, 251)],
    ),
}


def test_commands_do_what_the_core_predicts(ros):
    parameters = launch_parameters(SHORT) | {'command_timeout': TIMEOUT}
    bench = Bench(ros, parameters, *ONCE).ready()
    count = 81  # 0.4 s
    setup = Setup(disc=FRISBEE)
    _, untouched = replayed(setup, SHORT.state(), count, 5)
    for case, (commands, spans) in STEERED.items():
        bench.reset()
        bench.throw()
        release = ns(bench.all_of(topics.RELEASE, 1)[0])
        bench.send(*(moved(command, release) for command in commands))
        bench.go()
        odometry = bench.wait_for(count)
        ros.pause(bench.sim)

        topic, last = commands[-1]
        in_order = sorted(commands, key=lambda command: ns(command[1]))[-len(spans) :]
        changes, told = [], []
        for (_, message), (begin, end) in zip(in_order, spans, strict=True):
            if topic == topics.CMD_MOMENT:
                x, y, z = numbers([message], conversions.WRENCH_FIELDS[3:])[0].tolist()
                on = {'L': x, 'M': -y, 'N': -z, 'axes': AXES_OF[message.header.frame_id]}
                off = dict.fromkeys('LMN', 0.0)
            else:
                x, y, z = numbers([message], conversions.VECTOR_FIELDS)[0].tolist()
                on, off = {'C_L': x, 'C_M': y, 'C_N': z}, dict.fromkeys(('C_L', 'C_M', 'C_N'), 0.0)
            changes.append((begin, steered(**on)))
            if not told or told[-1][1:] != (x, y, z):
                told.append((begin * MS, x, y, z))
            if end is not None:
                changes.append((end, steered(**off)))
                told.append((end * MS, 0.0, 0.0, 0.0))
        _, states = replayed(setup, SHORT.state(), count, 5, changes)
        assert [s[:3] for s in states] != [s[:3] for s in untouched], case
        assert_flown(odometry, states)

        # Each change is told with the step from which it acts, also the fall to zero.
        if topic == topics.CMD_MOMENT:
            messages = bench.all_of(topics.APPLIED_MOMENT, len(told))
            paths = conversions.WRENCH_FIELDS[3:]
            frame = last.header.frame_id or 'disc_air'
            assert messages[0].header.frame_id == frame, case
        else:
            messages = bench.all_of(topics.APPLIED_COEFFICIENTS, len(told))
            paths = conversions.VECTOR_FIELDS
        assert applied(messages, paths, release) == told, case
        ended = release + told[-1][0]
        bench.wait_for_event('command expired')
        expiries = [event['stamp_s'] for event in bench.events('command expired')]
        assert expiries == [f'{ended // SECOND}.{ended % SECOND:09d}'], case


def moved(command, release):
    """Return a command with its stamp, relative to the release, made absolute."""
    topic, message = command
    at = stamped(type(message), ns(message) + release, (), (), message.header.frame_id)
    message = type(message)(**{f: getattr(message, f) for f in _fields(message)})
    message.header = at.header
    return topic, message


def _fields(message):
    return message.get_fields_and_field_types()


def test_the_spiral_turn_is_that_of_fly(ros, capsys):
    """The paper's Fig. 11: held by commands that are renewed, 18 s down from 50 m."""
    arguments = '--roll -45 --pitch -30 --alpha 5 --speed 13.5 --advance-ratio 0.5 --height 50'
    control = '--control 0.1 0 0 --samples 50 --json'
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
    bench = Bench(ros, parameters, *ONCE).ready()
    renewals = range(0, math.ceil(flown['flight_time_s'] * 1000.0), 400)
    bench.send(*(coefficients(START + x * MS, 0.1, 0.0, 0.0) for x in renewals))
    bench.throw()
    bench.go()
    odometry = bench.wait_for(len(flown['t_s']))
    found = numbers(odometry, conversions.ODOMETRY_FIELDS)
    assert_array_equal(found[:, :3], flown['position_m'])
    assert_array_equal(-found[:, 12], flown['spin_rad_s'])
    velocity = Rotation.from_quat(found[:, 3:7]).apply(found[:, 7:10])
    assert_allclose(velocity, flown['velocity_m_s'], rtol=0.0, atol=1e-13)
    landed = bench.wait_for_event('landed')
    assert float(landed['flight_time_s']) == flown['flight_time_s'] > 10.0
    assert float(landed['range_m']) == flown['range_m']
    assert [float(landed[f'landing_{x}_m']) for x in 'xy'] == flown['landing_position_m'][:2]
    assert float(landed['spin_rad_s']) == flown['end_spin_rad_s']
    assert not bench.events('command expired')


# ---- what a bag holds is enough ----


def reflown(bench, flight, count):
    """Fly again what was told of a flight, from messages alone."""
    told = yaml.safe_load(bench.all_of(topics.CONFIGURATION, flight)[flight - 1].data)
    release = ns(bench.all_of(topics.RELEASE, flight)[flight - 1])
    blowing = told['wind']
    mean = (blowing.pop('x'), -blowing.pop('y'), -blowing.pop('z'))
    setup = Setup(
        disc=disc_file.disc_from_document(told['disc'], told['disc_file']),
        model=told['model'],
        aero=told['aero'],
        moment_axes=told['moment_axes'],
        air=Air(density=told['air_density'], gravity=told['gravity']),
        wind=Wind(mean=mean, **blowing),
        step=1.0 / told['physics_rate'],
    )
    changes = []

    def change(message, act):
        step = round((ns(message) - release) * told['physics_rate'] / SECOND)
        changes.append((max(step, 0), act))

    for message in bench[topics.APPLIED_MOMENT]:
        x, y, z = numbers([message], conversions.WRENCH_FIELDS[3:])[0].tolist()
        frame = AXES_OF[message.header.frame_id]
        change(message, steered(L=x, M=-y, N=-z, axes=frame))
    for message in bench[topics.APPLIED_COEFFICIENTS]:
        x, y, z = numbers([message], conversions.VECTOR_FIELDS)[0].tolist()
        change(message, steered(C_L=x, C_M=y, C_N=z))
    for message in bench[topics.APPLIED_WIND]:
        if ns(message) >= release:
            change(message, blown(*numbers([message], conversions.VECTOR_FIELDS)[0].tolist()))
    every = round(told['physics_rate'] / told['publish_rate'])
    return replayed(setup, State(**told['release']), count, every, changes)


@pytest.mark.parametrize('model', ['exact', 'precession'])
def test_messages_are_enough_to_fly_it_again(ros, tmp_path, model):
    """Commands that arrive whenever they do, a disc from a file that is gone, gusts."""
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
    bench = Bench(ros, parameters, *ONCE).ready()
    bench.send(moment(0, 'disc_body', 0.03, 0.0, 0.0))  # acts already when the disc is let go
    assert ros.call(bench.sim, 'step').success
    ros.forget()  # a bag that begins here is enough
    bench.throw()
    bench.go(2.0)
    file.unlink()
    bench.wait_for(15)
    bench.send(coefficients(0, 0.011, -0.007, 1e-5), wind(0, 0.1, -4.2, 0.3))
    bench.wait_for(30)
    bench.send(coefficients(0, -0.013, 0.0, 0.0), moment(0, 'disc_air', 0.0, 0.021, -1e-5))
    landing = bench.wait_for_event('landed')

    release = ns(bench.all_of(topics.RELEASE, 1)[0])
    assert release == START + 10 * MS
    assert len(bench.all_of(topics.APPLIED_COEFFICIENTS, 3)) == 3
    assert len(bench.all_of(topics.APPLIED_MOMENT, 4)) == 4
    bench.all_of(topics.APPLIED_WIND, 2)
    ros.spin_until(lambda: len(bench[topics.ODOM]) > float(landing['flight_time_s']) * 100 + 3)
    odometry = bench[topics.ODOM]
    core, states = reflown(bench, 1, len(odometry))
    assert_flown(odometry, states)

    assert float(landing['flight_time_s']) == core.touch_time > 0.5
    x, y, _ = frames.flip_yz(core.touch[:3])
    assert (float(landing['landing_x_m']), float(landing['landing_y_m'])) == (x, y)
    assert float(landing['range_m']) == math.hypot(x, y)
    assert float(landing['spin_rad_s']) == core.touch.r
    at = release + round(core.touch_time * SECOND)
    assert landing['stamp_s'] == f'{at // SECOND}.{at % SECOND:09d}'
    (thrown,) = bench.events('thrown')
    assert thrown['stamp_s'] == f'{release // SECOND}.{release % SECOND:09d}'
    assert float(thrown['speed_m_s']) == pytest.approx(SHORT.speed, rel=1e-15)
    assert float(thrown['spin_rad_s']) == SHORT.spin
    assert thrown['flight'] == landing['flight'] == '1'


# ---- throws ----


def test_thrown_again_and_again_with_the_next_seed(ros):
    parameters = {'throw_period': 0.4, 'wind.turbulence': 20.0, 'wind.seed': 40, 'imu.seed': 5}
    noise = {'imu.gyroscope_noise': 0.1}
    bench = Bench(ros, launch_parameters(SHORT) | parameters | noise, *ONCE, topics.IMU).ready()
    bench.throw()
    bench.go(4.0)
    odometry, imus = bench.wait_for(241), bench[topics.IMU]
    documents = bench.all_of(topics.CONFIGURATION, 3)
    noises = []
    for n in range(3):
        told = yaml.safe_load(documents[n].data)
        assert (told['flight'], told['wind']['seed']) == (n + 1, 40 + n)
        setup = Setup(disc=FRISBEE, wind=Wind(turbulence=20.0, seed=40 + n))
        _, states = replayed(setup, SHORT.state(), 80, 5)
        assert_flown(odometry[80 * n : 80 * (n + 1)], states)
        noises.append(imus[80 * n].angular_velocity.z + SHORT.spin)
    assert len(set(noises)) == 3
    assert ns(odometry[240]) == START + 1200 * MS


def test_a_throw_of_another_node_in_mid_flight(ros):
    """It starts the state that the message gives, at the first message not before its stamp."""
    bench = Bench(ros, launch_parameters(SHORT), *ONCE).ready()
    thrown = Launch(speed=9.0, pitch=20.0, roll=-30.0, yaw=50.0, sideslip=10.0, spin=-35.0,
                    roll_rate=1.0, pitch_rate=2.0, height=2.0)  # fmt: skip
    state = thrown.state()._replace(X=3.0, Y=-4.0)
    message = stamped(
        Odometry,
        START + 101 * MS,
        conversions.odometry(state),
        conversions.ODOMETRY_FIELDS,
        'map',
    )
    bench.throw()
    bench.send((topics.THROW, message))
    bench.go(1.0)
    odometry = bench.wait_for(100)
    _, first = replayed(Setup(disc=FRISBEE), SHORT.state(), 21, 5)
    assert_flown(odometry[:21], first)
    release = bench.all_of(topics.RELEASE, 2)[1]
    assert ns(release) == ns(odometry[21]) == START + 105 * MS
    values = numbers([release], conversions.ODOMETRY_FIELDS)[0]
    assert_allclose(values, conversions.odometry(state), rtol=0.0, atol=1e-14)
    assert_array_equal(values, numbers(odometry[21:22], conversions.ODOMETRY_FIELDS)[0])
    _, second = reflown(bench, 2, 79)
    assert_flown(odometry[21:100], second)

    # One without a stamp counts with the next message.
    now = len(bench[topics.ODOM])
    message.header.stamp.sec = message.header.stamp.nanosec = 0
    bench.send((topics.THROW, message))
    third = ns(bench.all_of(topics.RELEASE, 3)[2])
    assert third > ns(bench[topics.ODOM][now - 1])
    assert (third - START) % (5 * MS) == 0
    assert_flown(bench.since(third, 40), reflown(bench, 3, 40)[1])


def test_wind_of_another_node_blows_at_once(ros):
    bench = Bench(ros, launch_parameters(SHORT), *ONCE, topics.AIRSPEED).ready()
    bench.throw()
    bench.send(wind(START + 50 * MS, 1.0, -2.0, 0.5))
    bench.go(1.0)
    bench.wait_for(40)
    bench.send(wind(0, 5.0, 0.0, 0.0))
    bench.wait_for(100)
    told = applied(bench.all_of(topics.APPLIED_WIND, 3), conversions.VECTOR_FIELDS)
    (at, *_) = told[-1]
    assert told == [(0, 0.0, 0.0, 0.0), (50 * MS, 1.0, -2.0, 0.5), (at, 5.0, 0.0, 0.0)]
    assert 39 * 5 * MS <= at < 100 * 5 * MS
    assert at % MS == 0
    core, states = reflown(bench, 1, 100)
    assert_flown(bench[topics.ODOM][:100], states)
    # In the very message with whose step it begins the air has the new wind.
    airspeed = bench[topics.AIRSPEED][11].data
    s = states[11]
    assert airspeed == pytest.approx(math.dist(s[3:6], (1.0, 2.0, -0.5)), rel=1e-14)
    assert core.setup.wind.mean == (5.0, 0.0, 0.0)
