"""A flight in fixed steps from release to the ground, compiled as a whole."""

import math
from typing import NamedTuple

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import (
    Control,
    Plant,
    State,
    Velocity,
    coefficients,
    consistent,
    derivative,
    flow,
    force,
    moment,
)
from disc_sim_ros.physics.kernels.jit import entry, inline, jit
from disc_sim_ros.physics.kernels.rk4 import is_sound, lerp, rk4_step, top, touchdown
from disc_sim_ros.physics.kernels.wind import (
    GUST_INTERVAL,
    GustFilter,
    WindData,
    first_filter,
    gust_of,
    next_filter,
    wind_at,
)

FLYING, LANDED, LOST = range(3)  # LOST: beyond the numbers or the rates that a step can follow
STATE_SIZE = len(State._fields)


class Progress(NamedTuple):
    """A flight between two steps: all that the next one needs."""

    k: int  # steps done
    state: State
    gust: Velocity  # at the disc, now
    filters: GustFilter  # that drew `next_drawn`
    drawn: Velocity  # the gusts at both ends of the present interval
    next_drawn: Velocity
    interval: int  # its number, from 0


class Ended(NamedTuple):
    """How a flight ended: why, when, where, its apex and how many samples were written."""

    status: int  # FLYING (time is up), LANDED or LOST (the state is the last sound one)
    t: float  # s
    state: State
    apex_Z: float  # m, least Z (down) on the way
    samples: int


@jit
def begin(
    s: State,
    plant: Plant,
    table: FloatArray,
    spin_terms: FloatArray,
    control: Control,
    wind: WindData,
    noise: FloatArray,
) -> Progress:
    """Return a flight at its release; see `integrate` for the arguments."""
    gust = next_drawn = Velocity(0.0, 0.0, 0.0)
    filters = GustFilter(0.0, 0.0, 0.0, 0.0, 0.0)
    if len(noise) > 0:
        filters = first_filter(noise[0])
        gust = gust_of(filters, s.Z, wind)
        V = _airspeed(s, wind_at(s.Z, gust, wind))
        filters = next_filter(filters, V, s.Z, GUST_INTERVAL, noise[1])
        next_drawn = gust_of(filters, s.Z, wind)
    s = consistent(s, wind_at(s.Z, gust, wind), plant, table, spin_terms, control)
    return Progress(0, s, gust, filters, gust, next_drawn, 0)


@inline
def advance(
    p: Progress,
    h: float,
    plant: Plant,
    table: FloatArray,
    spin_terms: FloatArray,
    control: Control,
    wind: WindData,
    noise: FloatArray,
    step: float,
) -> Progress:
    """Return a flight one step further: `h` is `step`, or less for the last one."""
    s = p.state
    gust, filters, drawn, next_drawn, i = p.gust, p.filters, p.drawn, p.next_drawn, p.interval
    if len(noise) > 0:
        t = p.k * step
        while t / GUST_INTERVAL > i + 1 - 1e-9:  # once for a step that divides the interval
            i += 1
            drawn = next_drawn
            V = _airspeed(s, wind_at(s.Z, p.gust, wind))
            filters = next_filter(filters, V, s.Z, GUST_INTERVAL, noise[i + 1])
            next_drawn = gust_of(filters, s.Z, wind)
        gust = lerp(drawn, next_drawn, min((t + h) / GUST_INTERVAL - i, 1.0))
    s = rk4_step(s, h, p.gust, gust, wind, plant, table, spin_terms, control)
    return Progress(p.k + 1, s, gust, filters, drawn, next_drawn, i)


