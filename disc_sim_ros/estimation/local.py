"""Local coordinates of a state: what an estimator changes, without redundant numbers.

A state has 14 numbers, of which an estimator can know 11: a quaternion has unit length, and the
turn of the despun axes about the disc's axis has no effect on a flight, with the spin angle turned
back by as much (a gauge). Transverse rates are components in despun axes, as in State.
"""

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import State

NAMES = ('X', 'Y', 'Z', 'VX', 'VY', 'VZ', 'tilt_x', 'tilt_y', 'p', 'q', 'r')
UNITS = ('m', 'm', 'm', 'm/s', 'm/s', 'm/s', 'rad', 'rad', 'rad/s', 'rad/s', 'rad/s')
SIZE = len(NAMES)
_FIRST = State._fields.index('e0')
_ATTITUDE = slice(_FIRST, _FIRST + 4)


def moved(states: FloatArray, deltas: FloatArray) -> FloatArray:
    """Return states moved by local coordinates.

    Args:
        states: States in the paper's axes, columns as in State, shape (..., 14).
        deltas: Changes in the order of NAMES: position and velocity in earth axes 1, a turn about
            x and y of the despun axes 2, and the rates p, q, r there; shape (..., 11). The two
            shapes broadcast.

    Returns:
        The moved states, with quaternions of unit length, shape (..., 14).
    """
    states, deltas = np.asarray(states, dtype=float), np.asarray(deltas, dtype=float)
    shape = np.broadcast_shapes(states.shape[:-1], deltas.shape[:-1])
    out = np.empty((*shape, states.shape[-1]))
    out[...] = states
    out[..., 0:6] += deltas[..., 0:6]
    out[..., 10:13] += deltas[..., 8:11]
    out[..., _ATTITUDE] = _turned(out[..., _ATTITUDE], deltas[..., 6], deltas[..., 7])
    return out


def _turned(e: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the quaternions e * exp((0, x, y, 0) / 2), of unit length."""
    angle = np.hypot(x, y)
    half_sinc = 0.5 * np.sinc(angle / (2.0 * np.pi))  # sin(angle / 2) / angle
    c, x, y = np.cos(0.5 * angle), half_sinc * x, half_sinc * y
    e0, e1, e2, e3 = (e[..., k] for k in range(4))
    turned = np.stack(
        [
            e0 * c - e1 * x - e2 * y,
            e1 * c + e0 * x - e3 * y,
            e2 * c + e0 * y + e3 * x,
            e3 * c + e1 * y - e2 * x,
        ],
        axis=-1,
    )
    unit: FloatArray = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
    return unit


def disc_axis(states: FloatArray) -> FloatArray:
    """Return the disc's axis, through its underside, in earth axes 1, shape (..., 3)."""
    e0, e1, e2, e3 = (states[..., k] for k in range(6, 10))
    return np.stack(
        [
            2.0 * (e1 * e3 + e0 * e2),
            2.0 * (e2 * e3 - e0 * e1),
            e0 * e0 - e1 * e1 - e2 * e2 + e3 * e3,
        ],
        axis=-1,
    )
