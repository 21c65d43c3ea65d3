"""Numbers of the core to numbers of messages and back: pure functions, and no clock.

The core has the paper's axes, z down, messages have REP-103's, z up; docs/axes.md explains both.
To messages, each function returns plain floats in the order of the field names beside it, which
`cdr_template.CdrTemplate` takes. They are scalar Python because they run at up to 10 kHz, where
arrays of three numbers cost more than they save. From messages, everything is checked.
"""

import math
from typing import Any, NamedTuple

from disc_sim_ros import topics, validation
from disc_sim_ros.arrays import Vector
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import frames as paper_frames
from disc_sim_ros.physics.frames import flip_yz
from disc_sim_ros.physics.kernels import rotation
from disc_sim_ros.physics.kernels.equations import DISC, DISC_AIR, DISC_BODY, State, Velocity
from disc_sim_ros.topics import Frames

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

LARGEST_MOMENT = 1e3  # N m
LARGEST_COEFFICIENT = 10.0
LARGEST_WIND = 100.0  # m/s, each component
LARGEST_POSITION = 1e4  # m, each component
LARGEST_SPEED = 200.0  # m/s
LARGEST_RATE = 1e3  # rad/s, each component
_UNIT_NORM = 1e-3  # a quaternion this near to unit length is meant to have it
_NO_AIRSPEED = 1e-9  # m/s
_NANOSECONDS = 1_000_000_000

Pose = tuple[float, float, float, float, float, float, float]
Odometry = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float
]
Six = tuple[float, float, float, float, float, float]


class Quantities(NamedTuple):
    """What the paper plots, each a topic of one number; all finite."""

    airspeed: float  # m/s
    angle_of_attack: float  # rad, air on the underside positive
    absolute_attitude: float  # rad, between the disc's axis and the vertical
    advance_ratio: float  # rim speed to airspeed, with the sign of the spin
    spin_rate: float  # rad/s, the paper's r: clockwise from above positive


def stamp(nanoseconds: int) -> tuple[int, int]:
    """Return a time in nanoseconds as the seconds and nanoseconds of a message."""
    return divmod(nanoseconds, _NANOSECONDS)


def pose(s: State) -> Pose:
    """Return position [m] and quaternion x, y, z, w of `disc` in `map`.

    In the order of POSE_FIELDS and of TRANSFORM_FIELDS.
    """
    return s.X, 0.0 - s.Y, 0.0 - s.Z, s.e1, 0.0 - s.e2, 0.0 - s.e3, s.e0


def odometry(s: State) -> Odometry:
    """Return the `pose`, and velocity over the ground and angular velocity in `disc`.

    In the order of ODOMETRY_FIELDS [m, 1, m/s, rad/s]. The first seven are `pose(s)`. Angular z
    carries the spin, clockwise from above negative.
    """
    X, Y, Z, VX, VY, VZ, e0, e1, e2, e3, p, q, r, _ = s
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation.rotation_elements(e0, e1, e2, e3)
    return (
        X,
        0.0 - Y,
        0.0 - Z,
        e1,
        0.0 - e2,
        0.0 - e3,
        e0,
        xx * VX + yx * VY + zx * VZ,
        0.0 - (xy * VX + yy * VY + zy * VZ),
        0.0 - (xz * VX + yz * VY + zz * VZ),
        p,
        0.0 - q,
        0.0 - r,
    )


def spin_joint(s: State) -> tuple[float, float]:
    """Return the angle [rad] and the rate [rad/s] of `disc_body` in `disc`, about z up.

    In the order of JOINT_FIELDS. The angle lies between -pi and pi.
    """
    return math.remainder(0.0 - s.sigma, math.tau), 0.0 - s.r


def spin_transform(s: State) -> tuple[float, float]:
    """Return z and w of the quaternion of `disc_body` in `disc`; x and y are 0.

    In the order of SPIN_TRANSFORM_FIELDS.
    """
    half = 0.5 * math.remainder(0.0 - s.sigma, math.tau)
    return math.sin(half), math.cos(half)


