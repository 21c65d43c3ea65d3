"""One step of the embedded Runge-Kutta pair of Dormand and Prince, of order 5 and 4.

Inside a step the disc stays on one line of its table (`aerodynamics.Row`), which is continued
beyond its ends: the right side is smooth, and the step keeps its order. `corners` tells where the
angle of attack leaves the line, so that the next step can end there. The nutation of a free disc,
which is known, is taken out of the step (`nutation`).

The functions take floats, or SIMD vectors with one float for each of several flights, each with a
step length of its own. `K` holds the rates of change at the seven stages, see `stages`.

Source: J. R. Dormand and P. J. Prince, "A family of embedded Runge-Kutta formulae", J. Comput.
Appl. Math. 6 (1980) 19-26; E. Hairer, S. P. Norsett and G. Wanner, "Solving Ordinary Differential
Equations I", 2nd ed., section II.5.
"""

import math
from typing import Any

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import (
    Plant,
    State,
    Velocity,
    consistent,
    derivative,
)
from disc_sim_ros.physics.kernels.jit import inline, jit
from disc_sim_ros.physics.kernels.nutation import (
    SLOWEST,
    forget,
    moved,
    nutation_of,
    put_turns,
    turned,
)
from disc_sim_ros.physics.kernels.rk4 import Inputs, axpy, lerp
from disc_sim_ros.physics.kernels.simd import where
from disc_sim_ros.physics.kernels.stages import STAGES, cos, put, rate, sin
from disc_sim_ros.physics.kernels.wind import wind_at

# Row i: the weights of stages 0 to i - 1 for the state at stage i; row 6 is the result.
_A = np.zeros((STAGES, STAGES))
_A[1, :1] = 1 / 5
_A[2, :2] = 3 / 40, 9 / 40
_A[3, :3] = 44 / 45, -56 / 15, 32 / 9
_A[4, :4] = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
_A[5, :5] = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
_A[6, :6] = 35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
_C = np.array([0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1])  # times of the stages in the step
# Result of order 5 less that of order 4.
_E = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])

# What an error of the state moves the landing by, to the order of magnitude, for a flight of
# seconds: an error of the velocity counts for its time, and one of the axis of the angular
# momentum, about which the disc nutates, turns the lift until the landing.
_TIME = 4.0  # s
_LEVER = 100.0  # m per rad
# An error of the nutation turns the lift to and fro, the less the faster it is; and it lifts the
# rim that touches the ground, so that a disc that comes in flat lands earlier or later.
_NUTATION_LEVER = 2000.0  # m/s per rad, over its rate
_FLATTEST = 50.0  # metres forward for each metre down
_SLOWEST_SPIN = 10.0  # rad/s; the precession of a slower disc follows its spin no more closely


@jit
def step(
    s: State,
    h: float,
    gust: Velocity,
    next_gust: Velocity,
    plant: Plant,
    inputs: Inputs,
    K: FloatArray,
) -> State:
    """Return the state after a step, during which the gust changes linearly; fills stages 1 to 6.

    Args:
        s: State; its quaternion has unit length.
        h: Length of the step [s].
        gust: Gust at the beginning of the step.
        next_gust: Gust at its end.
        plant: Constants of the flight; its `table` is a `Row`, if it is used.
        inputs: Control inputs and wind.
        K: Rates of change; stage 0 holds that of `s`. Stage 6 is that of the result.
    """
    control, wind = inputs.control, inputs.wind
    x = s
    n = nutation_of(s, plant, K)
    wh = n.rate * h
    put_turns(wh, K)
    for stage in range(1, STAGES):  # one loop: the equations are compiled into one place
        total = axpy(s, -1.0, s)  # zeros
        real, imaginary = total.p, total.p
        for j in range(stage):
            total = axpy(total, _A[stage, j], rate(K, j))
            real = real + _A[stage, j] * cos(K, j)
            imaginary = imaginary + _A[stage, j] * sin(K, j)
        # e^(i w h c) less what the weights make of its rate of change.
        p, q = turned(n, cos(K, stage) - 1.0 + wh * imaginary, sin(K, stage) - wh * real)
        x = moved(axpy(s, h, total), s, q * n.per_rate, -p * n.per_rate, n)
        g = lerp(gust, next_gust, _C[stage])
        if stage == STAGES - 1:
            x = consistent(x, wind_at(x.Z, g, wind), plant, control)
        k = derivative(x, wind_at(x.Z, g, wind), plant, control)
        put(K, stage, k)
    return x


@inline
def start(s: State, gust: Velocity, plant: Plant, inputs: Inputs, K: FloatArray) -> None:
    """Write the rate of change of `s` as stage 0."""
    put(K, 0, derivative(s, wind_at(s.Z, gust, inputs.wind), plant, inputs.control))
    forget(s, K)


@inline
def error_rate(s: State, plant: Plant, K: FloatArray) -> float:
    """Return the error of order 4 of the last step over its length, as a landing error [m/s].

    Args:
        s: State at the beginning of the step.
        plant: Constants of the flight.
        K: Rates of change of the step.
    """
    e = axpy(s, -1.0, s)
    real, imaginary = e.p, e.p
    for j in range(STAGES):
        e = axpy(e, _E[j], rate(K, j))
        real, imaginary = real - _E[j] * cos(K, j), imaginary - _E[j] * sin(K, j)
    n = nutation_of(s, plant, K)
    p, q = turned(n, real, imaginary)
    e = moved(e, s, p, q, n)
    nutation = where(n.rate < 0.0, -1.0, 1.0) * max(abs(n.rate), SLOWEST)
    spin = max(abs(s.r), _SLOWEST_SPIN)
    position = e.X * e.X + e.Y * e.Y + e.Z * e.Z
    velocity = e.VX * e.VX + e.VY * e.VY + e.VZ * e.VZ
    # Turns about x and y of the despun axes, and the angle between the disc and the axis of its
    # angular momentum (I_x p, I_x q, I_z r).
    turn_x = 2.0 * (s.e0 * e.e1 - s.e1 * e.e0 + s.e3 * e.e2 - s.e2 * e.e3)
    turn_y = 2.0 * (s.e0 * e.e2 - s.e2 * e.e0 + s.e1 * e.e3 - s.e3 * e.e1)
    x, y = e.p / nutation, e.q / nutation
    axis = (turn_y + x) * (turn_y + x) + (turn_x - y) * (turn_x - y) + e.r * e.r / (spin * spin)
    cone = x * x + y * y
    lever, touch = _NUTATION_LEVER / nutation, _FLATTEST * plant.rim
    return math.sqrt(
        position
        + _TIME * _TIME * velocity
        + _LEVER * _LEVER * axis
        + (lever * lever + touch * touch) * cone
    )


@inline
def with_table(plant: Plant, table: Any) -> Plant:
    """Return the constants with another table."""
    return Plant(
        plant.m,
        plant.c,
        plant.S,
        plant.I_x,
        plant.I_z,
        plant.C_Lp,
        plant.C_Mq,
        plant.C_Nr,
        plant.rho,
        plant.g,
        plant.model,
        plant.moment_axes,
        plant.use_linear,
        plant.line,
        table,
        plant.spin_terms,
        plant.rim,
    )
