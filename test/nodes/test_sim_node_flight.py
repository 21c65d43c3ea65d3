"""sim_node in a process of its own flies what the core flies, and all that it says agrees.

Time stands still at START while a test prepares a flight: the simulator starts as fast as
possible with nothing to fly, is paused, gets its throw and commands, and is let go at some pace.
Positions, attitudes and rates are compared to the last bit: messages only turn their signs.
"""

from dataclasses import fields, replace
from functools import reduce
import json
import math
import signal
import subprocess
import sys

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from physics import FRISBEE
import pytest
from scipy.spatial.transform import Rotation
import yaml

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, String

from disc_sim_ros.cli import fly as fly_command
from disc_sim_ros.core import axes, catalogue
from disc_sim_ros.core.air import Air, Wind
from disc_sim_ros.core.equations import DISC, DISC_AIR, DISC_BODY, State
from disc_sim_ros.core.flight import Setup, fly
from disc_sim_ros.core.launch import Launch
from disc_sim_ros.core.simulator import FlightSimulator
from disc_sim_ros.nodes import conversions, topics
from disc_sim_ros.nodes.wire import assign

pytestmark = pytest.mark.ros

SECOND = 1_000_000_000  # ns
START = 1000 * SECOND  # stamp at which time stands still
MS = 1_000_000
FLOATS = ('airspeed', 'angle_of_attack', 'absolute_attitude', 'advance_ratio', 'spin_rate')
# In the order of subscription. Discovery keeps it: who hears odom has a match for the others.
KINDS = {
    topics.FLIGHT_EVENTS: DiagnosticStatus,
    topics.CONFIGURATION: String,
    topics.RELEASE: Odometry,
    topics.APPLIED_MOMENT: WrenchStamped,
    topics.APPLIED_COEFFICIENTS: Vector3Stamped,
    topics.APPLIED_WIND: Vector3Stamped,
    topics.TRANSFORM: TransformStamped,
    topics.POSE: PoseStamped,
    topics.JOINT_STATES: JointState,
    topics.IMU: Imu,
    topics.AERO_WRENCH: WrenchStamped,
    **dict.fromkeys(FLOATS, Float64),
    topics.ODOM: Odometry,
}
ONCE = tuple(KINDS)[:6]
COMMANDS = {
    topics.CMD_MOMENT: WrenchStamped,
    topics.CMD_COEFFICIENTS: Vector3Stamped,
    topics.WIND: Vector3Stamped,
    topics.THROW: Odometry,
}
AXES_OF = {'disc': DISC, 'disc_body': DISC_BODY, 'disc_air': DISC_AIR, '': DISC_AIR}

# A second of wobbling flight before it lands.
SHORT = Launch(speed=13.0, pitch=-3.0, roll_rate=2.0, pitch_rate=-1.0, spin=40.0, height=1.0)


# ---- a simulator that waits ----


class Bench:
    """A simulator whose time stands still, what it says, and its command topics.

    Attributes:
        sim: Its process.
        heard: Messages by topic, since the last `ros.forget`.
    """

    def __init__(self, ros, parameters, *names, namespace=''):
        still = {'auto_throw': False, 'real_time_factor': 0.0, 'start_time': START / SECOND}
        self.ros = ros
        self.sim = ros.start(still | parameters, namespace=namespace)
        self.heard = {
            name: ros.listen(kind, f'{namespace}/{name}')
            for name, kind in KINDS.items()
            if name in names or name == topics.ODOM
        }
        self._publishers = {
            name: ros.node.create_publisher(kind, f'{namespace}/{name}', 1000)
            for name, kind in COMMANDS.items()
        }

    def ready(self):
        """Wait until it stands still and is heard."""
        self.ros.pause(self.sim)
        self.reset()
        return self

    def __getitem__(self, name):
        return self.heard[name]

    def reset(self):
        """Bring a paused simulator back to flight 0, and forget what it said."""
        odom = self.heard[topics.ODOM]
        self.ros.forget()
        self.ros.spin_until(lambda: self.ros.call(self.sim, 'reset').success and odom, 'odom')
        self.ros.forget()

    def send(self, *messages):
        """Send commands, each to the topic of its kind, and wait until they have arrived."""
        for topic, message in messages:
            self.ros.send(self.sim, self._publishers[topic], message)

    def throw(self):
        response = self.ros.call(self.sim, 'throw')
        assert response.success, response.message

    def set(self, **values):
        """Set parameters; `__` in a name is a point."""
        changes = {name.replace('__', '.'): value for name, value in values.items()}
        result = self.ros.set(self.sim, changes)
        assert result.successful, result.reason

    def go(self, pace=0.0):
        """Let time go on at a pace: a real_time_factor."""
        self.set(real_time_factor=pace)
        self.ros.pause(self.sim, still=False)

    def wait_for(self, count):
        """Wait until every topic of states has told `count` states, and return these of odom."""
        states = [heard for name, heard in self.heard.items() if name not in ONCE]
        self.ros.spin_until(
            lambda: all(len(heard) >= count for heard in states), f'{count} messages'
        )
        return self[topics.ODOM][:count]

    def all_of(self, name, count):
        """Wait for the last of `count` messages of a topic, and return all there are."""
        heard = self.heard[name]
        self.ros.spin_until(lambda: len(heard) >= count, f'{count} of {name}')
        return heard

    def since(self, release, count):
        """Wait for `count` messages of odom from a release on, and return them."""
        odom = self[topics.ODOM]
        self.ros.spin_until(lambda: sum(ns(m) >= release for m in odom) >= count)
        return [m for m in odom if ns(m) >= release][:count]

    def events(self, name):
        """Return the values of each event of this name."""
        return [
            {item.key: item.value for item in event.values}
            for event in self[topics.FLIGHT_EVENTS]
            if event.name.endswith(f'sim_node: {name}')
        ]

    def wait_for_event(self, name, count=1):
        """Wait for an event that happens for the `count`-th time, and return its values."""
        self.ros.spin_until(lambda: len(self.events(name)) >= count, f'{name}, {count}')
        return self.events(name)[count - 1]