def imu(
    s: State, acceleration: Vector, rates_change: Vector, offset: Vector, gravity: float
) -> Six:
    """Return what an ideal IMU measures that is fixed in the plastic and aligned with it.

    Args:
        s: State.
        acceleration: dV/dt of the centre over the ground, earth axes 1 [m/s^2]; zeros at rest.
        rates_change: dp/dt, dq/dt, dr/dt in despun axes 2 [rad/s^2].
        offset: Where the IMU is, from the centre of the disc, in `disc_body` [m].
        gravity: g [m/s^2].

    Returns:
        Angular velocity [rad/s] and specific force [m/s^2] (acceleration minus gravity: +g along
        z when lying level) in `disc_body`, in the order of IMU_FIELDS.
    """
    p, q, r = s.p, s.q, s.r
    p_dot, q_dot, r_dot = rates_change
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation.rotation_elements(s.e0, s.e1, s.e2, s.e3)
    f_X, f_Y, f_Z = acceleration
    f_Z -= gravity

    # Components in despun axes change also because these turn at (p, q, 0): (p, q, 0) x (p, q, r)
    # is (q r, -p r, 0). From here on in `disc`: z is up.
    w_x, w_y, w_z = p, 0.0 - q, 0.0 - r
    a_x, a_y, a_z = p_dot + q * r, p * r - q_dot, 0.0 - r_dot
    c, si = math.cos(s.sigma), 0.0 - math.sin(s.sigma)  # of the angle of `disc_body` about z up
    o_x, o_y, o_z = c * offset[0] - si * offset[1], si * offset[0] + c * offset[1], offset[2]

    # f + a x o + w x (w x o)
    v_x, v_y, v_z = w_y * o_z - w_z * o_y, w_z * o_x - w_x * o_z, w_x * o_y - w_y * o_x
    f_x = xx * f_X + yx * f_Y + zx * f_Z + a_y * o_z - a_z * o_y + w_y * v_z - w_z * v_y
    f_y = a_z * o_x - a_x * o_z + w_z * v_x - w_x * v_z - (xy * f_X + yy * f_Y + zy * f_Z)
    f_z = a_x * o_y - a_y * o_x + w_x * v_y - w_y * v_x - (xz * f_X + yz * f_Y + zz * f_Z)
    return (
        c * w_x + si * w_y,
        c * w_y - si * w_x,
        w_z,
        c * f_x + si * f_y,
        c * f_y - si * f_x,
        f_z,
    )


def quantities(s: State, wind: Velocity, diameter: float) -> Quantities:
    """Return what the paper plots (eqns 17, 50 and 63).

    Args:
        s: State.
        wind: Wind at the disc, where the air moves to, earth axes 1 [m/s].
        diameter: The paper's c [m].

    Returns:
        The quantities. A disc without airspeed has angle of attack and advance ratio 0, because
        messages carry finite numbers.
    """
    V_X, V_Y, V_Z = s.VX - wind.X, s.VY - wind.Y, s.VZ - wind.Z
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation.rotation_elements(s.e0, s.e1, s.e2, s.e3)
    u3 = math.hypot(xx * V_X + yx * V_Y + zx * V_Z, xy * V_X + yy * V_Y + zy * V_Z)
    w = xz * V_X + yz * V_Y + zz * V_Z
    V = math.hypot(u3, w)
    return Quantities(
        airspeed=V,
        angle_of_attack=math.atan2(w, u3) if V > _NO_AIRSPEED else 0.0,
        absolute_attitude=math.atan2(math.hypot(xz, yz), zz),
        advance_ratio=0.5 * s.r * diameter / V if V > _NO_AIRSPEED else 0.0,
        spin_rate=s.r,
    )


def moment_axes(frames: Frames) -> dict[str, int]:
    """Return the axes of `equations.Control` by the frame that a moment in N m is given in."""
    return {frames.disc: DISC, frames.disc_body: DISC_BODY, frames.disc_air: DISC_AIR}


