"""One step of the classic Runge-Kutta method, and where a step crosses the ground."""

import math
from typing import NamedTuple

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import (
    PRECESSION,
    Control,
    Plant,
    State,
    Velocity,
    consistent,
    derivative,
)
from disc_sim_ros.physics.kernels.jit import inline, jit
from disc_sim_ros.physics.kernels.rotation import rotation_elements
from disc_sim_ros.physics.kernels.simd import where
from disc_sim_ros.physics.kernels.wind import WindData, wind_at

STABLE = 2.78  # largest step times rate, of a decay or an oscillation, that stays bounded


class Inputs(NamedTuple):
    """The inputs of a flight: constant control inputs, the wind, and the noise of its gusts."""

    control: Control
    wind: WindData
    noise: FloatArray  # standard normal, shape (n, 5), a row for each drawn gust; (0, 5): no gusts


@jit
def rk4_step(
    s: State, h: float, gust: Velocity, next_gust: Velocity, plant: Plant, inputs: Inputs
) -> State:
    """Return the state after a step, during which the gust changes linearly.

    Args:
        s: State; its quaternion has unit length.
        h: Length of the step [s].
        gust: Gust at the beginning of the step.
        next_gust: Gust at its end.
        plant: Constants of the flight.
        inputs: Control inputs and wind.
    """
    control, wind = inputs.control, inputs.wind
    x, g = s, gust
    sum_k = axpy(s, -1.0, s)  # zeros
    for stage in range(4):  # one loop: the equations are compiled into one place
        k = derivative(x, wind_at(x.Z, g, wind), plant, control)
        sum_k = axpy(sum_k, 2.0 if 0 < stage < 3 else 1.0, k)
        a = 0.5 if stage < 2 else 1.0
        g = lerp(gust, next_gust, a)
        x = axpy(s, a * h, k)
    s = axpy(s, h / 6.0, sum_k)
    return consistent(s, wind_at(s.Z, next_gust, wind), plant, control)


@inline
def lerp(a: Velocity, b: Velocity, f: float) -> Velocity:
    """Return the velocity at the fraction `f` of the way from `a` to `b`."""
    return Velocity(a.X + f * (b.X - a.X), a.Y + f * (b.Y - a.Y), a.Z + f * (b.Z - a.Z))


@inline
def axpy(s: State, h: float, k: State) -> State:
    """Return s + h k."""
    return State(
        s.X + h * k.X,
        s.Y + h * k.Y,
        s.Z + h * k.Z,
        s.VX + h * k.VX,
        s.VY + h * k.VY,
        s.VZ + h * k.VZ,
        s.e0 + h * k.e0,
        s.e1 + h * k.e1,
        s.e2 + h * k.e2,
        s.e3 + h * k.e3,
        s.p + h * k.p,
        s.q + h * k.q,
        s.r + h * k.r,
        s.sigma + h * k.sigma,
    )


@inline
def is_sound(s: State, h: float, plant: Plant) -> bool:
    """Return True if the state is finite, and turns slowly enough for steps of `h` [s]."""
    total = s.X + s.Y + s.Z + s.VX + s.VY + s.VZ + s.e0 + s.e1 + s.e2 + s.e3
    fastest = max(abs(s.p), abs(s.q), abs(s.r))
    if plant.model < PRECESSION:
        fastest = max(fastest, abs(s.r) * plant.I_z / plant.I_x)
    return (abs(total + s.sigma) < math.inf) & (fastest * h <= STABLE)


@inline
def depth(s: State, rim: float) -> float:
    """Return Z (down) of the lowest point of a rim of a radius [m]; of the centre for 0."""
    Z = s.Z
    if rim > 0.0:
        _, _, _, _, _, _, zx, zy, _ = rotation_elements(s.e0, s.e1, s.e2, s.e3)
        Z = Z + rim * math.sqrt(zx * zx + zy * zy)
    return Z


@inline
def sinking(s: State, rim: float) -> float:
    """Return the rate of change of `depth` [m/s]."""
    VZ = s.VZ
    if rim > 0.0:
        _, _, _, _, _, _, zx, zy, zz = rotation_elements(s.e0, s.e1, s.e2, s.e3)
        tilt = math.sqrt(zx * zx + zy * zy)  # its sine
        level = tilt <= 0.0
        VZ += where(level, 0.0, rim * zz * (zy * s.p - zx * s.q) / where(level, 1.0, tilt))
    return VZ


