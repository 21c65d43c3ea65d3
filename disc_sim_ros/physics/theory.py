"""What the paper derives: eqns 17, 50 and 53 to 64, as docs/deviations.md corrects them.

Pure functions of floats or of arrays that broadcast.
"""

import math
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.disc import Disc


@overload
def angle_of_attack(u: float, v: float, w: float) -> float: ...
@overload
def angle_of_attack(u: FloatArray, v: FloatArray, w: FloatArray) -> FloatArray: ...
def angle_of_attack(
    u: float | FloatArray, v: float | FloatArray, w: float | FloatArray
) -> float | FloatArray:
    """Return alpha = atan2(w, u3) with u3 = hypot(u, v) [rad], -pi/2 to pi/2 (eqn 17).

    The compiled equations have the same definition, in `equations.flow`.

    Args:
        u: Velocity relative to the air along x of axes 2, fixed to the disc or despun [m/s]. A
            float, or an array of any shape.
        v: Along y of the same axes [m/s], of the type and shape of `u`.
        w: Along z of the same axes, through the underside [m/s], of the type and shape of `u`.
    """
    if isinstance(u, float):
        return math.atan2(w, math.hypot(u, v))
    alpha: FloatArray = np.arctan2(w, np.hypot(u, v))
    return alpha


def absolute_attitude(phi: ArrayLike, theta: ArrayLike) -> FloatArray:
    """Return lambda, the angle between the disc's z axis and gravity [rad] (eqn 50)."""
    angle: FloatArray = np.arccos(np.clip(np.cos(phi) * np.cos(theta), -1.0, 1.0))
    return angle


def precession_roll_rate(M: ArrayLike, spin: ArrayLike, inertia_axial: float) -> FloatArray:
    """Return the roll rate p = -M / (r I_z) that a pitching moment causes [rad/s] (eqn 54).

    Args:
        M: Pitching moment, nose up positive [N m].
        spin: Spin rate r, clockwise from above positive, not 0 [rad/s].
        inertia_axial: I_z [kg m^2].

    Printed is 2 M / (r I_z), which holds dp/dt = dq/dt = 0 in axes that spin.
    """
    return -np.asarray(M, dtype=float) / (np.asarray(spin, dtype=float) * inertia_axial)


def precession_pitch_rate(L: ArrayLike, spin: ArrayLike, inertia_axial: float) -> FloatArray:
    """Return the pitch rate q = L / (r I_z) that a rolling moment causes [rad/s] (eqn 53)."""
    return np.asarray(L, dtype=float) / (np.asarray(spin, dtype=float) * inertia_axial)


def dimensionless_time(t: ArrayLike, speed: float, gravity: float) -> FloatArray:
    """Return t g / V (eqn 55)."""
    return np.asarray(t, dtype=float) * (gravity / speed)


def dimensionless_length(length: ArrayLike, speed: float, gravity: float) -> FloatArray:
    """Return l g / V^2 (eqn 56)."""
    return np.asarray(length, dtype=float) * (gravity / speed**2)


def dimensionless_roll_rate(p: ArrayLike, speed: ArrayLike, gravity: float) -> FloatArray:
    """Return p V / g (eqn 57)."""
    rate: FloatArray = np.asarray(p, dtype=float) * np.asarray(speed, dtype=float) / gravity
    return rate


def static_margin(disc: Disc, alpha: float = 0.0) -> float:
    """Return k_n = -dC_M / dC_Lift of a disc (eqn 59).

    Args:
        disc: Its own aerodynamics count; straight lines give one value for all angles.
        alpha: Angle of attack at which the slopes of a table are taken [rad].
    """
    if disc.aero == 'linear' and disc.linear is not None:
        return -disc.linear.CM_alpha / disc.linear.CL_alpha
    if disc.table is None:
        raise ValueError(f'disc {disc.name} has no table')
    last = len(disc.table.alpha) - 1
    row = min(max(int(np.searchsorted(disc.table.alpha, alpha, 'right')), 1), last)
    d_lift, _, d_moment = disc.table.coefficients[row] - disc.table.coefficients[row - 1]
    return float(-d_moment / d_lift)


def pitching_moment(
    k_n: ArrayLike, C_Lift: ArrayLike, pressure: ArrayLike, area: float, diameter: float
) -> FloatArray:
    """Return M = -k_n C_Lift q_inf S c [N m], for no moment without lift (eqn 58)."""
    C_M: FloatArray = -np.asarray(k_n, dtype=float) * np.asarray(C_Lift, dtype=float)
    M: FloatArray = C_M * np.asarray(pressure, dtype=float) * (area * diameter)
    return M


def uniform_inertia(mass: float, diameter: float) -> float:
    """Return I_z = m c^2 / 8 of a uniform flat cylinder [kg m^2] (eqn 60)."""
    return mass * diameter**2 / 8.0


def lift_for_weight(mass: float, gravity: float, pressure: ArrayLike, area: float) -> FloatArray:
    """Return the lift coefficient at which lift equals weight (eqn 62)."""
    return mass * gravity / (np.asarray(pressure, dtype=float) * area)


def advance_ratio(spin: ArrayLike, diameter: float, speed: ArrayLike) -> FloatArray:
    """Return AdvR = r c / (2 V) (eqn 63)."""
    rim_speed = np.asarray(spin, dtype=float) * (0.5 * diameter)
    ratio: FloatArray = rim_speed / np.asarray(speed, dtype=float)
    return ratio


def roll_rate_law(k_n: ArrayLike, ratio: ArrayLike) -> FloatArray:
    """Return the dimensionless roll rate 4 k_n / AdvR of level flight (eqn 64, corrected).

    For a uniform cylinder whose lift is its weight. Follows from eqns 54 and 58 to 63.
    """
    rate: FloatArray = 4.0 * np.asarray(k_n, dtype=float) / np.asarray(ratio, dtype=float)
    return rate


def printed_roll_rate_law(k_n: ArrayLike, ratio: ArrayLike) -> FloatArray:
    """Return 8 k_n / AdvR, eqn 64 as it is printed, to stand beside `roll_rate_law`."""
    return 2.0 * roll_rate_law(k_n, ratio)


def spin_rate(ratio: float, diameter: float, speed: float) -> float:
    """Return the spin of an advance ratio, r = 2 V AdvR / c [rad/s] (eqn 63)."""
    return 2.0 * speed * ratio / diameter
