"""What happens within a step: where it crosses the ground, and how high it goes."""

from disc_sim_ros.core._jit import inline, jit
from disc_sim_ros.core.disc import FloatArray
from disc_sim_ros.core.equations import Control, Plant, State, Velocity
from disc_sim_ros.core.rk4 import between, rk4_step
from disc_sim_ros.core.turbulence import WindData

_TOLERANCE = 1e-12  # s; a thousandth of what is promised


@jit
def touchdown(
    s: State,
    h: float,
    end: State,
    g: Velocity,
    next_g: Velocity,
    wind: WindData,
    plant: Plant,
    table: FloatArray,
    spin_terms: FloatArray,
    control: Control,
) -> tuple[float, Velocity, State]:
    """Return when Z = 0 within a step to `end`, below the ground, and gust and state there.

    Newton's method on shorter steps from `s`, from where a cubic through both ends is 0, and
    halving where it leads away. A release on the ground is not a landing if the disc rises first:
    then the way back counts.
    """
    a, b = 0.0, h
    if s.Z >= 0.0:
        a = 1e-6 * h
        a_g = between(g, next_g, a / h)
        if rk4_step(s, a, g, a_g, wind, plant, table, spin_terms, control).Z >= 0.0:
            return 0.0, g, s
    f = s.Z / (s.Z - end.Z)
    for _ in range(3):
        Z, slope, _ = cubic(s, end, h, f)
        f -= Z / slope if slope != 0.0 else 0.0
    next_x = f * h
    for _ in range(100):
        x = next_x if a < next_x < b else 0.5 * (a + b)
        x_g = between(g, next_g, x / h)
        x_s = rk4_step(s, x, g, x_g, wind, plant, table, spin_terms, control)
        next_x = x - x_s.Z / x_s.VZ if x_s.VZ != 0.0 else a
        if x_s.Z == 0.0 or abs(next_x - x) < _TOLERANCE or b - a < _TOLERANCE:
            break
        if x_s.Z > 0.0:
            b = x
        else:
            a = x
    return x, x_g, x_s


@inline
def cubic(s: State, end: State, h: float, f: float) -> tuple[float, float, float]:
    """Return Z and two derivatives by `f`, the fraction of a step, on the cubic of its ends."""
    rise, start, stop = end.Z - s.Z, h * s.VZ, h * end.VZ
    c2 = 3.0 * rise - 2.0 * start - stop
    c3 = start + stop - 2.0 * rise
    Z = s.Z + f * (start + f * (c2 + f * c3))
    return Z, start + f * (2.0 * c2 + f * 3.0 * c3), 2.0 * c2 + f * 6.0 * c3


@inline
def top(s: State, end: State, h: float) -> float:
    """Return the least Z (down) of a step in which VZ turns from up to down."""
    f = s.VZ / (s.VZ - end.VZ)
    _, slope, curvature = cubic(s, end, h, f)
    Z, _, _ = cubic(s, end, h, f - slope / curvature)
    return Z
