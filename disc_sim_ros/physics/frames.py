"""Axes: the paper's earth and body axes, Euler angles, and the axes of ROS messages.

The paper's axes are earth axes 1 (X forward, Y right, Z down) and body axes 2 (x forward, y right,
z down through the underside). REP-103 has x forward, y left, z up for both. Each pair differs by
half a turn about x, so that vectors change the sign of y and z, and so does the vector part of a
quaternion. Here that is defined; `ros.messages` does the same in scalars, for speed, and is
tested against this module.

Quaternions are written scalar first, (e0, e1, e2, e3), in the paper's axes ("Euler parameters"),
and x, y, z, w in messages. They take body components to earth components.
"""

import numpy as np
from numpy.typing import ArrayLike

from disc_sim_ros.arrays import FloatArray, Vector
from disc_sim_ros.physics.kernels.rotation import (
    Quaternion,
    cos_sin_degrees,
    quaternion_of_half_angles,
    rotated,
    rotation_elements,
)


def map_from_paper(vector: ArrayLike) -> FloatArray:
    """Return vectors in REP-103 axes (x forward, y left, z up) from the paper's axes.

    Args:
        vector: Components in axes 1 (or 2), shape (..., 3), any unit.

    Returns:
        Components in `map` (or `disc`), the same shape. The function is its own inverse.
    """
    return np.asarray(vector, dtype=float) * (1.0, -1.0, -1.0)


def paper_from_map(vector: ArrayLike) -> FloatArray:
    """Return vectors in the paper's axes from REP-103 axes, shape (..., 3)."""
    return map_from_paper(vector)


def flip_yz(vector: Vector) -> Vector:
    """Return one vector half a turn about x on: the paper's axes to REP-103, or back."""
    x, y, z = vector
    return x, 0.0 - y, 0.0 - z  # no minus zeros


def message_quaternion(e: ArrayLike) -> FloatArray:
    """Return x, y, z, w of `disc` in `map` from (e0, e1, e2, e3) of axes 2 in axes 1."""
    e = np.asarray(e, dtype=float)
    return np.stack([e[..., 1], -e[..., 2], -e[..., 3], e[..., 0]], axis=-1)


def paper_quaternion(xyzw: ArrayLike) -> FloatArray:
    """Return (e0, e1, e2, e3) of axes 2 in axes 1 from x, y, z, w of `disc` in `map`."""
    xyzw = np.asarray(xyzw, dtype=float)
    return np.stack([xyzw[..., 3], xyzw[..., 0], -xyzw[..., 1], -xyzw[..., 2]], axis=-1)


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
    """Return the earth components of a vector given in body axes, for one unit quaternion."""
    return rotated(rotation_elements(*e), uvw)


def euler_from_quaternion(e: ArrayLike) -> FloatArray:
    """Return roll phi, pitch theta and yaw psi of quaternions, yaw, pitch, roll sequence.

    Args:
        e: Unit quaternions, shape (..., 4).

    Returns:
        Angles [rad], shape (..., 3), pitch from -pi/2 to pi/2. For people: at a pitch of +-90
        degrees roll and yaw are about one axis, and only their sum or difference means something.
    """
    R = rotation_matrix(e)
    phi = np.arctan2(R[..., 2, 1], R[..., 2, 2])
    theta = np.arctan2(-R[..., 2, 0], np.hypot(R[..., 2, 1], R[..., 2, 2]))
    psi = np.arctan2(R[..., 1, 0], R[..., 0, 0])
    return np.stack([phi, theta, psi], axis=-1)
