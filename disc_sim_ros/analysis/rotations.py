"""Rotations by the quaternions of messages; `scipy.spatial` takes a third of a second to load."""

import numpy as np

from disc_sim_ros.arrays import FloatArray


def rotated(xyzw: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return vectors of a body in the frame in which its quaternions are.

    Args:
        xyzw: Quaternions that are not 0, x, y, z, w, shape (n, 4).
        vectors: Components in the body, shape (n, 3).
    """
    axis, w = _parts(xyzw)
    across = np.cross(axis, vectors)
    turned: FloatArray = vectors + 2.0 * (w * across + np.cross(axis, across))
    return turned


def rotated_back(xyzw: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return vectors in the body: the inverse of `rotated`."""
    return rotated(xyzw * (-1.0, -1.0, -1.0, 1.0), vectors)


def turns_between(xyzw: FloatArray) -> FloatArray:
    """Return the turn from each quaternion to the next, in axes of the body.

    Args:
        xyzw: Quaternions that are not 0, x, y, z, w, shape (n, 4).

    Returns:
        Axes times angles from 0 to pi [rad], shape (n - 1, 3).
    """
    axis, w = _parts(xyzw)
    (a, b), (c, d) = (axis[:-1], axis[1:]), (w[:-1], w[1:])
    between = c * b - d * a - np.cross(a, b)
    cosine = c * d + np.sum(a * b, axis=1, keepdims=True)
    between = np.where(cosine < 0.0, -between, between)
    sine = np.linalg.norm(between, axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, np.abs(cosine))
    turns: FloatArray = between * np.where(
        sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 2.0
    )
    return turns


def _parts(xyzw: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the vectors and the scalars of unit quaternions, shapes (n, 3) and (n, 1)."""
    unit = xyzw / np.linalg.norm(xyzw, axis=1, keepdims=True)
    return unit[:, :3], unit[:, 3:]
