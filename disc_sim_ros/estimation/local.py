"""Local coordinates of a state: what an estimator changes, without redundant numbers.

A state has 14 numbers, of which an estimator can know 11: a quaternion has unit length, and the
turn of the despun axes about the disc's axis has no effect on a flight, with the spin angle turned
back by as much (a gauge). Transverse rates are components in despun axes, as in State.
"""

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import State

NAMES = ('X', 'Y', 'Z', 'VX', 'VY', 'VZ', 'tilt_x', 'tilt_y', 'p', 'q', 'r')
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


def attitude(down: FloatArray) -> FloatArray:
    """Return the smallest turn that takes z to the direction `down`, a quaternion, shape (4,)."""
    X, Y, Z = down / max(float(np.linalg.norm(down)), 1e-12)
    if Z < -1.0 + 1e-9:
        return np.array([0.0, 1.0, 0.0, 0.0])
    e = np.array([1.0 + Z, -Y, X, 0.0])
    unit: FloatArray = e / np.linalg.norm(e)
    return unit


def difference(a: FloatArray, b: FloatArray) -> tuple[FloatArray, float]:
    """Return the local coordinates and the change of the spin angle that take state `a` to `b`.

    The axes of `b` may be turned about the disc's axis; its transverse rates and its spin angle
    are turned back with them, which is the same motion. The inverse of `moved`.

    Args:
        a: State, shape (14,).
        b: State, shape (14,).

    Returns:
        Local coordinates, shape (11,), and the change of the spin angle [rad].
    """
    e0, e1, e2, e3 = a[_ATTITUDE] * (1.0, -1.0, -1.0, -1.0)
    f0, f1, f2, f3 = b[_ATTITUDE]
    w = e0 * f0 - e1 * f1 - e2 * f2 - e3 * f3
    x = e0 * f1 + e1 * f0 + e2 * f3 - e3 * f2
    y = e0 * f2 - e1 * f3 + e2 * f0 + e3 * f1
    z = e0 * f3 + e1 * f2 - e2 * f1 + e3 * f0
    half = np.arctan2(z, w)  # half the turn about z, after the tilt
    c, s = np.cos(half), np.sin(half)
    tilt_x, tilt_y = x * c - y * s, y * c + x * s
    sine = float(np.hypot(tilt_x, tilt_y))
    angle = 2.0 * np.arctan2(sine, np.hypot(w, z))
    scale = angle / sine if sine > 0.0 else 2.0
    c, s = np.cos(2.0 * half), np.sin(2.0 * half)
    p, q = c * b[10] - s * b[11], s * b[10] + c * b[11]
    delta = np.array(
        [*(b[0:6] - a[0:6]), scale * tilt_x, scale * tilt_y, p - a[10], q - a[11], b[12] - a[12]]
    )
    return delta, float(b[13] + 2.0 * half - a[13])
