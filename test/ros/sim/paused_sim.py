"""A simulator that is paused until a test lets it go.

Simulated time stands at START while a test prepares a flight: the simulator starts as fast as
possible with nothing to fly, is paused, gets its throw and commands, and is let go at some pace.
"""

from dataclasses import fields, replace
from functools import reduce

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, String

from disc_sim_ros import topics
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.kernels.equations import DISC, DISC_AIR, DISC_BODY
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.cdr_template import assign

SECOND = 1_000_000_000  # ns
START = 1000 * SECOND  # stamp at which the simulator is paused
MS = 1_000_000
FLOATS = ('airspeed', 'angle_of_attack', 'absolute_attitude', 'advance_ratio', 'spin_rate')
# In the order of subscription. Discovery keeps it: once odom arrives, the others are matched.
TYPES = {
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
NOT_PERIODIC = tuple(TYPES)[:6]
COMMANDS = {
    topics.CMD_MOMENT: WrenchStamped,
    topics.CMD_COEFFICIENTS: Vector3Stamped,
    topics.WIND: Vector3Stamped,
    topics.THROW: Odometry,
}
AXES_OF = {'disc': DISC, 'disc_body': DISC_BODY, 'disc_air': DISC_AIR, '': DISC_AIR}

# A second of wobbling flight before it lands.
SHORT = Launch(speed=13.0, pitch=-3.0, roll_rate=2.0, pitch_rate=-1.0, spin=40.0, height=1.0)


# ---- the simulator ----


class PausedSim:
    """A paused simulator, the messages that it publishes, and its command topics.

    Attributes:
        sim: Its process.
        received: Messages by topic, since the last `ros.forget`.
    """

    def __init__(self, ros, parameters, *names, namespace=''):
        start = {'auto_throw': False, 'real_time_factor': 0.0, 'start_time': START / SECOND}
        self.ros = ros
        self.sim = ros.start(start | parameters, namespace=namespace)
        self.received = {
            name: ros.subscribe(message_type, f'{namespace}/{name}')
            for name, message_type in TYPES.items()
            if name in names or name == topics.ODOM
        }
        self._publishers = {
            name: ros.node.create_publisher(message_type, f'{namespace}/{name}', 1000)
            for name, message_type in COMMANDS.items()
        }

    def ready(self):
        """Wait until it is paused and its messages arrive."""
        self.ros.pause(self.sim)
        self.reset()
        return self

    def __getitem__(self, name):
        return self.received[name]

    def reset(self):
        """Bring the paused simulator back to flight 0, and forget what it published."""
        odom = self[topics.ODOM]
        self.ros.forget()
        self.ros.spin_until(lambda: self.ros.call(self.sim, 'reset').success and odom, 'odom')
        self.ros.forget()

    def send(self, *commands):
        """Send commands, pairs of topic and message, and wait until they have arrived."""
        for topic, message in commands:
            self.ros.send(self.sim, self._publishers[topic], message)

    def throw(self):
        response = self.ros.call(self.sim, 'throw')
        assert response.success, response.message

    def set(self, **values):
        """Set parameters; `__` in a name is a dot."""
        changes = {name.replace('__', '.'): value for name, value in values.items()}
        result = self.ros.set(self.sim, changes)
        assert result.successful, result.reason

    def go(self, pace=0.0):
        """Let time go on at a pace: a real_time_factor."""
        self.set(real_time_factor=pace)
        self.ros.resume(self.sim)

    def wait_for(self, count):
        """Wait for `count` messages on every periodic topic, and return those of odom."""
        periodic = [m for name, m in self.received.items() if name not in NOT_PERIODIC]
        self.ros.spin_until(lambda: all(len(m) >= count for m in periodic), f'{count} messages')
        return self[topics.ODOM][:count]

    def all_of(self, name, count):
        """Wait until there are `count` messages of a topic, and return all there are."""
        received = self[name]
        self.ros.spin_until(lambda: len(received) >= count, f'{count} of {name}')
        return received

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


def stamped(message_type, at, values, paths, frame=''):
    """Return a message with a stamp [ns] and these numbers."""
    message = message_type()
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(at, SECOND)
    message.header.frame_id = frame
    for path, value in zip(paths, values, strict=True):
        assign(message, path, value)
    return message


def coefficients(at, *values):
    message = stamped(Vector3Stamped, at, values, messages.VECTOR_FIELDS)
    return topics.CMD_COEFFICIENTS, message


def moment(at, frame, *torque):
    message = stamped(WrenchStamped, at, torque, messages.WRENCH_FIELDS[3:], frame)
    return topics.CMD_MOMENT, message


def wind(at, *values):
    return topics.WIND, stamped(Vector3Stamped, at, values, messages.VECTOR_FIELDS)


def ns(message):
    """Return the stamp of a message [ns]."""
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def numbers(received, paths):
    """Return these fields of messages, shape (messages, fields)."""

    def value(at, name):
        return at[int(name)] if name.isdigit() else getattr(at, name)

    return np.array([[reduce(value, p.split('.'), m) for p in paths] for m in received])


def applied(received, paths, since=START):
    """Return when commands began to act [ns after `since`], and their numbers."""
    values = numbers(received, paths).tolist()
    return [(ns(m) - since, *row) for m, row in zip(received, values, strict=True)]


# ---- the same flight by `FlightSimulator` ----


def resimulated(setup, release, count, every, changes=()):
    """Return a `FlightSimulator` and `count` states of its flight, one in `every` steps.

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


def control_change(**inputs):
    """Return a change of some control inputs, in the paper's signs."""

    def change(sim):
        sim.control = sim.control._replace(**inputs)

    return change


def wind_change(x, y, z):
    """Return a change of the mean wind, given in `map`."""
    return lambda sim: sim.set_wind(replace(sim.setup.wind, mean=(x, -y, -z)))


def assert_flown(odometry, states):
    """Positions, attitudes and rates are those of `FlightSimulator`, to the last bit."""
    published, s = numbers(odometry, messages.ODOMETRY_FIELDS), np.array(states)
    assert_array_equal(published[:, :3], frames.map_from_paper(s[:, :3]))
    assert_array_equal(published[:, 3:7], frames.message_quaternion(s[:, 6:10]))
    assert_array_equal(published[:, 10:], frames.map_from_paper(s[:, 10:13]))
    # Velocities are turned into the disc: sums of three products of at most 20 m/s.
    velocity = Rotation.from_quat(published[:, 3:7]).apply(published[:, 7:10])
    assert_allclose(velocity, frames.map_from_paper(s[:, 3:6]), rtol=0.0, atol=1e-13)