def launch_parameters(launch):
    return {f'launch.{field.name}': getattr(launch, field.name) for field in fields(Launch)}


# ---- messages ----


def stamped(kind, at, values, paths, frame=''):
    """Return a message with a stamp [ns] and these numbers."""
    message = kind()
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(at, SECOND)
    message.header.frame_id = frame
    for path, value in zip(paths, values, strict=True):
        assign(message, path, value)
    return message


def coefficients(at, *values):
    message = stamped(Vector3Stamped, at, values, conversions.VECTOR_FIELDS)
    return topics.CMD_COEFFICIENTS, message


def moment(at, frame, *torque):
    message = stamped(WrenchStamped, at, torque, conversions.WRENCH_FIELDS[3:], frame)
    return topics.CMD_MOMENT, message


def wind(at, *values):
    return topics.WIND, stamped(Vector3Stamped, at, values, conversions.VECTOR_FIELDS)


def ns(message):
    """Return the stamp of a message [ns]."""
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def numbers(messages, paths):
    """Return these fields of messages, shape (messages, fields)."""

    def value(at, name):
        return at[int(name)] if name.isdigit() else getattr(at, name)

    return np.array([[reduce(value, p.split('.'), m) for p in paths] for m in messages])


def applied(messages, paths, since=START):
    """Return when commands began to act [ns after `since`], and their numbers."""
    values = numbers(messages, paths).tolist()
    return [(ns(m) - since, *row) for m, row in zip(messages, values, strict=True)]


# ---- the core ----


def replayed(setup, release, count, every, changes=()):
    """Return what the core flies: the simulator, and `count` states, one in `every` steps.

    `changes` are pairs of a step and a function that is called with the simulator before it.
    """
    sim = FlightSimulator(setup, release)
    states = [sim.state]
    for step in range((count - 1) * every):
        for at, change in changes:
            if at == step:
                change(sim)
        sim.advance(1)
        if (step + 1) % every == 0:
            states.append(sim.state)
    return sim, states


def steered(**inputs):
    """Return a change of some control inputs, in the paper's signs."""

    def change(sim):
        sim.control = sim.control._replace(**inputs)

    return change


def blown(x, y, z):
    """Return a change of the mean wind, given in `map`."""
    return lambda sim: sim.set_wind(replace(sim.setup.wind, mean=(x, -y, -z)))


def assert_flown(odometry, states):
    """Positions, attitudes and rates are those of the core, to the last bit."""
    found, s = numbers(odometry, conversions.ODOMETRY_FIELDS), np.array(states)
    assert_array_equal(found[:, :3], axes.map_from_paper(s[:, :3]))
    assert_array_equal(found[:, 3:7], axes.message_quaternion(s[:, 6:10]))
    assert_array_equal(found[:, 10:], axes.map_from_paper(s[:, 10:13]))
    # Velocities are turned into the disc: sums of three products of at most 20 m/s.
    velocity = Rotation.from_quat(found[:, 3:7]).apply(found[:, 7:10])
    assert_allclose(velocity, axes.map_from_paper(s[:, 3:6]), rtol=0.0, atol=1e-13)


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
        assert_array_equal(row, [*axes.turned(seen[6:9]), *axes.turned(seen[9:12])])
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
        disc=catalogue.from_document(told['disc'], told['disc_file']),
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
    x, y, _ = axes.turned(core.touch[:3])
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
