"""One fixed step of the classic Runge-Kutta method, shared by every flight."""

import math

from disc_sim_ros.core._jit import inline, jit
from disc_sim_ros.core.disc import FloatArray
from disc_sim_ros.core.equations import (
    PRECESSION,
    Control,
    Plant,
    State,
    Velocity,
    consistent,
    derivative,
)
from disc_sim_ros.core.turbulence import WindData, wind_at

STABLE = 2.78  # largest step times rate, of a decay or an oscillation, that stays bounded


@jit
def rk4_step(
    s: State,
    h: float,
    gust: Velocity,
    next_gust: Velocity,
    wind: WindData,
    plant: Plant,
    table: FloatArray,
    spin_terms: FloatArray,
    control: Control,
) -> State:
    """Return the state after `h`, while the gust goes straight from `gust` to `next_gust`.

    See `equations.derivative` for the other arguments.
    """
    x, g = s, gust
    sum_k = moved(s, -1.0, s)  # zeros
    for stage in range(4):  # one loop: the equations are compiled into one place
        k = derivative(x, wind_at(x.Z, g, wind), plant, table, spin_terms, control)
        sum_k = moved(sum_k, 2.0 if 0 < stage < 3 else 1.0, k)
        a = 0.5 if stage < 2 else 1.0
        g = between(gust, next_gust, a)
        x = moved(s, a * h, k)
    s = moved(s, h / 6.0, sum_k)
    return consistent(s, wind_at(s.Z, next_gust, wind), plant, table, spin_terms, control)


@inline
def between(a: Velocity, b: Velocity, f: float) -> Velocity:
    """Return the velocity at the fraction `f` of the way from `a` to `b`."""
    return Velocity(a.X + f * (b.X - a.X), a.Y + f * (b.Y - a.Y), a.Z + f * (b.Z - a.Z))


@inline
def moved(s: State, h: float, k: State) -> State:
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
    """Say whether the state is finite, and turns slowly enough for steps of `h` to follow."""
    total = s.X + s.Y + s.Z + s.VX + s.VY + s.VZ + s.e0 + s.e1 + s.e2 + s.e3
    fastest = max(abs(s.p), abs(s.q), abs(s.r))
    if plant.model != PRECESSION:
        fastest = max(fastest, abs(s.r) * plant.I_z / plant.I_x)
    return (abs(total + s.sigma) < math.inf) & (fastest * h <= STABLE)
