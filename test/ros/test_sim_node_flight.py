"""sim_node in a process of its own flies what the core flies, and all that it says agrees.

Positions, attitudes and rates are compared to the last bit: messages only turn their signs.
"""

import math
import signal
import subprocess
import sys

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
import pytest
from scipy.spatial.transform import Rotation

from sample_discs import FRISBEE

pytest.importorskip('rclpy')


from disc_sim_ros import topics
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.kernels.equations import DISC, DISC_BODY
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.ros import messages as conversions
from ros.bench import (
    FLOATS,
    KINDS,
    MS,
    ONCE,
    SECOND,
    SHORT,
    START,
    Bench,
    assert_flown,
    blown,
    coefficients,
    launch_parameters,
    moment,
    ns,
    numbers,
    replayed,
    steered,
    wind,
)

pytestmark = pytest.mark.ros


# ---- time ----


def test_the_flight_does_not_depend_on_the_clock(ros, request):
    """Same launch, commands and seeds at four paces, on a busy machine and through a stall."""
    paces = {'at_0': 0.0, 'at_half': 0.5, 'at_1': 1.0, 'at_10': 10.0, 'stalled': 1.0}
    parameters = launch_parameters(SHORT) | {
        'wind.x': 2.0,
        'wind.y': 1.0,
        'wind.turbulence': 15.0,
        'wind.seed': 7,
        'command_timeout': 0.25,
        'imu.gyroscope_noise': 0.01,
        'imu.accelerometer_noise': 0.1,
    }
    commands = [
        moment(0, 'disc', 0.0, 0.01, 0.0),
        coefficients(START + 100 * MS + 1, 0.02, -0.01, 0.001),
        moment(START + 200 * MS, 'disc_body', 0.05, 0.0, 0.001),
        coefficients(START + 300 * MS, -0.02, 0.0, 0.0),
        wind(START + 450 * MS, -3.0, 1.0, 0.5),
    ]
    told = (topics.IMU, *ONCE)
    benches = [Bench(ros, parameters, *told, namespace=f'/{name}') for name in paces]
    for bench in benches:
        bench.ready()
    for bench in benches:
        bench.send(*commands)
        bench.throw()
    for _ in range(2):
        busy = subprocess.Popen([sys.executable, '-c', 'while True: pass'])
        request.addfinalizer(busy.wait)
        request.addfinalizer(busy.kill)
    for bench, pace in zip(benches, paces.values(), strict=True):
        bench.go(pace)
    stalled = benches[-1]
    stalled.wait_for(20)
    stalled.sim.process.send_signal(signal.SIGSTOP)
    benches[2].wait_for_event('landed')
    stalled.sim.process.send_signal(signal.SIGCONT)

    setup = Setup(disc=FRISBEE, wind=Wind(mean=(2.0, -1.0, 0.0), turbulence=15.0, seed=7))
    changes = [
        (0, steered(M=-0.01, axes=DISC)),
        (101, steered(C_L=0.02, C_M=-0.01, C_N=0.001)),
        (200, steered(L=0.05, M=0.0, N=-0.001, axes=DISC_BODY)),
        (300, steered(C_L=-0.02, C_M=0.0, C_N=0.0)),
        (450, blown(-3.0, 1.0, 0.5)),
        (450, steered(L=0.0, M=0.0, N=0.0)),
        (550, steered(C_L=0.0)),
    ]
    core, states = replayed(setup, SHORT.state(), 251, 5, changes)
    count = math.ceil(core.touch_time * 200.0) + 1  # the last one lies on the ground
    assert 200 < count < 251
    for bench in benches:
        landing = bench.wait_for_event('landed')
        assert float(landing['flight_time_s']) == core.touch_time
        odometry = bench.wait_for(count)
        assert [ns(m) - START for m in odometry] == [5 * MS * k for k in range(count)]
        assert_flown(odometry, states[:count])
        # What else is said is the same to the last digit, too.
        for topic, number in {topics.IMU: count, **CHANGES}.items():
            said, first = (b.all_of(topic, number)[:count] for b in (bench, benches[0]))
            if topic == topics.FLIGHT_EVENTS:
                assert [e.values for e in said] == [e.values for e in first]
            else:
                assert said == first


