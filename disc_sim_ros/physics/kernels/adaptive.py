"""The integration of a flight with error control, from release to the ground.

Steps of `dopri5` are as long as its error estimate allows, and end at the corners of the table, of
the gusts and of the time of flight. The corners are where all methods lose their order; between
them the equations are smooth.
"""

import math
from typing import NamedTuple

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels import corners, dopri5
from disc_sim_ros.physics.kernels.aerodynamics import Row, row_of, search
from disc_sim_ros.physics.kernels.dopri5 import with_table
from disc_sim_ros.physics.kernels.equations import Plant, State, Velocity, flow
from disc_sim_ros.physics.kernels.integrator import (
    FLYING,
    LANDED,
    LOST,
    IntegrationResult,
    IntegratorState,
    Options,
    airspeed,
    initialise,
    write_sample,
)
from disc_sim_ros.physics.kernels.jit import entry, inline, jit
from disc_sim_ros.physics.kernels.nutation import remember
from disc_sim_ros.physics.kernels.rk4 import (
    Inputs,
    cubic,
    depth,
    is_sound,
    lerp,
    sinking,
    top,
    touches,
)
from disc_sim_ros.physics.kernels.simd import where
from disc_sim_ros.physics.kernels.wind import (
    GUST_INTERVAL,
    gust_of,
    next_filter,
    wind_at,
)

TOLERANCE = 2e-5  # m/s, landing error a second of flight; see docs/benchmarks.md
FIRST_STEP = 5e-3  # s
LONGEST = 0.1  # s
LONGEST_IN_SPIN_TABLE = (
    0.02  # s; corners over the advance ratio, few and slow, are not searched for
)
SHORTEST = 1e-6  # s; taken whatever the error, as at a corner that is not searched for
SOUND = 1e-4  # s; a disc that turns too fast for RK4 steps of this length is lost
_SAFETY = 0.9
_LEAST = 0.2  # factors of the length from step to step
_MOST = 5.0
CLOSE = 1e-9  # s; a step that ends this near to a time ends at it


class Progress(NamedTuple):
    """Where a flight is between two attempts of a step, and what it tries next."""

    t: float  # s since the release
    h: float  # length of the next step [s]
    after_cut: float  # length of the step after one that ends at a corner of the table [s]
    row: float  # number of the row of the table that holds
    alpha: float  # angle of attack now [rad]
    cut: (
        float  # 1.0 or -1.0 where the next step ends at the upper or lower end of this row, or 0.0
    )


class Trial(NamedTuple):
    """The outcome of an attempt."""

    accepted: bool  # the step stands; else the next attempt is a shorter one
    progress: Progress


@inline
def judge(
    p: Progress,
    h: float,
    next_t: float,
    ends_early: bool,
    s: State,
    end: State,
    gust: Velocity,
    next_gust: Velocity,
    plant: Plant,
    inputs: Inputs,
    low_end: float,
    high_end: float,
    K: FloatArray,
) -> Trial:
    """Judge an attempted step, and return what comes next.

    Args:
        p: Progress before it.
        h: Its length [s].
        next_t: Its end [s since the release].
        ends_early: It ends before `p.h`, at a corner in time, so that it reaches no corner of the
            table that was searched for.
        s: State at its beginning.
        end: State at its end.
        gust: Gust at its beginning.
        next_gust: Gust at its end.
        plant: Constants of the flight, with the row as table.
        inputs: Control inputs and wind.
        low_end: Angle of attack at which the row begins [rad], or -inf where it is the first.
        high_end: And where it ends [rad], or inf where it is the last.
        K: Rates of change of the step.
    """
    error = dopri5.error_rate(s, plant, K)
    good = (error <= TOLERANCE) | (h <= SHORTEST)
    known = error < math.inf  # not so for nan
    per_length = math.sqrt(math.sqrt(TOLERANCE / max(where(known, error, 1.0), 1e-300)))
    factor = where(known, min(max(_SAFETY * per_length, _LEAST), _MOST), _LEAST)
    longest = LONGEST_IN_SPIN_TABLE if len(plant.spin_terms) > 0 else LONGEST
    proposed = min(max(h * factor, SHORTEST), longest)
    cut = where(ends_early, 0.0, p.cut)
    at_corner = abs(cut) > 0.0

    f, side, alpha = corners.first_exit(
        s, end, h, gust, next_gust, inputs, low_end, high_end, K, p.alpha
    )
    to_corner = max(f * h, SHORTEST)
    exits = good & (abs(side) > 0.0) & (abs(cut) <= 0.0) & (to_corner < h)
    accepted = good & ((abs(side) <= 0.0) | at_corner | (to_corner >= h))
    to_ratio = h
    if len(plant.spin_terms) > 0:
        to_ratio = h * corners.ratio_exit(s, end, h, gust, next_gust, plant, inputs, K)
    # No row over the advance ratio holds for a whole step: to end near its corner is enough.
    stays = (to_ratio <= SHORTEST) | (to_ratio >= h - SHORTEST) | (to_ratio >= f * h)
    passes = good & (to_ratio > SHORTEST) & (to_ratio < h - SHORTEST) & (to_ratio < f * h)
    exits, accepted = exits & stays, accepted & stays
    # A step that leaves the row without a shorter one before it ends at the corner itself.
    turned = where(at_corner, cut, side)

    next_h = where(
        ends_early, max(proposed, p.h), where(at_corner, max(proposed, p.after_cut), proposed)
    )
    next_h = where(accepted, next_h, where(exits, to_corner, where(passes, to_ratio, proposed)))
    return Trial(
        accepted,
        Progress(
            where(accepted, next_t, p.t),
            next_h,
            where(exits, proposed, p.after_cut),
            where(accepted, p.row + turned, p.row),
            where(accepted, alpha, p.alpha),
            where(exits, side, 0.0),
        ),
    )