@entry
def integrate(
    s: State,
    plant: Plant,
    table: FloatArray,
    spin_terms: FloatArray,
    control: Control,
    wind: WindData,
    noise: FloatArray,
    step: float,
    duration: float,
    ground: bool,
    sample_rate: float,
    samples: FloatArray,
) -> Ended:
    """Fly until the ground or for `duration`, and write evenly timed samples.

    Args:
        s: State at release.
        plant: Constants of the flight.
        table: Steady coefficients, see `aerodynamics.table_coefficients`.
        spin_terms: See `aerodynamics.spin_coefficients`.
        control: Control inputs, held.
        wind: Wind of the flight.
        noise: Standard normal numbers, shape (n, 5), a row for each drawn gust; no rows for none.
        step: Integration step [s].
        duration: Longest time of flight [s].
        ground: End where Z = 0 is crossed from above.
        sample_rate: Samples per second [1/s].
        samples: Filled with t, the state and the wind X, Y, Z; shape (n, 18), as many rows as are
            asked for. A sample inside a step is a shorter step from the same start.
    """
    p = begin(s, plant, table, spin_terms, control, wind, noise)
    if len(samples) > 0:
        _write(samples[0], 0.0, p.state, wind_at(s.Z, p.gust, wind))
    return go_on(
        p,
        s.Z,
        plant,
        table,
        spin_terms,
        control,
        wind,
        noise,
        step,
        duration,
        ground,
        sample_rate,
        samples,
    )


@jit
def go_on(
    p: Progress,
    apex_Z: float,
    plant: Plant,
    table: FloatArray,
    spin_terms: FloatArray,
    control: Control,
    wind: WindData,
    noise: FloatArray,
    step: float,
    duration: float,
    ground: bool,
    sample_rate: float,
    samples: FloatArray,
) -> Ended:
    """Fly on from `p`, with the apex so far, to the end; see `integrate` for the arguments."""
    written = min(len(samples), 1)
    s, t = p.state, p.k * step
    landed = False
    while t < duration and not landed:
        s, g = p.state, p.gust
        h = step
        next_t = (p.k + 1) * step
        if next_t > duration - 1e-9 * step:
            if next_t > duration + 1e-9 * step:
                h = duration - t
            next_t = duration
        p = advance(p, h, plant, table, spin_terms, control, wind, noise, step)
        next_s, next_g = p.state, p.gust
        if not is_sound(next_s, step, plant):
            return Ended(LOST, t, s, apex_Z, written)
        landed = ground and next_s.Z > 0.0
        if landed:
            h, next_g, next_s = touchdown(
                s, h, next_s, g, next_g, wind, plant, table, spin_terms, control
            )
            next_t = t + h

        while written < len(samples) and written / sample_rate <= next_t + 1e-12:
            x = written / sample_rate - t
            if x < h * (1.0 - 1e-9):
                x_g = lerp(g, next_g, x / h)
                x_s = rk4_step(s, x, g, x_g, wind, plant, table, spin_terms, control)
                _write(samples[written], written / sample_rate, x_s, wind_at(x_s.Z, x_g, wind))
            else:
                z_wind = wind_at(next_s.Z, next_g, wind)
                _write(samples[written], written / sample_rate, next_s, z_wind)
            written += 1
        if s.VZ < 0.0 <= next_s.VZ:
            apex_Z = min(apex_Z, top(s, next_s, h))
        apex_Z = min(apex_Z, next_s.Z)
        s, t = next_s, next_t
    return Ended(LANDED if landed else FLYING, t, s, apex_Z, written)


@inline
def _airspeed(s: State, wind: Velocity) -> float:
    x, y, z = s.VX - wind.X, s.VY - wind.Y, s.VZ - wind.Z
    return math.sqrt(x * x + y * y + z * z)


@inline
def _write(row: FloatArray, t: float, s: State, wind: Velocity) -> None:
    row[0] = t
    for i in range(len(s)):
        row[1 + i] = s[i]
    row[-3] = wind.X
    row[-2] = wind.Y
    row[-1] = wind.Z


PROGRESS_SIZE = 1 + STATE_SIZE + 3 + 5 + 3 + 3 + 1


