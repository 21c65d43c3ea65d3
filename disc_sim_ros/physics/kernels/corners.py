"""Where a step leaves a line of the table, or passes a row of the spin table.

Between such corners the equations are smooth. `adaptive` ends steps there. Alpha and airspeed
inside a step are those of the cubics through its ends.
"""

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import Plant, State, Velocity, flow
from disc_sim_ros.physics.kernels.jit import inline, jit
from disc_sim_ros.physics.kernels.rk4 import Inputs, lerp
from disc_sim_ros.physics.kernels.simd import any_of, where
from disc_sim_ros.physics.kernels.stages import STAGES, rate
from disc_sim_ros.physics.kernels.wind import wind_at


@jit
def _alpha_and_speed(
    f: float, s: State, end: State, h: float, g0: Velocity, g1: Velocity, x: Inputs, K: FloatArray
) -> tuple[float, float]:
    """Return alpha and airspeed at the fraction `f` of a step, on the cubics through its ends."""
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
    air = flow(here, wind_at(Z, lerp(g0, g1, f), x.wind))
    return air.alpha, air.V


_ROUNDS = 4  # secants in the search for a corner
_THERE = 1e-12  # of an angle or a ratio: nearer to the corner, secants would follow rounding


@inline
def _secant(x: float, y: float, next_x: float, next_y: float, low: float, high: float) -> float:
    """Return where the line through two points crosses 0, kept between two bounds."""
    rise = next_y - y
    level = (abs(rise) <= 0.0) | (abs(next_y) <= _THERE)
    root = next_x - next_y * ((next_x - x) / where(level, 1.0, rise))
    kept: float = where(level, next_x, min(max(root, low), high))
    return kept


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
    a_m, _ = _alpha_and_speed(0.5, s, end, h, gust, next_gust, inputs, K)
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
        a_v, _ = _alpha_and_speed(vertex, s, end, h, gust, next_gust, inputs, K)

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
        for _ in range(_ROUNDS):
            root = _secant(x, y, next_x, next_y, low, f)
            x, y = next_x, next_y
            next_x = root
            alpha, _ = _alpha_and_speed(root, s, end, h, gust, next_gust, inputs, K)
            next_y = side * (alpha - corner)
        f = next_x
    return f, side, a_1


@inline
def ratio_exit(
    s: State,
    end: State,
    h: float,
    gust: Velocity,
    next_gust: Velocity,
    plant: Plant,
    inputs: Inputs,
    K: FloatArray,
) -> float:
    """Return the fraction of a step at which the advance ratio passes a row of the spin table.

    Returns 1.0 for none. Arguments are those of `dopri5.step`, with the state at the end.
    """
    ratios = plant.spin_terms[0, 1:, 0]
    _, V_0 = _alpha_and_speed(0.0, s, end, h, gust, next_gust, inputs, K)
    _, V_1 = _alpha_and_speed(1.0, s, end, h, gust, next_gust, inputs, K)
    start, stop = _ratio(s.r, V_0, plant), _ratio(end.r, V_1, plant)
    rises = where(stop > start, 1.0, -1.0)
    corner = stop
    for k in range(1, len(ratios)):  # the first on the way
        passed = (rises * (ratios[k] - start) > 0.0) & (rises * (corner - ratios[k]) > 0.0)
        corner = where(passed, ratios[k], corner)
    f = where(abs(stop - corner) > 0.0, 0.0, 1.0)
    if any_of(f < 1.0):
        # Nothing to look for gives level secants, and the end of the step.
        x, y, next_x, next_y = 0.0 * f, start - corner, 0.0 * f + 1.0, stop - corner
        for _ in range(_ROUNDS):
            root = _secant(x, y, next_x, next_y, 0.0, 1.0)
            x, y = next_x, next_y
            next_x = root
            _, V = _alpha_and_speed(root, s, end, h, gust, next_gust, inputs, K)
            next_y = _ratio(s.r + root * (end.r - s.r), V, plant) - corner
        f = where(f < 1.0, next_x, 1.0)
    fraction: float = f
    return fraction


@inline
def _ratio(r: float, V: float, plant: Plant) -> float:
    """Return the advance ratio, without its sign."""
    return abs(r) * plant.c / (2.0 * max(V, 1e-300))