@inline
def ends_of(i: float, row: Row, count: int, smooth: bool) -> tuple[float, float]:
    """Return the angles of attack at which row `i` of `count` is left; infinite for none [rad].

    Args:
        i: Number of the row.
        row: The row.
        count: Number of rows.
        smooth: True if the rows are not used.
    """
    never = math.inf if smooth else 0.0
    low = where(i <= 0.0, -math.inf, row.alpha - never)
    high = where(i >= count - 2.0, math.inf, row.end + never)
    return low, high


@inline
def first_progress(s: State, gust: Velocity, plant: Plant, inputs: Inputs) -> Progress:
    """Return the progress of a flight at its release."""
    alpha = flow(s, wind_at(s.Z, gust, inputs.wind)).alpha
    i, _ = search(alpha, plant.table)
    return Progress(0.0, FIRST_STEP, FIRST_STEP, i, alpha, 0.0)


@entry
def integrate_adaptive(
    s: State, plant: Plant, inputs: Inputs, options: Options, samples: FloatArray, K: FloatArray
) -> IntegrationResult:
    """Integrate a flight to its end with error control, and write evenly timed samples.

    Args:
        s: State at release.
        plant: Constants of the flight.
        inputs: Control inputs, held for the whole flight, wind and gust noise.
        options: Duration, ground and sample rate; the step is not used.
        samples: As for `integrator.integrate`.
        K: Work space, see `stages`.
    """
    x = initialise(s, plant, inputs)
    if len(samples) > 0:
        write_sample(samples[0], 0.0, x.state, wind_at(s.Z, x.gust, inputs.wind))
    p = first_progress(x.state, x.gust, plant, inputs)
    dopri5.start(x.state, x.gust, with_table(plant, row_of(plant.table, p.row)), inputs, K)
    return continue_adaptive(x, p, s.Z, plant, inputs, options, samples, K)


