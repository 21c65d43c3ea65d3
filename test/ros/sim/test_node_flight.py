"""sim_node in its own process: its flights are those of `physics`, and its messages agree.

Positions, attitudes and rates are compared to the last bit: messages only change their signs.
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
from disc_sim_ros.ros import messages
from ros.sim.paused_sim import (
    FLOATS,
    MS,
    NOT_PERIODIC,
    SECOND,
    SHORT,
    START,
    TYPES,
    PausedSim,
    assert_flown,
    coefficients,
    control_change,
    launch_parameters,
    moment,
    ns,
    numbers,
    resimulated,
    wind,
    wind_change,
)

pytestmark = pytest.mark.ros


# ---- time ----


def test_the_flight_does_not_depend_on_the_clock(ros, request):
    """Same launch, commands and seeds at four paces, on a busy machine and with a stall."""
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
    subscribed = (topics.IMU, *NOT_PERIODIC)
    setup = Setup(disc=FRISBEE, wind=Wind(mean=(2.0, -1.0, 0.0), turbulence=15.0, seed=7))
    changes = [
        (0, control_change(M=-0.01, axes=DISC)),
        (101, control_change(C_L=0.02, C_M=-0.01, C_N=0.001)),
        (200, control_change(L=0.05, M=0.0, N=-0.001, axes=DISC_BODY)),
        (300, control_change(C_L=-0.02, C_M=0.0, C_N=0.0)),
        (450, wind_change(-3.0, 1.0, 0.5)),
        (450, control_change(L=0.0, M=0.0, N=0.0)),
        (550, control_change(C_L=0.0)),
    ]
    sim, states = resimulated(setup, SHORT.state(), 401, 5, changes)
    count = math.ceil(sim.touch_time * 200.0) + 1  # the last one is on the ground
    assert 200 < count < 401
    nodes = [PausedSim(ros, parameters, *subscribed, namespace=f'/{name}') for name in paces]
    for node in nodes:
        node.ready()
    for node in nodes:
        node.send(*commands)
        node.throw()
    others = [subprocess.Popen([sys.executable, '-c', 'while True: pass']) for _ in range(2)]
    for busy in others:
        request.addfinalizer(busy.wait)
        request.addfinalizer(busy.kill)
    for node, pace in zip(nodes, paces.values(), strict=True):
        if pace in {0.0, 10.0}:  # they would go on to take a core to themselves
            node.go(pace)
            node.wait_for(count)
            ros.pause(node.sim)
    for node, pace in zip(nodes, paces.values(), strict=True):
        if pace not in {0.0, 10.0}:
            node.go(pace)
    stalled = nodes[-1]
    stalled.wait_for(20)
    stalled.sim.process.send_signal(signal.SIGSTOP)
    nodes[2].wait_for(count // 2)
    for busy in others:  # the other tests need the cores
        busy.kill()
    nodes[2].wait_for_event('landed')
    stalled.sim.process.send_signal(signal.SIGCONT)
    for node in nodes:
        landing = node.wait_for_event('landed')
        assert float(landing['flight_time_s']) == sim.touch_time
        odometry = node.wait_for(count)
        assert [ns(m) - START for m in odometry] == [5 * MS * k for k in range(count)]
        assert_flown(odometry, states[:count])
        # The other messages are the same to the last digit, too.
        for topic, number in {topics.IMU: count, **CHANGES}.items():
            published, first = (n.all_of(topic, number)[:count] for n in (node, nodes[0]))
            if topic == topics.FLIGHT_EVENTS:
                assert [e.values for e in published] == [e.values for e in first]
            else:
                assert published == first


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
    """The stamp of message k is START + floor(k / rate): no error adds up, no throw shifts it."""
    rates = {'physics_rate': float(physics), 'publish_rate': float(publish)}
    node = PausedSim(
        ros, rates | {'throw_period': 0.333}, *NOT_PERIODIC, topics.JOINT_STATES
    ).ready()
    node.throw()
    node.go(20.0)
    releases = [ns(m) for m in node.all_of(topics.RELEASE, 4)[:4]]
    count = math.ceil(3 * 0.333 * publish)
    odometry = node.wait_for(count)
    assert [ns(m) for m in odometry] == [START + k * SECOND // publish for k in range(count)]
    assert [ns(m) for m in node[topics.JOINT_STATES][:count]] == [ns(m) for m in odometry]
    # A throw is due at the first message not before the end of its period.
    wait = math.ceil(0.333 * publish)
    assert releases == [START + wait * n * SECOND // publish for n in range(4)]


def test_new_rates_begin_with_a_throw(ros):
    node = PausedSim(ros, {'physics_rate': 1000.0, 'publish_rate': 200.0}, *NOT_PERIODIC).ready()
    node.throw()
    node.go(5.0)
    for flight, (physics, publish) in enumerate([(1000, 250), (3000, 100), (770, 70)], start=2):
        node.wait_for(1)
        node.set(physics_rate=float(physics), publish_rate=float(publish))
        node.throw()
        release = ns(node.all_of(topics.RELEASE, flight)[-1])
        stamps = [ns(m) for m in node.since(release, 30)]
        assert stamps == [release + k * SECOND // publish for k in range(30)]


# ---- one step on all topics ----


def test_all_messages_of_one_step_agree(ros):
    """They agree with each other, with `physics`, and with the laws of motion."""
    parameters = launch_parameters(SHORT) | {
        'physics_rate': 4000.0,
        'publish_rate': 1000.0,
        'aero': 'linear',  # finite differences have an error at each kink of the table
        'imu.offset': list(OFFSET),
        'wind.x': 3.0,
        'wind.y': -2.0,
        'wind.roughness_length': 0.03,
    }
    node = PausedSim(ros, parameters, *TYPES).ready()
    node.throw()
    node.go(1.0)
    count = 400
    odometry = node.wait_for(count)
    ros.pause(node.sim)  # 14 topics at 1 kHz are more than a node in Python can take
    transforms = node.all_of(topics.TRANSFORM, 2 * count)[: 2 * count]
    published = {name: received[:count] for name, received in node.received.items()}
    tilts, turns = transforms[::2], transforms[1::2]

    for received, parent, child in (
        (odometry, 'map', 'disc'),
        (published[topics.POSE], 'map', None),
        (tilts, 'map', 'disc'),
        (turns, 'disc', 'disc_body'),
        (published[topics.JOINT_STATES], '', None),
        (published[topics.IMU], 'disc_body', None),
        (published[topics.AERO_WRENCH], 'disc', None),
    ):
        assert [ns(m) for m in received] == [START + MS * k for k in range(count)]
        assert {m.header.frame_id for m in received} == {parent}
        assert {getattr(m, 'child_frame_id', None) for m in received} == {child}

    # The same numbers in other messages.
    odom = numbers(odometry, messages.ODOMETRY_FIELDS)
    assert_array_equal(numbers(published[topics.POSE], messages.POSE_FIELDS), odom[:, :7])
    assert_array_equal(numbers(tilts, messages.TRANSFORM_FIELDS), odom[:, :7])
    angle, rate = numbers(published[topics.JOINT_STATES], messages.JOINT_FIELDS).T
    assert_array_equal(rate, odom[:, 12])
    spin = Rotation.from_quat(numbers(turns, messages.TRANSFORM_FIELDS)[:, 3:])
    # Rounding of angles up to 30 rad, and of rates of 40 rad/s.
    assert_allclose(spin.as_rotvec(), np.outer(angle, (0.0, 0.0, 1.0)), atol=1e-13)
    imu = numbers(published[topics.IMU], messages.IMU_FIELDS)
    assert_allclose(spin.apply(imu[:, :3]), odom[:, 10:], rtol=0.0, atol=1e-13)

    setup = Setup(
        disc=FRISBEE,
        aero='linear',
        wind=Wind(mean=(3.0, 2.0, 0.0), roughness_length=0.03),
        step=1.0 / 4000.0,
    )
    wrench = numbers(published[topics.AERO_WRENCH], messages.WRENCH_FIELDS)
    floats = {name: published[name] for name in FLOATS}
    assert_is_that_of_physics(setup, odometry, angle, wrench, floats)
    assert_obeys_the_laws_of_motion(odom, spin, imu, wrench)


def assert_is_that_of_physics(setup, odometry, angle, wrench, floats):
    """State, loads and quantities are those of `physics`."""
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
    for (name, received), expected in zip(floats.items(), quantities, strict=True):
        values = numbers(received, ['data'])[:, 0]
        assert_allclose(values, expected[:count], rtol=1e-12, atol=1e-13, err_msg=name)
    sim = FlightSimulator(setup, SHORT.state())
    for row in wrench:
        observed = sim.observe()
        force, moment = frames.flip_yz(observed[6:9]), frames.flip_yz(observed[9:12])
        assert_array_equal(row, [*force, *moment])
        sim.advance(4)


def assert_obeys_the_laws_of_motion(odom, spin, imu, wrench):
    """Velocities, rates and specific force are those of the motion of the poses alone.

    Finite differences of sixth order over h = 1 ms: rounding of positions by 2e-15 m makes errors
    of 1e-11 m/s and 1e-8 m/s^2; with a spin of 40 rad/s and a nutation of 80 rad/s, (80 h)^6 / 140
    of each rate is missing, and RK4 itself lags by (20 h)^4 / 120 of it.
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
    specific_force = plastic[INNER].inv().apply(acceleration + up)
    assert_allclose(imu[INNER, 3:], specific_force, atol=1e-5)
    assert np.abs(specific_force[:, 0]).min() > 100.0  # 40 rad/s at 0.1 m
    force = FRISBEE.mass * (slope(velocity) + up)
    assert_allclose(tilt.apply(wrench[:, :3])[INNER], force, atol=1e-8)


