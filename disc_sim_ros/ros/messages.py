"""The fields of messages in the order of the physics' numbers, and numbers from messages.

To messages: each tuple of field paths has the order of the numbers of the function beside it;
`cdr_template.CdrTemplate` takes both. The functions, with the turn from the paper's axes to
REP-103, are in `physics.frames`, `physics.imu` and `physics.trajectory`.

From messages: every number is checked, and turned to the paper's axes by `physics.frames`.
docs/axes.md explains both kinds of axes.
"""

import math
from typing import Any

from disc_sim_ros import topics
from disc_sim_ros.arrays import Vector
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import frames as paper_frames
from disc_sim_ros.physics import imu as ideal_imu
from disc_sim_ros.physics import trajectory
from disc_sim_ros.physics.frames import flip_yz
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.kernels.rotation import Quaternion
from disc_sim_ros.quantities import (
    CONTROL,
    CONTROL_MOMENT,
    LAUNCH,
    MEAN_WIND,
    ORIENTATION,
    POSITION,
    VELOCITY,
)
from disc_sim_ros.topics import Frames
from disc_sim_ros.units import NANOSECONDS
from disc_sim_ros.validation import Quantity

_VECTOR = ('x', 'y', 'z')
_QUATERNION = ('x', 'y', 'z', 'w')


def _paths(path: str, names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f'{path}.{name}' for name in names)


POSE_FIELDS = _paths('pose.position', _VECTOR) + _paths('pose.orientation', _QUATERNION)
TWIST_FIELDS = _paths('twist.linear', _VECTOR) + _paths('twist.angular', _VECTOR)
ODOMETRY_FIELDS = _paths('pose', POSE_FIELDS) + _paths('twist', TWIST_FIELDS)
TRANSFORM_FIELDS = _paths('transform.translation', _VECTOR) + _paths(
    'transform.rotation', _QUATERNION
)
SPIN_TRANSFORM_FIELDS = ('transform.rotation.z', 'transform.rotation.w')
JOINT_FIELDS = ('position.0', 'velocity.0')
IMU_FIELDS = _paths('angular_velocity', _VECTOR) + _paths('linear_acceleration', _VECTOR)
TORQUE_FIELDS = _paths('wrench.torque', _VECTOR)
WRENCH_FIELDS = _paths('wrench.force', _VECTOR) + TORQUE_FIELDS
VECTOR_FIELDS = _paths('vector', _VECTOR)

# Quantities of x, y, z.
_MOMENT = tuple(CONTROL_MOMENT.values())
_COEFFICIENTS = tuple(CONTROL.values())
_WIND = tuple(MEAN_WIND.values())
_POSITION = (POSITION, POSITION, POSITION)
_SPEED = LAUNCH['speed']
_VELOCITY = (VELOCITY, VELOCITY, VELOCITY)
_RATES = (LAUNCH['roll_rate'], LAUNCH['pitch_rate'], LAUNCH['spin'])
_ANY_RATES = (_RATES[2],) * 3  # about axes that are not those of the disc; the spin is fastest
_UNIT_NORM = 1e-3  # largest deviation of a quaternion from length 1

# The numbers in the order of the fields.
pose = paper_frames.pose  # POSE_FIELDS and TRANSFORM_FIELDS
odometry = paper_frames.odometry  # ODOMETRY_FIELDS
spin_transform = paper_frames.spin_transform  # SPIN_TRANSFORM_FIELDS
spin_joint = paper_frames.spin_joint  # JOINT_FIELDS
imu = ideal_imu.reading  # IMU_FIELDS
quantities = trajectory.quantities  # each a std_msgs/Float64 with the name of its field as topic
Quantities = trajectory.Quantities
moment_axes = paper_frames.moment_axes
Six = ideal_imu.Reading


def stamp(nanoseconds: int) -> tuple[int, int]:
    """Return a time in nanoseconds as the seconds and nanoseconds of a message."""
    return divmod(nanoseconds, NANOSECONDS)


def moment_from_wrench(message: Any, frames: Frames) -> tuple[float, float, float, int]:
    """Return L, M, N in the paper's signs [N m] and their axes, from a commanded moment.

    Args:
        message: geometry_msgs/WrenchStamped in `disc`, `disc_body` or `disc_air`; an empty frame
            is `disc_air`. Its force must be 0.
        frames: Names of the frames.

    Raises:
        ConfigError: A force, a torque out of range, another frame.
    """
    allowed = moment_axes(frames)
    frame = _frame(topics.CMD_MOMENT, message, allowed, frames.disc_air)
    for name in _VECTOR:
        force = getattr(message.wrench.force, name)
        if force != 0.0:
            thing = f'{topics.CMD_MOMENT} wrench.force.{name}'
            raise ConfigError(thing, force, 'must be 0: a disc takes torques, not forces')
    torque = _vector(f'{topics.CMD_MOMENT} wrench.torque', message.wrench.torque, _MOMENT)
    return *flip_yz(torque), allowed[frame]


def coefficients_from_vector(message: Any, frames: Frames) -> Vector:
    """Return C_L, C_M, C_N, from x, y, z of a command, which has the paper's signs.

    Args:
        message: geometry_msgs/Vector3Stamped. Coefficients always act about the axes of the flow:
            its frame is empty or `disc_air`.
        frames: Names of the frames.

    Raises:
        ConfigError: A coefficient out of range, another frame.
    """
    _frame(topics.CMD_COEFFICIENTS, message, (frames.disc_air,), frames.disc_air)
    return _vector(f'{topics.CMD_COEFFICIENTS} vector', message.vector, _COEFFICIENTS)


