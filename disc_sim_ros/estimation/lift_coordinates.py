"""Coordinates of a throw in which positions that were measured depend nearly linearly on it.

Positions tell the force on the disc, not its attitude: a head wind and a lower nose go together.
So the attitude is given by the lift and the bank about the air flow. If wind, velocity or
coefficients change, the force stays, and the attitude follows through the inverse of the lift
curve, corners of its table included.
"""

from typing import NamedTuple

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.disc import Disc

NAMES = ('X', 'Y', 'Z', 'VX', 'VY', 'VZ', 'lift', 'bank', 'p', 'q', 'r')
SIZE = len(NAMES)


class LiftCurve(NamedTuple):
    """The part of a lift curve around level flight in which it rises.

    Beyond both ends it goes on in straight lines.
    """

    alpha: FloatArray  # rad, ascending
    C_Lift: FloatArray  # ascending


def lift_curve(disc: Disc, aero: str) -> LiftCurve:
    """Return the rising part of the lift curve of a disc around angle of attack 0."""
    if aero == 'linear' and disc.linear is not None:
        alpha = np.array([-0.5, 0.5])
        return LiftCurve(alpha, disc.linear.CL_0 + disc.linear.CL_alpha * alpha)
    alpha, C = disc.table_rows[:, 0], disc.table_rows[:, 1]
    rising = np.diff(C) > 1e-6
    i = int(np.clip(np.searchsorted(alpha, 0.0), 1, len(alpha) - 1))
    first, last = i - 1, i
    while first > 0 and rising[first - 1]:
        first -= 1
    while last < len(alpha) - 1 and rising[last]:
        last += 1
    return LiftCurve(alpha[first : last + 1], C[first : last + 1])


def _frame(flow: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return unit vectors along the flow, to the right and down."""
    speed = np.sqrt(np.sum(flow**2, axis=-1))
    forward = flow / np.maximum(speed, 1e-9)[..., None]
    x, y = forward[..., 0], forward[..., 1]
    level = np.maximum(np.hypot(x, y), 1e-6)
    right = np.stack([-y / level, x / level, np.zeros_like(x)], axis=-1)
    return forward, right, np.cross(forward, right)


def axis_in_flow(
    flow: FloatArray, alpha: FloatArray | float, bank: FloatArray | float
) -> FloatArray:
    """Return the axis of a disc, through its underside, with an angle of attack and a bank.

    Args:
        flow: Velocity through the air, earth axes 1 [m/s], shape (..., 3).
        alpha: Angle of attack, air on the underside positive [rad], shape (...).
        bank: About the flow, right edge down positive [rad], shape (...).

    Returns:
        Unit vectors in earth axes 1, shape (..., 3).
    """
    forward, right, down = _frame(flow)
    c = np.cos(alpha)
    axis: FloatArray = (
        forward * np.asarray(np.sin(alpha))[..., None]
        + down * np.asarray(c * np.cos(bank))[..., None]
        - right * np.asarray(c * np.sin(bank))[..., None]
    )
    return axis
