"""Coordinates of a throw in which positions that were measured depend nearly linearly on it.

Positions tell the force on the disc, not its attitude: a head wind and a lower nose go together.
So the attitude is given by the lift and the bank about the air flow. If wind, velocity or
coefficients change, the force stays, and the attitude follows through the inverse of the lift
curve, corners of its table included.
"""

from typing import NamedTuple

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation import local
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.frames import paper_from_map
from disc_sim_ros.physics.kernels.rows import AT

NAMES = ('X', 'Y', 'Z', 'VX', 'VY', 'VZ', 'lift', 'bank', 'p', 'q', 'r')
SIZE = len(NAMES)
_LEAST_SPEED = 0.5  # m/s through the air, below which a flow has no direction here


class LiftCurve(NamedTuple):
    """The part of a lift curve around level flight in which it rises."""

    alpha: FloatArray  # rad, ascending
    C_Lift: FloatArray  # ascending

    def angle(self, C_Lift: FloatArray) -> FloatArray:
        """Return angles of attack [rad]; the curve goes on in straight lines."""
        a, C = self.alpha, self.C_Lift
        inside = np.interp(C_Lift, C, a)
        low = a[0] + (C_Lift - C[0]) * (a[1] - a[0]) / (C[1] - C[0])
        high = a[-1] + (C_Lift - C[-1]) * (a[-1] - a[-2]) / (C[-1] - C[-2])
        return np.where(C_Lift < C[0], low, np.where(C_Lift > C[-1], high, inside))

    def lift(self, alpha: FloatArray) -> FloatArray:
        """Return lift coefficients, the inverse of `angle`."""
        return LiftCurve(self.C_Lift, self.alpha).angle(alpha)


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


def moved(
    setup: Setup,
    curve: LiftCurve,
    state: FloatArray,
    row: FloatArray,
    deltas: FloatArray,
    rows: FloatArray,
) -> FloatArray:
    """Return states moved by these coordinates.

    Args:
        setup: The disc and the air.
        curve: Its lift curve.
        state: Paper's axes, shape (14,).
        row: Constants of its flight.
        deltas: In the order of NAMES, lift as an acceleration [m/s^2], shape (n, 11).
        rows: Constants of each moved flight, shape (n, len(row)).

    Returns:
        Shape (n, 14).
    """
    moves = deltas.copy()
    moves[:, 6:8] = 0.0
    states = local.moved(state, moves)
    old, old_rows = state[None], row[None]
    alpha, bank = _angles(old, _air_velocity(old, old_rows))
    q = _dynamic(setup, _air_velocity(old, old_rows))
    lift = q * (curve.lift(alpha) + old_rows[:, AT['lift_offset']])
    flow = _air_velocity(states, rows)
    C_Lift = (lift + deltas[:, 6]) / _dynamic(setup, flow) - rows[:, AT['lift_offset']]
    new_alpha = np.clip(curve.angle(C_Lift), -1.5, 1.5)
    axis = axis_in_flow(flow, new_alpha, bank + deltas[:, 7])
    states[:, 6:10] = _turned_to(states[:, 6:10], local.disc_axis(old)[0], axis)
    return states


def _air_velocity(states: FloatArray, rows: FloatArray) -> FloatArray:
    wind = paper_from_map(rows[:, AT['wind_x'] : AT['wind_x'] + 3])
    return states[:, 3:6] - wind


def _dynamic(setup: Setup, flow: FloatArray) -> FloatArray:
    """Return the acceleration by a coefficient of 1 [m/s^2]."""
    plant = setup.plant
    squared = np.maximum(np.sum(flow**2, axis=1), _LEAST_SPEED**2)
    return np.asarray(0.5 * plant.rho * plant.S / plant.m * squared, dtype=float)


def _frame(flow: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return unit vectors along the flow, to the right and down."""
    speed = np.sqrt(np.sum(flow**2, axis=-1))
    forward = flow / np.maximum(speed, 1e-9)[..., None]
    x, y = forward[..., 0], forward[..., 1]
    level = np.maximum(np.hypot(x, y), 1e-6)
    right = np.stack([-y / level, x / level, np.zeros_like(x)], axis=-1)
    return forward, right, np.cross(forward, right)


def _angles(states: FloatArray, flow: FloatArray) -> tuple[FloatArray, FloatArray]:
    forward, right, down = _frame(flow)
    axis = local.disc_axis(states)
    alpha = np.arcsin(np.clip(np.sum(axis * forward, axis=1), -1.0, 1.0))
    bank = np.arctan2(-np.sum(axis * right, axis=1), np.sum(axis * down, axis=1))
    return alpha, bank


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


def _turned_to(e: FloatArray, old: FloatArray, new: FloatArray) -> FloatArray:
    """Return attitudes turned by the smallest rotation that takes the axis `old` to `new`."""
    scalar = 1.0 + new @ old
    v = np.cross(old, new)
    norm = np.sqrt(np.maximum(scalar**2 + np.sum(v**2, axis=1), 1e-18))
    w, x, y, z = (c / norm for c in (scalar, *v.T))
    a, b, c, d = e.T
    return np.stack(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ],
        axis=1,
    )
