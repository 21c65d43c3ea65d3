"""One step of the embedded Runge-Kutta pair of Dormand and Prince, of order 5 and 4.

Inside a step the disc stays on one line of its table (`aerodynamics.Row`), which is continued
beyond its ends: the right side is smooth, and the step keeps its order. `first_exit` tells where
the angle of attack leaves the line, so that the next step can end there.

The functions take floats, or SIMD vectors with one float for each of several flights, each with a
step length of its own. `K` holds the rates of change at the seven stages, 14 numbers each: shape
(98,), or (98, WIDTH) for vectors.

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
    flow,
)
from disc_sim_ros.physics.kernels.jit import inline, jit
from disc_sim_ros.physics.kernels.rk4 import Inputs, axpy, lerp
from disc_sim_ros.physics.kernels.simd import any_of, where
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE, load_state, store_state
from disc_sim_ros.physics.kernels.wind import wind_at

STAGES = 7

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
# seconds: an error of the velocity counts for 1 s, one of the attitude turns the lift.
_SECOND = 1.0  # s
_LEVER = 20.0  # m per rad of attitude
_SLOWEST = 1.0  # rad/s; rates act on the attitude for the time of a turn of nutation, at most 1 s
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
    for stage in range(1, STAGES):  # one loop: the equations are compiled into one place
        total = axpy(s, -1.0, s)  # zeros
        for j in range(stage):
            total = axpy(total, _A[stage, j], rate(K, j))
        x = axpy(s, h, total)
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


@inline
def rate(K: FloatArray, stage: int) -> State:
    """Return the rate of change at a stage."""
    return load_state(K, STATE_SIZE * stage)


@inline
def put(K: FloatArray, stage: int, k: State) -> None:
    """Write the rate of change at a stage."""
    store_state(K, STATE_SIZE * stage, k)


@inline
def error_rate(s: State, plant: Plant, K: FloatArray) -> float:
    """Return the error of order 4 of the last step over its length, as a landing error [m/s].

    Args:
        s: State at the beginning of the step.
        plant: Constants of the flight.
        K: Rates of change of the step.
    """
    e = axpy(s, -1.0, s)
    for j in range(STAGES):
        e = axpy(e, _E[j], rate(K, j))
    nutation = max(abs(s.r) * plant.I_z / plant.I_x, _SLOWEST)
    spin = max(abs(s.r), _SLOWEST_SPIN)
    position = e.X * e.X + e.Y * e.Y + e.Z * e.Z
    velocity = e.VX * e.VX + e.VY * e.VY + e.VZ * e.VZ
    attitude = 4.0 * (e.e0 * e.e0 + e.e1 * e.e1 + e.e2 * e.e2 + e.e3 * e.e3)
    rates = (e.p * e.p + e.q * e.q) / (nutation * nutation) + e.r * e.r / (spin * spin)
    return math.sqrt(
        position + _SECOND * _SECOND * velocity + _LEVER * _LEVER * (attitude + rates)
    )


@jit
def _alpha(
    f: float, s: State, end: State, h: float, g0: Velocity, g1: Velocity, x: Inputs, K: FloatArray
) -> float:
    """Return alpha at the fraction `f` of a step, on the cubics through its ends [rad]."""
    a, b = rate(K, 0), rate(K, STAGES - 1)
    f2 = f * f
    to = f2 * (3.0 - 2.0 * f)
    ha = h * (f * (1.0 - f) * (1.0 - f))
    hb = h * (f2 * (f - 1.0))
    Z = s.Z + to * (end.Z - s.Z) + ha * a.Z + hb * b.Z
    here = State(
        s.X,
        s.Y,
        Z,
        s.VX + to * (end.VX - s.VX) + ha * a.VX + hb * b.VX,
        s.VY + to * (end.VY - s.VY) + ha * a.VY + hb * b.VY,
        s.VZ + to * (end.VZ - s.VZ) + ha * a.VZ + hb * b.VZ,
        s.e0 + to * (end.e0 - s.e0) + ha * a.e0 + hb * b.e0,
        s.e1 + to * (end.e1 - s.e1) + ha * a.e1 + hb * b.e1,
        s.e2 + to * (end.e2 - s.e2) + ha * a.e2 + hb * b.e2,
        s.e3 + to * (end.e3 - s.e3) + ha * a.e3 + hb * b.e3,
        s.p,
        s.q,
        s.r,
        s.sigma,
    )
    return flow(here, wind_at(Z, lerp(g0, g1, f), x.wind)).alpha


_ROUNDS = 4  # secants in the search for a corner


@jit
def first_exit(
    s: State,
    end: State,
    h: float,
    gust: Velocity,
    next_gust: Velocity,
    inputs: Inputs,
    low_end: float,
    high_end: float,
    K: FloatArray,
    a_0: float,
) -> tuple[float, float, float]:
    """Return where in a step the angle of attack first leaves a line of the table.

    Looks at the middle and the end of the step, and at the extremum between them.

    Args:
        s: State at the beginning of the step, on the line.
        end: State at its end.
        h: Length of the step [s].
        gust: Gust at the beginning of the step.
        next_gust: Gust at its end.
        inputs: Wind.
        low_end: Angle of attack where the line begins [rad], or -inf.
        high_end: And where it ends [rad], or inf.
        K: Rates of change of the step.
        a_0: Angle of attack at its beginning [rad].

    Returns:
        The fraction of the step; 1.0 if it leaves upwards, -1.0 if downwards, 0.0 if it stays; and
        the angle of attack at the end of the step [rad].
    """
    a_m = _alpha(0.5, s, end, h, gust, next_gust, inputs, K)
    a_1 = flow(end, wind_at(end.Z, next_gust, inputs.wind)).alpha
    bend = 2.0 * (a_0 + a_1) - 4.0 * a_m
    slope = 4.0 * a_m - 3.0 * a_0 - a_1
    flat = abs(bend) <= 0.0
    vertex = -0.5 * slope / where(flat, 1.0, bend)
    inside = (vertex > 0.0) & (vertex < 1.0)
    vertex = where(inside, vertex, 0.5)
    a_v = a_0 + vertex * (slope + vertex * bend)
    beyond = inside & ((a_v < low_end) | (a_v > high_end))
    vertex = where(beyond, vertex, 0.5)
    a_v = a_m
    if any_of(beyond):
        a_v = _alpha(vertex, s, end, h, gust, next_gust, inputs, K)

    # The first of the middle, the extremum and the end that is outside, and the one before it.
    early, late = where(vertex < 0.5, vertex, 0.5), where(vertex < 0.5, 0.5, vertex)
    a_early, a_late = where(vertex < 0.5, a_v, a_m), where(vertex < 0.5, a_m, a_v)
    out_early = (a_early < low_end) | (a_early > high_end)
    out_late = (a_late < low_end) | (a_late > high_end)
    f = where(out_early, early, where(out_late, late, 1.0))
    a_f = where(out_early, a_early, where(out_late, a_late, a_1))
    low = where(out_early, 0.0, where(out_late, early, late))
    a_low = where(out_early, a_0, where(out_late, a_early, a_late))
    side = where(a_f > high_end, 1.0, where(a_f < low_end, -1.0, 0.0))
    if any_of(abs(side) > 0.0):
        corner = where(side > 0.0, high_end, low_end)
        x, y = low, side * (a_low - corner)
        next_x, next_y = f, side * (a_f - corner)
        for _ in range(_ROUNDS):  # secants, kept between the two
            rise = next_y - y
            level = abs(rise) <= 0.0
            root = next_x - next_y * ((next_x - x) / where(level, 1.0, rise))
            root = where(level, next_x, min(max(root, low), f))
            x, y = next_x, next_y
            next_x = root
            next_y = side * (_alpha(root, s, end, h, gust, next_gust, inputs, K) - corner)
        f = next_x
    return f, side, a_1


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