@entry
def run(
    flight: FloatArray,
    steps: int,
    plant: Plant,
    table: FloatArray,
    spin_terms: FloatArray,
    control: Control,
    wind: WindData,
    noise: FloatArray,
    step: float,
    ground: bool,
    touch: FloatArray,
) -> tuple[int, float]:
    """Fly some whole `steps` on, or to the ground; see `integrate` for the other arguments.

    Arrays, because named tuples cost Python more than a step costs the machine.

    Args:
        flight: A `Progress` in the order of its fields, shape (PROGRESS_SIZE,): the flight so far,
            left as it is after the last whole step that is sound and above the ground. Of
            one at its release, k = 0, only the state counts.
        steps: Whole steps to make.
        plant: Constants of the flight.
        table: Steady coefficients.
        spin_terms: Coefficients that the spin causes.
        control: Control inputs, held.
        wind: Wind of the flight.
        noise: Normal numbers that draw the gusts.
        step: Integration step [s].
        ground: End where Z = 0 is crossed from above.
        touch: Filled with the state at the landing, shape (14,).

    Returns:
        FLYING (all steps done), LANDED or LOST, and the time since the release [s].
    """
    p = _unpacked(flight)
    if p.k == 0:
        p = begin(p.state, plant, table, spin_terms, control, wind, noise)
    status = FLYING
    t = (p.k + steps) * step
    for _ in range(steps):
        after = advance(p, step, plant, table, spin_terms, control, wind, noise, step)
        s, g = p.state, p.gust
        if not is_sound(after.state, step, plant):
            status = LOST
            t = p.k * step
            break
        if ground and after.state.Z > 0.0:
            end, next_g = after.state, after.gust
            x, _, s = touchdown(s, step, end, g, next_g, wind, plant, table, spin_terms, control)
            for i in range(STATE_SIZE):
                touch[i] = s[i]
            status = LANDED
            t = p.k * step + x
            break
        p = after
    _pack(p, flight)
    return status, t


@inline
def _unpacked(a: FloatArray) -> Progress:
    s = State(
        a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], a[12], a[13], a[14]
    )
    gust = Velocity(a[15], a[16], a[17])
    filters = GustFilter(a[18], a[19], a[20], a[21], a[22])
    drawn, next_drawn = Velocity(a[23], a[24], a[25]), Velocity(a[26], a[27], a[28])
    return Progress(int(a[0]), s, gust, filters, drawn, next_drawn, int(a[29]))


@inline
def _pack(p: Progress, a: FloatArray) -> None:
    a[0] = p.k
    for i in range(STATE_SIZE):
        a[1 + i] = p.state[i]
    for i in range(3):
        a[15 + i] = p.gust[i]
        a[23 + i] = p.drawn[i]
        a[26 + i] = p.next_drawn[i]
    for i in range(5):
        a[18 + i] = p.filters[i]
    a[29] = p.interval


class Observed(NamedTuple):
    """Rates of change of a flight, and the aerodynamic loads behind them."""

    VX_dot: float  # acceleration of the centre, earth axes 1 [m/s^2]
    VY_dot: float
    VZ_dot: float
    p_dot: float  # despun axes 2 [rad/s^2]
    q_dot: float
    r_dot: float
    X: float  # aerodynamic force, despun axes 2 [N]
    Y: float
    Z: float
    L: float  # aerodynamic moment with damping and control coefficients, despun axes 2 [N m]
    M: float
    N: float


@entry
def observe(
    flight: FloatArray,
    plant: Plant,
    table: FloatArray,
    spin_terms: FloatArray,
    control: Control,
    wind: WindData,
    seen: FloatArray,
) -> None:
    """Fill `seen` with an `Observed` of a flight as `run` left it, shape (12,)."""
    p = _unpacked(flight)
    s = p.state
    here = wind_at(s.Z, p.gust, wind)
    d = derivative(s, here, plant, table, spin_terms, control)
    a = flow(s, here)
    C = coefficients(a, s.r, plant, table, spin_terms)
    X, Y, Z = force(a, C, plant)
    only_air = Control(control.C_L, control.C_M, control.C_N, 0.0, 0.0, 0.0, control.axes)
    m = moment(a, s, C, plant, only_air)
    L = m.L + m.D_xx * s.p + m.D_xy * s.q
    M = m.M + m.D_xy * s.p + m.D_yy * s.q
    found = (d.VX, d.VY, d.VZ, d.p, d.q, d.r, X, Y, Z, L, M, m.N)
    for i in range(len(found)):
        seen[i] = found[i]