def moment_from_wrench(message: Any, frames: Frames) -> tuple[float, float, float, int]:
    """Return L, M, N in the paper's signs [N m] and their axes, from a commanded moment.

    Args:
        message: geometry_msgs/WrenchStamped in `disc`, `disc_body` or `disc_air`; an empty frame
            is `disc_air`. Nothing else than a torque may be set.
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
    torque = _vector(
        f'{topics.CMD_MOMENT} wrench.torque', message.wrench.torque, LARGEST_MOMENT, 'N m'
    )
    return *flip_yz(torque), allowed[frame]


def coefficients_from_vector(message: Any, frames: Frames) -> Vector:
    """Return C_L, C_M, C_N, from x, y, z of a command that has the paper's signs already.

    Args:
        message: geometry_msgs/Vector3Stamped. Coefficients always act about the axes of the flow;
            its frame is empty or `disc_air`, because any other would promise something else.
        frames: Names of the frames.

    Raises:
        ConfigError: A coefficient out of range, another frame.
    """
    _frame(topics.CMD_COEFFICIENTS, message, (frames.disc_air,), frames.disc_air)
    return _vector(f'{topics.CMD_COEFFICIENTS} vector', message.vector, LARGEST_COEFFICIENT)


def wind_from_vector(message: Any, frames: Frames) -> Vector:
    """Return where the air moves to, in earth axes 1 [m/s].

    Args:
        message: geometry_msgs/Vector3Stamped in `map`; an empty frame is `map`.
        frames: Names of the frames.

    Raises:
        ConfigError: A wind out of range, another frame.
    """
    _frame(topics.WIND, message, (frames.map,), frames.map)
    return flip_yz(_vector(f'{topics.WIND} vector', message.vector, LARGEST_WIND, 'm/s'))


def release_from_odometry(message: Any, frames: Frames) -> State:
    """Return the state at release, spin angle 0, from another node's throw.

    Whether the release is above the ground is left to who has a ground.

    Args:
        message: nav_msgs/Odometry of `disc` in `map`, its twist in `disc`, over the ground; empty
            frames are these. Covariances have no effect.
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
    X, Y, Z = flip_yz(_vector(f'{topic} pose.pose.position', at.position, LARGEST_POSITION, 'm'))
    e = _attitude(f'{topic} pose.pose.orientation', at.orientation)
    linear = _vector(f'{topic} twist.twist.linear', twist.linear, LARGEST_SPEED, 'm/s')
    if math.hypot(*linear) > LARGEST_SPEED:
        allowed = f'give a speed of at most {LARGEST_SPEED:g} m/s'
        raise ConfigError(f'{topic} twist.twist.linear', linear, allowed)
    angular = _vector(f'{topic} twist.twist.angular', twist.angular, LARGEST_RATE, 'rad/s')
    if angular[2] == 0.0:
        raise ConfigError(f'{topic} twist.twist.angular.z', 0.0, 'a throw needs spin')
    VX, VY, VZ = paper_frames.earth_from_body(e, flip_yz(linear))
    p, q, r = flip_yz(angular)
    return State(X, Y, Z, VX, VY, VZ, *e, p, q, r, sigma=0.0)


def _attitude(thing: str, orientation: Any) -> rotation.Quaternion:
    """Return the unit quaternion of despun axes 2 in axes 1, scalar first."""
    xyzw = [
        validation.number(f'{thing}.{name}', getattr(orientation, name), -2.0, 2.0)
        for name in _QUATERNION
    ]
    norm = math.hypot(*xyzw)
    if abs(norm - 1.0) > _UNIT_NORM:
        allowed = f'give a quaternion of length 1, not {norm:g}'
        raise ConfigError(thing, tuple(xyzw), allowed)
    e0, e1, e2, e3 = (paper_frames.paper_quaternion(xyzw) / norm).tolist()
    return e0, e1, e2, e3


def _vector(thing: str, vector: Any, limit: float, unit: str = '') -> Vector:
    """Return x, y, z of a message as finite floats no larger than a limit."""
    x, y, z = (
        validation.number(f'{thing}.{name}', getattr(vector, name), -limit, limit, unit=unit)
        for name in _VECTOR
    )
    return x, y, z


def _frame(topic: str, message: Any, allowed: Any, default: str) -> str:
    """Return the frame of a message, or the default where it names none."""
    frame: str = message.header.frame_id or default
    if frame not in allowed:
        advice = f'give {", ".join(allowed)}, or leave it empty for {default}'
        raise ConfigError(f'{topic} header.frame_id', frame, advice)
    return frame