def wind_from_vector(message: Any, frames: Frames) -> Vector:
    """Return the velocity of the air in earth axes 1 [m/s].

    Args:
        message: geometry_msgs/Vector3Stamped in `map`; an empty frame is `map`.
        frames: Names of the frames.

    Raises:
        ConfigError: A wind out of range, another frame.
    """
    _frame(topics.WIND, message, (frames.map,), frames.map)
    return flip_yz(_vector(f'{topics.WIND} vector', message.vector, _WIND))


def release_from_odometry(message: Any, frames: Frames) -> State:
    """Return the state at release, spin angle 0, from another node's throw.

    The caller checks that the release is not below the ground.

    Args:
        message: nav_msgs/Odometry of `disc` in `map`, its twist in `disc`, over the ground.
            Empty frames mean these. Covariances have no effect.
        frames: Names of the frames.

    Raises:
        ConfigError: A number out of range, no spin, no unit quaternion, another frame.
    """
    topic = topics.THROW
    _frame(topic, message, (frames.map,), frames.map)
    child = message.child_frame_id
    if child not in {'', frames.disc}:
        raise ConfigError(
            f'{topic} child_frame_id', child, f'give {frames.disc} or leave it empty'
        )

    at, twist = message.pose.pose, message.twist.twist
    X, Y, Z = flip_yz(_vector(f'{topic} pose.pose.position', at.position, _POSITION))
    e = _attitude(f'{topic} pose.pose.orientation', at.orientation)
    linear = _vector(f'{topic} twist.twist.linear', twist.linear, _VELOCITY)
    if math.hypot(*linear) > _SPEED.highest:
        allowed = f'give a speed of at most {_SPEED.highest:g} {_SPEED.unit}'
        raise ConfigError(f'{topic} twist.twist.linear', linear, allowed)
    angular = _vector(f'{topic} twist.twist.angular', twist.angular, _RATES)
    if angular[2] == 0.0:
        raise ConfigError(f'{topic} twist.twist.angular.z', 0.0, 'a throw needs spin')
    VX, VY, VZ = paper_frames.earth_from_body(e, flip_yz(linear))
    p, q, r = flip_yz(angular)
    return State(X, Y, Z, VX, VY, VZ, *e, p, q, r, sigma=0.0)


def pose_from_entity(message: Any, frames: Frames) -> tuple[Vector, Quaternion]:
    """Return position [m] and attitude in the paper's axes, from a simulation_interfaces state.

    Args:
        message: simulation_interfaces/EntityState in `map`; an empty frame is `map`.
        frames: Names of the frames.

    Raises:
        ConfigError: A number out of range, no unit quaternion, another frame.
    """
    _frame('state', message, (frames.map,), frames.map)
    at = message.pose
    position = flip_yz(_vector('state.pose.position', at.position, _POSITION))
    return position, _attitude('state.pose.orientation', at.orientation)


def twist_from_entity(message: Any, e: Quaternion, frames: Frames) -> tuple[Vector, Vector]:
    """Return V in earth axes 1 [m/s] and p, q, r [rad/s], from a simulation_interfaces state.

    Args:
        message: simulation_interfaces/EntityState; its twist is in `map`, too.
        e: Attitude of the disc.
        frames: Names of the frames.

    Raises:
        ConfigError: A number out of range, another frame.
    """
    _frame('state', message, (frames.map,), frames.map)
    thing = 'state.twist.linear'
    linear = _vector(thing, message.twist.linear, _VELOCITY)
    if math.hypot(*linear) > _SPEED.highest:
        allowed = f'give a speed of at most {_SPEED.highest:g} {_SPEED.unit}'
        raise ConfigError(thing, linear, allowed)
    angular = _vector('state.twist.angular', message.twist.angular, _ANY_RATES)
    rates = paper_frames.body_from_earth(e, flip_yz(angular))
    for rate, quantity in zip(rates, _RATES, strict=True):
        quantity.check(rate, f'state.twist.angular: {quantity.name}')
    return flip_yz(linear), rates


def _attitude(thing: str, orientation: Any) -> Quaternion:
    """Return the unit quaternion of despun axes 2 in axes 1, scalar first."""
    xyzw = [
        ORIENTATION.check(getattr(orientation, name), f'{thing}.{name}') for name in _QUATERNION
    ]
    norm = math.hypot(*xyzw)
    if abs(norm - 1.0) > _UNIT_NORM:
        allowed = f'give a quaternion of length 1, not {norm:g}'
        raise ConfigError(thing, tuple(xyzw), allowed)
    e0, e1, e2, e3 = (paper_frames.paper_quaternion(xyzw) / norm).tolist()
    return e0, e1, e2, e3


def _vector(thing: str, vector: Any, quantities: tuple[Quantity, ...]) -> Vector:
    """Return x, y, z of a message as finite floats in the ranges of three quantities."""
    x, y, z = (
        quantity.check(getattr(vector, name), f'{thing}.{name}')
        for name, quantity in zip(_VECTOR, quantities, strict=True)
    )
    return x, y, z


def _frame(topic: str, message: Any, allowed: Any, default: str) -> str:
    """Return the frame of a message, or the default if it is empty."""
    frame: str = message.header.frame_id or default
    if frame not in allowed:
        advice = f'give {", ".join(allowed)}, or leave it empty for {default}'
        raise ConfigError(f'{topic} header.frame_id', frame, advice)
    return frame
