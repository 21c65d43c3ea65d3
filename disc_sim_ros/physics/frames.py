"""The turn between the paper's axes and the axes of ROS messages, and Euler angles.

The paper's axes are earth axes 1 (X forward, Y right, Z down) and body axes 2 (x forward, y right,
z down through the underside). REP-103 has x forward, y left, z up for both. Each pair differs by
half a turn about x: a vector changes the sign of y and z, and so does the vector part of a
quaternion. This module is the only place in the package where that sign change is written, except
for the compiled kernels; `test/physics/test_frames.py` scans the package for others.

Quaternions are written scalar first, (e0, e1, e2, e3), in the paper's axes ("Euler parameters"),
and x, y, z, w in messages. They take body components to earth components.

The functions of one `State` are scalar Python because the node calls them at up to 10 kHz, where
arrays of three numbers cost more than they save. `odometry_array` applies `odometry` to columns,
so that a re-simulation has the bits of the node.
"""

import math
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from disc_sim_ros.arrays import FloatArray, Vector
from disc_sim_ros.physics.kernels.equations import DISC, DISC_AIR, DISC_BODY, State
from disc_sim_ros.physics.kernels.jit import inline
from disc_sim_ros.physics.kernels.rotation import (
    Quaternion,
    cos_sin_degrees,
    quaternion_of_half_angles,
    rotated,
    rotation_elements,
    wrapped_angle,
)
from disc_sim_ros.topics import Frames

Pose = tuple[float, float, float, float, float, float, float]
Odometry = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float
]
_Component = TypeVar('_Component', float, FloatArray)
_SIGNS = (1.0, -1.0, -1.0)  # of x, y, z


# ---- vectors ----


def flip(component: _Component) -> _Component:
    """Return a y or z component in the other axes: left for right, up for down.

    For a float or an array, any unit. The result is never a minus zero. The function is its own
    inverse.
    """
    return 0.0 - component


@inline
def flip_yz(vector: Vector) -> Vector:
    """Return a vector in REP-103 axes from the paper's axes, or the reverse.

    Args:
        vector: Three floats, any unit.

    Returns:
        The components in the other axes. y and z are never minus zero.
    """
    x, y, z = vector
    return x, 0.0 - y, 0.0 - z


def map_from_paper(vector: ArrayLike) -> FloatArray:
    """Return vectors in REP-103 axes (x forward, y left, z up) from the paper's axes.

    Args:
        vector: Components in axes 1 (or 2), shape (..., 3), any unit.

    Returns:
        Components in `map` (or `disc`), the same shape. The function is its own inverse.
    """
    return np.asarray(vector, dtype=float) * _SIGNS


def paper_from_map(vector: ArrayLike) -> FloatArray:
    """Return vectors in the paper's axes from REP-103 axes, shape (..., 3)."""
    return map_from_paper(vector)


def moment_axes(names: Frames) -> dict[str, int]:
    """Return the axes of `equations.Control` by the name of the frame of a moment in N m."""
    return {names.disc: DISC, names.disc_body: DISC_BODY, names.disc_air: DISC_AIR}


# ---- the numbers of messages ----


@inline
def pose(s: State) -> Pose:
    """Return position [m] and quaternion x, y, z, w of `disc` in `map`."""
    return s.X, 0.0 - s.Y, 0.0 - s.Z, s.e1, 0.0 - s.e2, 0.0 - s.e3, s.e0


@inline
def odometry(s: State) -> Odometry:
    """Return pose, velocity over the ground and angular velocity as nav_msgs/Odometry has them.

    Args:
        s: State; its fields are floats, or arrays of one shape.

    Returns:
        The numbers of `pose`, then the velocity [m/s] and the angular velocity [rad/s] in
        `disc`. Angular z carries the spin, clockwise from above negative.
    """
    X, Y, Z, VX, VY, VZ, e0, e1, e2, e3, p, q, r, _ = s
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation_elements(e0, e1, e2, e3)
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


def motion_in_map(s: State, acceleration: Vector, rates_change: Vector) -> FloatArray:
    """Return velocities and accelerations of the disc in `map`, both linear and angular.

    Args:
        s: State.
        acceleration: dV/dt of the centre over the ground, earth axes 1 [m/s^2].
        rates_change: dp/dt, dq/dt, dr/dt in despun axes 2 [rad/s^2].

    Returns:
        Velocity [m/s], angular velocity with the spin [rad/s], acceleration [m/s^2] and angular
        acceleration [rad/s^2], shape (4, 3).
    """
    e = s.e0, s.e1, s.e2, s.e3
    p_dot, q_dot, r_dot = rates_change
    # The despun axes turn at (p, q, 0): (p, q, 0) x (p, q, r) is (q r, -p r, 0).
    turning = p_dot + s.q * s.r, q_dot - s.p * s.r, r_dot
    vectors = (
        (s.VX, s.VY, s.VZ),
        earth_from_body(e, (s.p, s.q, s.r)),
        acceleration,
        earth_from_body(e, turning),
    )
    return map_from_paper(vectors) + 0.0