OFFSET = (0.1, 0.05, 0.02)  # m, of the IMU
INNER = slice(3, -3)  # where there are differences
SLOPE = (1.0, -9.0, 45.0, 0.0, -45.0, 9.0, -1.0)  # over 60 h; a convolution reverses it
BEND = (2.0, -27.0, 270.0, -490.0, 270.0, -27.0, 2.0)  # over 180 h^2


def slope(values):
    """Return the derivative by time of samples at 1 kHz."""
    return np.column_stack([np.convolve(x, SLOPE, 'valid') for x in values.T]) / 60e-3


def turning(rotations):
    """Return the angular velocity [rad/s] in the rotating axes, from quaternions at 1 kHz."""
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
    """0 at the centre of a falling disc, centripetal acceleration beside it, +g at rest."""
    falling = Launch(speed=5.0, pitch=0.0, roll=0.0, spin=50.0, height=1.0)
    parameters = launch_parameters(falling) | {'air_density': 0.0}
    node = PausedSim(ros, parameters, topics.IMU, *NOT_PERIODIC).ready()
    in_the_air = math.floor(math.sqrt(2.0 / 9.81) * 200.0) + 1
    # At 50 rad/s and 0.1 m: 250 m/s^2.
    for offset, centripetal in (
        ((0.0, 0.0, 0.0), (0.0, 0.0)),
        ((0.1, -0.02, 0.01), (-250.0, 50.0)),
    ):
        node.set(imu__offset=list(offset))
        node.reset()
        node.throw()
        node.go()
        node.wait_for(in_the_air + 1)
        ros.pause(node.sim)
        imu = numbers(node[topics.IMU], messages.IMU_FIELDS)
        assert_allclose(imu[:in_the_air, :3], [[0.0, 0.0, -50.0]] * in_the_air, atol=1e-12)
        assert_allclose(imu[:in_the_air, 3:], [[*centripetal, 0.0]] * in_the_air, atol=1e-12)
        assert imu[in_the_air:].tolist() == [[0.0, 0.0, 0.0, 0.0, 0.0, 9.81]]

    node.set(launch__speed=0.0, launch__roll=30.0, launch__pitch=-20.0)
    node.reset()
    node.throw()
    node.go()
    odometry = node.wait_for(in_the_air + 1)
    imu = numbers(node[topics.IMU], messages.IMU_FIELDS)
    spin = node[topics.IMU][-1]
    assert np.linalg.norm(imu[-1, 3:]) == pytest.approx(9.81, rel=1e-15)
    # Tilted by acos(cos 30 cos 20) from the vertical, whatever its spin angle.
    upright = math.cos(math.radians(30.0)) * math.cos(math.radians(20.0))
    assert imu[-1, 5] == pytest.approx(9.81 * upright, rel=1e-14)
    assert odometry[-1].pose.pose.position.z == spin.angular_velocity.z == 0.0
