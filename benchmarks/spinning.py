# ruff: noqa: N806 - the paper's letters
"""The same flight in three kinds of axes, by the same fixed-step Runge-Kutta loop.

DESPUN is `kernels.equations`: attitude and rates in axes that tilt with the disc but do not spin.
SPINNING has both in axes fixed in the disc, with eqn 11 as printed; nothing else differs. PRINTED
also has the velocity in axes fixed in the disc: eqns 10 and 11 as the paper prints them. Forces
and moments are those of `kernels.equations` in all three, in still air, without control inputs,
for the exact model.
"""

import math
from typing import TYPE_CHECKING

from disc_sim_ros.physics.kernels import equations
from disc_sim_ros.physics.kernels.equations import Control, Plant, State, Velocity
from disc_sim_ros.physics.kernels.jit import entry, jit
from disc_sim_ros.physics.kernels.rk4 import axpy
from disc_sim_ros.physics.kernels.rotation import rotation_elements

if TYPE_CHECKING:
    from disc_sim_ros.arrays import FloatArray

DESPUN, SPINNING, PRINTED = range(3)
STILL = Velocity(0.0, 0.0, 0.0)
NO_CONTROL = Control()


@jit
def derivative(s: State, axes: int, plant: Plant) -> State:
    """Return the rate of change of a state.

    Args:
        s: State. Unless `axes` is DESPUN its quaternion and p, q, r are of axes fixed in the disc,
            and sigma is 0; in PRINTED its VX, VY, VZ are the components u, v, w in these axes.
        axes: DESPUN, SPINNING or PRINTED.
        plant: Constants of the flight.
    """
    if axes == DESPUN:
        return equations.derivative(s, STILL, plant, NO_CONTROL)
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation_elements(s.e0, s.e1, s.e2, s.e3)
    X_dot, Y_dot, Z_dot = s.VX, s.VY, s.VZ
    if axes == PRINTED:
        u, v, w = s.VX, s.VY, s.VZ
        X_dot = xx * u + xy * v + xz * w  # eqn 33
        Y_dot = yx * u + yy * v + yz * w
        Z_dot = zx * u + zy * v + zz * w
    p, q, r = s.p, s.q, s.r
    at = State(s.X, s.Y, s.Z, X_dot, Y_dot, Z_dot, s.e0, s.e1, s.e2, s.e3, p, q, r, 0.0)
    a = equations.flow(at, STILL)
    C = equations.coefficients(a, r, plant)
    X, Y, Z = equations.force(a, C, plant)
    m = equations.moment(a, at, C, plant, NO_CONTROL)

    if axes == PRINTED:  # eqn 10
        a_x = X / plant.m + zx * plant.g - (q * w - r * v)
        a_y = Y / plant.m + zy * plant.g - (r * u - p * w)
        a_z = Z / plant.m + zz * plant.g - (p * v - q * u)
    else:
        a_x = (xx * X + xy * Y + xz * Z) / plant.m
        a_y = (yx * X + yy * Y + yz * Z) / plant.m
        a_z = (zx * X + zy * Y + zz * Z) / plant.m + plant.g

    # Eqn 11 with I_x = I_y, and the rate of the quaternion, e (0, p, q, r) / 2.
    L = m.L + m.D_xx * p + m.D_xy * q
    M = m.M + m.D_xy * p + m.D_yy * q
    return State(
        X_dot,
        Y_dot,
        Z_dot,
        a_x,
        a_y,
        a_z,
        -0.5 * (s.e1 * p + s.e2 * q + s.e3 * r),
        0.5 * (s.e0 * p + s.e2 * r - s.e3 * q),
        0.5 * (s.e0 * q + s.e3 * p - s.e1 * r),
        0.5 * (s.e0 * r + s.e1 * q - s.e2 * p),
        (L - q * r * (plant.I_z - plant.I_x)) / plant.I_x,
        (M + p * r * (plant.I_z - plant.I_x)) / plant.I_x,
        m.N / plant.I_z,
        0.0,
    )


@entry
def flown(
    s: State,
    axes: int,
    step: float,
    duration: float,
    plant: Plant,
) -> State:
    """Return the state after `duration` in steps of `step`, the last one shorter [s]."""
    n = math.ceil(duration / step * (1.0 - 1e-12))
    for i in range(n):
        h = step if i < n - 1 else duration - i * step
        k1 = derivative(s, axes, plant)
        k2 = derivative(axpy(s, 0.5 * h, k1), axes, plant)
        k3 = derivative(axpy(s, 0.5 * h, k2), axes, plant)
        k4 = derivative(axpy(s, h, k3), axes, plant)
        s = axpy(s, h / 6.0, axpy(axpy(axpy(k1, 2.0, k2), 2.0, k3), 1.0, k4))
        n_e = 1.0 / math.sqrt(s.e0 * s.e0 + s.e1 * s.e1 + s.e2 * s.e2 + s.e3 * s.e3)
        s = State(s.X, s.Y, s.Z, s.VX, s.VY, s.VZ, s.e0 * n_e, s.e1 * n_e, s.e2 * n_e, s.e3 * n_e,
                  s.p, s.q, s.r, s.sigma)  # fmt: skip
    return s


@entry
def rates(y: 'FloatArray', axes: int, plant: Plant) -> State:
    """Return `derivative` of a state given as an array, shape (14,), for scipy."""
    s = State(y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7], y[8], y[9], y[10], y[11], y[12],
              y[13])  # fmt: skip
    return derivative(s, axes, plant)


def released(state: State, axes: int) -> State:
    """Return a state at release in these axes; at spin angle 0 their axes 2 are the same."""
    if axes != PRINTED:
        return state
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation_elements(*state[6:10])
    V_X, V_Y, V_Z = state[3:6]
    return state._replace(
        VX=xx * V_X + yx * V_Y + zx * V_Z,
        VY=xy * V_X + yy * V_Y + zy * V_Z,
        VZ=xz * V_X + yz * V_Y + zz * V_Z,
    )