@inline
def touches(s: State, end: State, plant: Plant) -> bool:
    """Return True if the disc comes to the ground in a step.

    A rim counts once it was clear of the ground, so that a tilted disc may be released with its
    centre at the ground; before, the centre counts.
    """
    rim_touches = (depth(end, plant.rim) > 0.0) & (depth(s, plant.rim) <= 0.0)
    return (end.Z > 0.0) | rim_touches


_TOLERANCE = 1e-12  # s; a thousandth of the promised 1e-9 s


@jit
def touchdown(
    s: State,
    h: float,
    end: State,
    gust: Velocity,
    next_gust: Velocity,
    plant: Plant,
    inputs: Inputs,
) -> tuple[float, Velocity, State]:
    """Find where the centre or the rim crosses the ground, Z = 0, in a step; see `touches`.

    Newton's method on the length of a shorter step from `s`. It starts at the root of the cubic
    through both ends, and bisects where an iterate leaves the bracket. A release on the ground is
    a landing at once, unless the disc rises first.

    Args:
        s: State at the beginning of the step.
        h: Length of the step [s].
        end: State at its end, below the ground.
        gust: Gust at the beginning of the step.
        next_gust: Gust at its end.
        plant: Constants of the flight.
        inputs: Control inputs and wind.

    Returns:
        Time from the beginning of the step [s], and gust and state then.
    """
    rim = plant.rim if depth(s, plant.rim) <= 0.0 else 0.0
    start_Z, end_Z = depth(s, rim), depth(end, rim)
    start_V, end_V = sinking(s, rim), sinking(end, rim)
    a, b = 0.0, h
    if start_Z >= 0.0:
        a = 1e-6 * h
        a_gust = lerp(gust, next_gust, a / h)
        if depth(rk4_step(s, a, gust, a_gust, plant, inputs), rim) >= 0.0:
            return 0.0, gust, s
    f = start_Z / (start_Z - end_Z)
    for _ in range(3):
        Z, slope, _ = cubic(start_Z, start_V, end_Z, end_V, h, f)
        f -= Z / slope if slope != 0.0 else 0.0
    next_x = f * h
    for _ in range(100):
        x = next_x if a < next_x < b else 0.5 * (a + b)
        x_gust = lerp(gust, next_gust, x / h)
        x_s = rk4_step(s, x, gust, x_gust, plant, inputs)
        Z, V = depth(x_s, rim), sinking(x_s, rim)
        next_x = x - Z / V if V != 0.0 else a
        if Z == 0.0 or abs(next_x - x) < _TOLERANCE or b - a < _TOLERANCE:
            break
        if Z > 0.0:
            b = x
        else:
            a = x
    return x, x_gust, x_s


@inline
def cubic(
    start_Z: float, start_V: float, end_Z: float, end_V: float, h: float, f: float
) -> tuple[float, float, float]:
    """Return Z and its two derivatives at the fraction `f` of a step, on the cubic of its ends.

    Args:
        start_Z: Z at the beginning [m].
        start_V: Its rate of change there [m/s].
        end_Z: Z at the end [m].
        end_V: Its rate of change there [m/s].
        h: Length of the step [s].
        f: Fraction of the step.
    """
    rise, start, stop = end_Z - start_Z, h * start_V, h * end_V
    c2 = 3.0 * rise - 2.0 * start - stop
    c3 = start + stop - 2.0 * rise
    Z = start_Z + f * (start + f * (c2 + f * c3))
    return Z, start + f * (2.0 * c2 + f * 3.0 * c3), 2.0 * c2 + f * 6.0 * c3


@inline
def top(s: State, end: State, h: float) -> float:
    """Return the least Z (down) in a step in which VZ changes from up to down."""
    f = s.VZ / (s.VZ - end.VZ)
    _, slope, curvature = cubic(s.Z, s.VZ, end.Z, end.VZ, h, f)
    Z, _, _ = cubic(s.Z, s.VZ, end.Z, end.VZ, h, f - slope / curvature)
    return Z