@jit
def continue_adaptive(  # noqa: PLR0915 - one loop, whose parts share all of its state
    x: IntegratorState,
    p: Progress,
    apex_Z: float,
    plant: Plant,
    inputs: Inputs,
    options: Options,
    samples: FloatArray,
    K: FloatArray,
) -> IntegrationResult:
    """Integrate a flight from `x` and `p`, with the apex so far, to its end.

    `K` begins with the rate of change of `x`, see `stages.carry`.
    """
    duration, wind, noise = options.duration, inputs.wind, inputs.noise
    written = min(len(samples), 1)
    s, gust = x.state, x.gust
    filters, start_gust, end_gust, i = x.filters, x.start_gust, x.end_gust, x.interval
    smooth = plant.use_linear and len(plant.spin_terms) == 0
    landed = False
    while p.t < duration and not landed:
        t = p.t
        end_t = duration
        if len(noise) > 0:
            if t >= (i + 1) * GUST_INTERVAL:
                i += 1
                start_gust = end_gust
                V = airspeed(s, wind_at(s.Z, gust, wind))
                filters = next_filter(filters, V, s.Z, GUST_INTERVAL, noise[i + 1])
                end_gust = gust_of(filters, s.Z, wind)
            end_t = min(duration, (i + 1) * GUST_INTERVAL)
        h, next_t = p.h, t + p.h
        ends_early = next_t > end_t - CLOSE
        if ends_early:
            h, next_t = end_t - t, end_t
        next_gust = gust
        if len(noise) > 0:
            next_gust = lerp(start_gust, end_gust, min(next_t / GUST_INTERVAL - i, 1.0))

        row = row_of(plant.table, p.row)
        own = with_table(plant, row)
        low_end, high_end = ends_of(p.row, row, len(plant.table), smooth)
        next_s = dopri5.step(s, h, gust, next_gust, own, inputs, K)
        trial = judge(
            p, h, next_t, ends_early, s, next_s, gust, next_gust, own, inputs, low_end, high_end, K
        )
        if not trial.accepted:
            p = trial.progress
            continue
        if not is_sound(next_s, SOUND, plant):
            return IntegrationResult(LOST, t, s, apex_Z, written)
        landed = options.ground and comes_down(s, next_s, h, plant)
        if landed:
            h, next_gust, next_s = touch(s, h, next_s, gust, next_gust, own, inputs, K)
            next_t = t + h

        began = written
        while written < len(samples) and written / options.sample_rate <= next_t + 1e-12:
            sample_t = written / options.sample_rate
            d = min(sample_t - t, h)
            d_gust = lerp(gust, next_gust, d / h if h > 0.0 else 0.0)
            d_s = dopri5.step(s, d, gust, d_gust, own, inputs, K)
            write_sample(samples[written], sample_t, d_s, wind_at(d_s.Z, d_gust, wind))
            written += 1
        if written > began:  # the stages of the whole step again
            next_s = dopri5.step(s, h, gust, next_gust, own, inputs, K)
        if s.VZ < 0.0 <= next_s.VZ:
            apex_Z = min(apex_Z, top(s, next_s, h))
        apex_Z = min(apex_Z, next_s.Z)
        remember(s, next_s, h, True, plant, K)  # noqa: FBT003
        s, gust = next_s, next_gust
        p = trial.progress
        if landed:
            p = Progress(next_t, p.h, p.after_cut, p.row, p.alpha, p.cut)
    return IntegrationResult(LANDED if landed else FLYING, p.t, s, apex_Z, written)


@jit
def comes_down(s: State, end: State, h: float, plant: Plant) -> bool:
    """Return True if the disc comes to the ground in a step, at its end or on the way."""
    rim = plant.rim
    clear = depth(s, rim) <= 0.0  # else the centre counts, as in `touches`
    start_Z, end_Z = where(clear, depth(s, rim), s.Z), where(clear, depth(end, rim), end.Z)
    start_V, end_V = where(clear, sinking(s, rim), s.VZ), where(clear, sinking(end, rim), end.VZ)
    dips = (start_V > 0.0) & (end_V < 0.0) & (start_Z <= 0.0)
    f = where(dips, start_V / where(dips, start_V - end_V, 1.0), 1.0)
    lowest, _, _ = cubic(start_Z, start_V, end_Z, end_V, h, f)
    down: bool = touches(s, end, plant) | (dips & (lowest > 0.0))
    return down


_SAME = 1e-12  # s; a thousandth of the promised 1e-9 s


@jit
def touch(
    s: State,
    h: float,
    end: State,
    gust: Velocity,
    next_gust: Velocity,
    plant: Plant,
    inputs: Inputs,
    K: FloatArray,
) -> tuple[float, Velocity, State]:
    """Find where the centre or the rim crosses the ground in a step; see `rk4.touchdown`.

    Arguments and results are those of `rk4.touchdown`; each shorter step is one of `dopri5`.
    """
    rim = plant.rim if depth(s, plant.rim) <= 0.0 else 0.0
    start_Z, end_Z = depth(s, rim), depth(end, rim)
    start_V, end_V = sinking(s, rim), sinking(end, rim)
    a, b = 0.0, h
    if start_Z >= 0.0:
        a = 1e-6 * h
        a_gust = lerp(gust, next_gust, a / h)
        if depth(dopri5.step(s, a, gust, a_gust, plant, inputs, K), rim) >= 0.0:
            return 0.0, gust, s
    if end_Z <= 0.0:  # it only dips
        b = h * start_V / (start_V - end_V)
    next_x = b * start_Z / (start_Z - max(end_Z, 1e-9))
    for _ in range(5):
        Z, slope, _ = cubic(start_Z, start_V, end_Z, end_V, h, next_x / h)
        next_x -= Z / slope * h if slope != 0.0 else 0.0
    for _ in range(100):
        x = next_x if a < next_x < b else 0.5 * (a + b)
        x_gust = lerp(gust, next_gust, x / h)
        x_s = dopri5.step(s, x, gust, x_gust, plant, inputs, K)
        Z, V = depth(x_s, rim), sinking(x_s, rim)
        next_x = x - Z / V if V != 0.0 else a
        if Z == 0.0 or abs(next_x - x) < _SAME or b - a < _SAME:
            break
        if Z > 0.0:
            b = x
        else:
            a = x
    return x, x_gust, x_s