CHANGES = {
    topics.FLIGHT_EVENTS: 4,
    topics.CONFIGURATION: 1,
    topics.RELEASE: 1,
    topics.APPLIED_MOMENT: 3,
    topics.APPLIED_COEFFICIENTS: 3,
    topics.APPLIED_WIND: 2,
}


@pytest.mark.parametrize(
    ('physics', 'publish'), [(1000, 200), (3000, 100), (770, 70)], ids=lambda rate: f'{rate}Hz'
)
def test_stamps_are_even_over_throws(ros, physics, publish):
    """Message k is stamped START + floor(k / rate): no error adds up, and no throw shifts it."""
    rates = {'physics_rate': float(physics), 'publish_rate': float(publish)}
    bench = Bench(ros, rates | {'throw_period': 0.333}, *ONCE, topics.JOINT_STATES).ready()
    bench.throw()
    bench.go(20.0)
    releases = [ns(m) for m in bench.all_of(topics.RELEASE, 4)[:4]]
    count = math.ceil(3 * 0.333 * publish)
    odometry = bench.wait_for(count)
    assert [ns(m) for m in odometry] == [START + k * SECOND // publish for k in range(count)]
    assert [ns(m) for m in bench[topics.JOINT_STATES][:count]] == [ns(m) for m in odometry]
    # A throw is due with the first message not before its period is over.
    wait = math.ceil(0.333 * publish)
    assert releases == [START + wait * n * SECOND // publish for n in range(4)]


def test_new_rates_begin_with_a_throw(ros):
    bench = Bench(ros, {'physics_rate': 1000.0, 'publish_rate': 200.0}, *ONCE).ready()
    bench.throw()
    bench.go(5.0)
    for flight, (physics, publish) in enumerate([(1000, 250), (3000, 100), (770, 70)], start=2):
        bench.wait_for(1)
        bench.set(physics_rate=float(physics), publish_rate=float(publish))
        bench.throw()
        release = ns(bench.all_of(topics.RELEASE, flight)[-1])
        stamps = [ns(m) for m in bench.since(release, 30)]
        assert stamps == [release + k * SECOND // publish for k in range(30)]


# ---- one step, many topics ----


def test_all_that_is_said_of_one_step_agrees(ros):
    """With each other, with the core, and with the laws of motion."""
    parameters = launch_parameters(SHORT) | {
        'physics_rate': 4000.0,
        'publish_rate': 1000.0,
        'aero': 'linear',  # the table has kinks, and differences an error at each
        'imu.offset': list(OFFSET),
        'wind.x': 3.0,
        'wind.y': -2.0,
        'wind.roughness_length': 0.03,
    }
    bench = Bench(ros, parameters, *KINDS).ready()
    bench.throw()
    bench.go(1.0)
    count = 400
    odometry = bench.wait_for(count)
    ros.pause(bench.sim)  # 14 topics at 1 kHz are more than one listener in Python can take
    transforms = bench.all_of(topics.TRANSFORM, 2 * count)[: 2 * count]
    said = {name: messages[:count] for name, messages in bench.heard.items()}
    tilts, turns = transforms[::2], transforms[1::2]

    for messages, parent, child in (
        (odometry, 'map', 'disc'),
        (said[topics.POSE], 'map', None),
        (tilts, 'map', 'disc'),
        (turns, 'disc', 'disc_body'),
        (said[topics.JOINT_STATES], '', None),
        (said[topics.IMU], 'disc_body', None),
        (said[topics.AERO_WRENCH], 'disc', None),
    ):
        assert [ns(m) for m in messages] == [START + MS * k for k in range(count)]
        assert {m.header.frame_id for m in messages} == {parent}
        assert {getattr(m, 'child_frame_id', None) for m in messages} == {child}

    # The same numbers in other words.
    odom = numbers(odometry, conversions.ODOMETRY_FIELDS)
    assert_array_equal(numbers(said[topics.POSE], conversions.POSE_FIELDS), odom[:, :7])
    assert_array_equal(numbers(tilts, conversions.TRANSFORM_FIELDS), odom[:, :7])
    angle, rate = numbers(said[topics.JOINT_STATES], conversions.JOINT_FIELDS).T
    assert_array_equal(rate, odom[:, 12])
    spin = Rotation.from_quat(numbers(turns, conversions.TRANSFORM_FIELDS)[:, 3:])
    # Rounding of angles up to 30 rad, and of rates of 40 rad/s.
    assert_allclose(spin.as_rotvec(), np.outer(angle, (0.0, 0.0, 1.0)), atol=1e-13)
    imu = numbers(said[topics.IMU], conversions.IMU_FIELDS)
    assert_allclose(spin.apply(imu[:, :3]), odom[:, 10:], rtol=0.0, atol=1e-13)

    setup = Setup(
        disc=FRISBEE,
        aero='linear',
        wind=Wind(mean=(3.0, 2.0, 0.0), roughness_length=0.03),
        step=1.0 / 4000.0,
    )
    wrench = numbers(said[topics.AERO_WRENCH], conversions.WRENCH_FIELDS)
    assert_core_says(setup, odometry, angle, wrench, {name: said[name] for name in FLOATS})
    assert_lawful(odom, spin, imu, wrench)


def assert_core_says(setup, odometry, angle, wrench, floats):
    """State and loads are those of the core, and the rest what the core makes of it."""
    count = len(odometry)
    flown = fly(SHORT, setup, sample_rate=1000.0).trajectory
    states = flown.rows[:count, 1:15]
    assert_flown(odometry, states)
    assert_allclose(np.exp(1j * angle), np.exp(-1j * states[:, 13]), atol=1e-13)
    quantities = (
        flown.airspeed,
        flown.alpha,
        flown.absolute_attitude,
        flown.advance_ratio,
        flown.spin,
    )
    for (name, messages), expected in zip(floats.items(), quantities, strict=True):
        values = numbers(messages, ['data'])[:, 0]
        assert_allclose(values, expected[:count], rtol=1e-12, atol=1e-13, err_msg=name)
    sim = FlightSimulator(setup, SHORT.state())
    for row in wrench:
        seen = sim.observe()
        assert_array_equal(row, [*frames.flip_yz(seen[6:9]), *frames.flip_yz(seen[9:12])])
        sim.advance(4)


def assert_lawful(odom, spin, imu, wrench):
    """Velocities, rates and specific force are those of the motion of the poses alone.

    Differences of sixth order over h = 1 ms: rounding of positions by 2e-15 m makes 1e-11 m/s and
    1e-8 m/s^2 of them; turning at 40 rad/s and nutating at 80 rad/s, (80 h)^6 / 140 of each rate
    is missing, and RK4 itself lags by (20 h)^4 / 120 of it.
    """
    tilt = Rotation.from_quat(odom[:, 3:7])
    velocity = tilt.apply(odom[:, 7:10])
    assert_allclose(slope(odom[:, :3]), velocity[INNER], atol=1e-9)
    tilting = odom[:, 10:] * (1.0, 1.0, 0.0)  # `disc` does not spin
    assert_allclose(turning(tilt), tilting[INNER], atol=1e-7)
    plastic = tilt * spin
    assert_allclose(turning(plastic), imu[INNER, :3], atol=1e-6)

    up = np.array([0.0, 0.0, 9.81])
    sensor = odom[:, :3] + plastic.apply(OFFSET)
    acceleration = np.column_stack([np.convolve(x, BEND, 'valid') for x in sensor.T]) / 180e-6
    felt = plastic[INNER].inv().apply(acceleration + up)
    assert_allclose(imu[INNER, 3:], felt, atol=1e-5)
    assert np.abs(felt[:, 0]).min() > 100.0  # 40 rad/s at 0.1 m
    pushed = FRISBEE.mass * (slope(velocity) + up)
    assert_allclose(tilt.apply(wrench[:, :3])[INNER], pushed, atol=1e-8)


OFFSET = (0.1, 0.05, 0.02)  # m, of the IMU
INNER = slice(3, -3)  # where there are differences
SLOPE = (1.0, -9.0, 45.0, 0.0, -45.0, 9.0, -1.0)  # over 60 h; a convolution turns it round
BEND = (2.0, -27.0, 270.0, -490.0, 270.0, -27.0, 2.0)  # over 180 h^2


def slope(values):
    """Return the derivative by time of samples at 1 kHz."""
    return np.column_stack([np.convolve(x, SLOPE, 'valid') for x in values.T]) / 60e-3


def turning(rotations):
    """Return the angular velocity [rad/s], in the axes that turn, from quaternions at 1 kHz."""
    q = rotations.as_quat()
    flips = np.sign((q[1:] * q[:-1]).sum(axis=1)).cumprod()
    q[1:] *= flips[:, None]  # q and -q are one rotation: take the nearer one
    x, y, z, w = q[INNER].T
    dx, dy, dz, dw = slope(q).T
    # Twice the vector part of the conjugate of q times its derivative.
    return 2.0 * np.column_stack([
        w * dx - x * dw - y * dz + z * dy,
        w * dy - y * dw - z * dx + x * dz,
        w * dz - z * dw - x * dy + y * dx,
    ])  # fmt: skip


def test_imu_in_free_fall_and_on_the_ground(ros):
    """Nothing at the centre of a falling disc, the pull to the axis beside it, +g at rest."""
    falling = Launch(speed=5.0, pitch=0.0, roll=0.0, spin=50.0, height=1.0)
    parameters = launch_parameters(falling) | {'air_density': 0.0}
    bench = Bench(ros, parameters, topics.IMU, *ONCE).ready()
    in_the_air = math.floor(math.sqrt(2.0 / 9.81) * 200.0) + 1
    # At 50 rad/s and 0.1 m: 250 m/s^2.
    for offset, pull in (((0.0, 0.0, 0.0), (0.0, 0.0)), ((0.1, -0.02, 0.01), (-250.0, 50.0))):
        bench.set(imu__offset=list(offset))
        bench.reset()
        bench.throw()
        bench.go()
        bench.wait_for(in_the_air + 1)
        ros.pause(bench.sim)
        imu = numbers(bench[topics.IMU], conversions.IMU_FIELDS)
        assert_allclose(imu[:in_the_air, :3], [[0.0, 0.0, -50.0]] * in_the_air, atol=1e-12)
        assert_allclose(imu[:in_the_air, 3:], [[*pull, 0.0]] * in_the_air, atol=1e-12)
        assert imu[in_the_air:].tolist() == [[0.0, 0.0, 0.0, 0.0, 0.0, 9.81]]

    bench.set(launch__speed=0.0, launch__roll=30.0, launch__pitch=-20.0)
    bench.reset()
    bench.throw()
    bench.go()
    odometry = bench.wait_for(in_the_air + 1)
    imu = numbers(bench[topics.IMU], conversions.IMU_FIELDS)
    spin = bench[topics.IMU][-1]
    assert np.linalg.norm(imu[-1, 3:]) == pytest.approx(9.81, rel=1e-15)
    # Tilted by acos(cos 30 cos 20) from the vertical, however far it has turned about its axis.
    upright = math.cos(math.radians(30.0)) * math.cos(math.radians(20.0))
    assert imu[-1, 5] == pytest.approx(9.81 * upright, rel=1e-14)
    assert odometry[-1].pose.pose.position.z == spin.angular_velocity.z == 0.0