def odometry_array(states: ArrayLike) -> FloatArray:
    """Return `odometry` of many states, equal to the last bit.

    Args:
        states: In the order of `equations.State`, shape (n, 14) or (14,).

    Returns:
        The numbers, shape (n, 13).
    """
    columns = np.atleast_2d(np.asarray(states, dtype=float)).T
    return np.stack(odometry(State(*columns)), axis=1)


def states_from_odometry(numbers: FloatArray) -> FloatArray:
    """Return states, spin angle 0, from the numbers of nav_msgs/Odometry.

    Args:
        numbers: In the order of `odometry`, shape (n, 13).

    Returns:
        In the order of `equations.State`, shape (n, 14). Quaternions have unit length; one of
        length 0 becomes not a number. The velocity is turned out of the disc to within rounding.
    """
    position = paper_from_map(numbers[:, :3])
    norm = np.linalg.norm(numbers[:, 3:7], axis=1, keepdims=True)
    e = paper_quaternion(numbers[:, 3:7] / np.where(norm > 0.0, norm, np.nan))
    uvw = paper_from_map(numbers[:, 7:10])
    velocity = np.einsum('nij,nj->ni', rotation_matrix(e), uvw)
    rates = paper_from_map(numbers[:, 10:13])
    return np.hstack([position, velocity, e, rates, np.zeros((len(numbers), 1))]) + 0.0


@inline
def spin_joint(s: State) -> tuple[float, float]:
    """Return the angle [rad] and the rate [rad/s] of `disc_body` in `disc`, about z up.

    The angle lies between -pi and pi.
    """
    return wrapped_angle(0.0 - s.sigma), 0.0 - s.r


@inline
def spin_transform(s: State) -> tuple[float, float]:
    """Return z and w of the quaternion of `disc_body` in `disc`; x and y are 0."""
    half = 0.5 * wrapped_angle(0.0 - s.sigma)
    return math.sin(half), math.cos(half)


# ---- attitudes ----


def message_quaternion(e: ArrayLike) -> FloatArray:
    """Return x, y, z, w of `disc` in `map` from (e0, e1, e2, e3) of axes 2 in axes 1."""
    e = np.asarray(e, dtype=float)
    return np.concatenate([map_from_paper(e[..., 1:]), e[..., :1]], axis=-1)


def paper_quaternion(xyzw: ArrayLike) -> FloatArray:
    """Return (e0, e1, e2, e3) of axes 2 in axes 1 from x, y, z, w of `disc` in `map`."""
    xyzw = np.asarray(xyzw, dtype=float)
    return np.concatenate([xyzw[..., 3:], paper_from_map(xyzw[..., :3])], axis=-1)


def quaternion_from_euler(phi: float, theta: float, psi: float) -> Quaternion:
    """Return (e0, e1, e2, e3) of the yaw, pitch, roll sequence of the paper's Fig. 1.

    Args:
        phi: Roll, right edge down positive [degrees].
        theta: Pitch, nose up positive [degrees].
        psi: Yaw, nose right positive [degrees].

    Source: Etkin & Reid, Dynamics of Flight, 3rd ed., section 4.3 (the paper's reference).
    """
    cphi, sphi = cos_sin_degrees(phi / 2)
    cthe, sthe = cos_sin_degrees(theta / 2)
    cpsi, spsi = cos_sin_degrees(psi / 2)
    return quaternion_of_half_angles(cphi, sphi, cthe, sthe, cpsi, spsi)


def rotation_matrix(e: ArrayLike) -> FloatArray:
    """Return the matrices that take body to earth components.

    Args:
        e: Unit quaternions, shape (..., 4).

    Returns:
        Rotation matrices, shape (..., 3, 3).
    """
    e = np.asarray(e, dtype=float)
    elements = rotation_elements(*np.moveaxis(e, -1, 0))
    return np.stack(elements, axis=-1).reshape(*e.shape[:-1], 3, 3)


def earth_from_body(e: Quaternion, uvw: Vector) -> Vector:
    """Return the earth components of a vector in body axes, for one unit quaternion."""
    return rotated(rotation_elements(*e), uvw)


def body_from_earth(e: Quaternion, vector: Vector) -> Vector:
    """Return the body components of a vector in earth axes, for one unit quaternion."""
    e0, e1, e2, e3 = e
    return rotated(rotation_elements(e0, -e1, -e2, -e3), vector)


def euler_from_quaternion(e: ArrayLike) -> FloatArray:
    """Return roll phi, pitch theta and yaw psi of quaternions, yaw, pitch, roll sequence.

    Args:
        e: Unit quaternions, shape (..., 4).

    Returns:
        Angles [rad], shape (..., 3), pitch from -pi/2 to pi/2. They are for display: at a pitch
        of +-90 degrees roll and yaw turn about the same axis, and only their sum or difference
        has a meaning.
    """
    R = rotation_matrix(e)
    phi = np.arctan2(R[..., 2, 1], R[..., 2, 2])
    theta = np.arctan2(-R[..., 2, 0], np.hypot(R[..., 2, 1], R[..., 2, 2]))
    psi = np.arctan2(R[..., 1, 0], R[..., 0, 0])
    return np.stack([phi, theta, psi], axis=-1)
