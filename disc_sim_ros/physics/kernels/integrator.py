"""The integration of a flight in fixed steps, from release to the ground."""

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
from disc_sim_ros.physics.kernels.rk4 import (
    Inputs,
    is_sound,
    lerp,
    rk4_step,
    top,
    touchdown,
    touches,
)
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE, load_state, store_state
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


class Options(NamedTuple):
    """How a flight is integrated."""

    step: float  # s
    duration: float  # longest time of flight [s]
    ground: bool  # end where the centre or the rim crosses Z = 0 from above
    sample_rate: float  # 1/s


class IntegratorState(NamedTuple):
    """A flight between two steps: everything that the next step needs."""

    steps: int  # done since the release
    state: State
    gust: Velocity  # at the disc, now
    filters: GustFilter  # that drew `end_gust`
    start_gust: Velocity  # at the start of the present gust interval
    end_gust: Velocity  # and at its end
    interval: int  # its number, from 0


class IntegrationResult(NamedTuple):
    """The end of a flight: why, when and where; its apex, and the number of samples."""

    status: int  # FLYING (time is up), LANDED or LOST (the state is the last sound one)
    t: float  # s
    state: State
    apex_Z: float  # m, least Z (down) on the way
    samples: int


@jit
def initialise(s: State, plant: Plant, inputs: Inputs) -> IntegratorState:
    """Return a flight at its release in the state `s`."""
    wind, noise = inputs.wind, inputs.noise
    gust = end_gust = Velocity(0.0, 0.0, 0.0)
    filters = GustFilter(0.0, 0.0, 0.0, 0.0, 0.0)
    if len(noise) > 0:
        filters = first_filter(noise[0])
        gust = gust_of(filters, s.Z, wind)
        V = airspeed(s, wind_at(s.Z, gust, wind))
        filters = next_filter(filters, V, s.Z, GUST_INTERVAL, noise[1])
        end_gust = gust_of(filters, s.Z, wind)
    s = consistent(s, wind_at(s.Z, gust, wind), plant, inputs.control)
    return IntegratorState(0, s, gust, filters, gust, end_gust, 0)


@inline
def advance(
    x: IntegratorState, h: float, step: float, plant: Plant, inputs: Inputs
) -> IntegratorState:
    """Return a flight one step further: `h` is `step`, or less for the last one [s]."""
    s, gust = x.state, x.gust
    filters, start_gust, end_gust, i = x.filters, x.start_gust, x.end_gust, x.interval
    wind, noise = inputs.wind, inputs.noise
    if len(noise) > 0:
        t = x.steps * step
        while t / GUST_INTERVAL > i + 1 - 1e-9:  # once, for a step that divides the interval
            i += 1
            start_gust = end_gust
            V = airspeed(s, wind_at(s.Z, x.gust, wind))
            filters = next_filter(filters, V, s.Z, GUST_INTERVAL, noise[i + 1])
            end_gust = gust_of(filters, s.Z, wind)
        gust = lerp(start_gust, end_gust, min((t + h) / GUST_INTERVAL - i, 1.0))
    s = rk4_step(s, h, x.gust, gust, plant, inputs)
    return IntegratorState(x.steps + 1, s, gust, filters, start_gust, end_gust, i)


@entry
def integrate(
    s: State, plant: Plant, inputs: Inputs, options: Options, samples: FloatArray
) -> IntegrationResult:
    """Integrate a flight to its end, and write evenly timed samples.

    Args:
        s: State at release.
        plant: Constants of the flight.
        inputs: Control inputs, held for the whole flight, wind and gust noise.
        options: Step, duration, ground and sample rate.
        samples: Filled with t, the state and the wind X, Y, Z; shape (n, 18), with as many rows
            as samples are wanted. A sample inside a step is a shorter step from the same start.
    """
    x = initialise(s, plant, inputs)
    if len(samples) > 0:
        write_sample(samples[0], 0.0, x.state, wind_at(s.Z, x.gust, inputs.wind))
    return integrate_from(x, s.Z, plant, inputs, options, samples)


@jit
def integrate_from(
    x: IntegratorState,
    apex_Z: float,
    plant: Plant,
    inputs: Inputs,
    options: Options,
    samples: FloatArray,
) -> IntegrationResult:
    """Integrate a flight from `x`, with the apex so far, to its end; see `integrate`."""
    step, duration, wind = options.step, options.duration, inputs.wind
    written = min(len(samples), 1)
    s, t = x.state, x.steps * step
    landed = False
    while t < duration and not landed:
        s, gust = x.state, x.gust
        h = step
        next_t = (x.steps + 1) * step
        if next_t > duration - 1e-9 * step:
            if next_t > duration + 1e-9 * step:
                h = duration - t
            next_t = duration
        x = advance(x, h, step, plant, inputs)
        next_s, next_gust = x.state, x.gust
        if not is_sound(next_s, step, plant):
            return IntegrationResult(LOST, t, s, apex_Z, written)
        landed = options.ground and touches(s, next_s, plant)
        if landed:
            h, next_gust, next_s = touchdown(s, h, next_s, gust, next_gust, plant, inputs)
            next_t = t + h

        while written < len(samples) and written / options.sample_rate <= next_t + 1e-12:
            sample_t = written / options.sample_rate
            d = sample_t - t
            if d < h * (1.0 - 1e-9):
                d_gust = lerp(gust, next_gust, d / h)
                d_s = rk4_step(s, d, gust, d_gust, plant, inputs)
                write_sample(samples[written], sample_t, d_s, wind_at(d_s.Z, d_gust, wind))
            else:
                here = wind_at(next_s.Z, next_gust, wind)
                write_sample(samples[written], sample_t, next_s, here)
            written += 1
        if s.VZ < 0.0 <= next_s.VZ:
            apex_Z = min(apex_Z, top(s, next_s, h))
        apex_Z = min(apex_Z, next_s.Z)
        s, t = next_s, next_t
    return IntegrationResult(LANDED if landed else FLYING, t, s, apex_Z, written)


@inline
def airspeed(s: State, wind: Velocity) -> float:
    """Return the airspeed of a disc in a wind [m/s]."""
    x, y, z = s.VX - wind.X, s.VY - wind.Y, s.VZ - wind.Z
    return math.sqrt(x * x + y * y + z * z)


@inline
def write_sample(row: FloatArray, t: float, s: State, wind: Velocity) -> None:
    """Write t, the state and the wind to a row of the samples."""
    row[0] = t
    store_state(row, 1, s)
    row[-3] = wind.X
    row[-2] = wind.Y
    row[-1] = wind.Z


INTEGRATOR_STATE_SIZE = 1 + STATE_SIZE + 3 + 5 + 3 + 3 + 1


@entry
def advance_steps(
    flight: FloatArray,
    steps: int,
    plant: Plant,
    control: Control,
    wind: WindData,
    noise: FloatArray,
    step: float,
    ground: bool,
    landing: FloatArray,
) -> tuple[int, float]:
    """Advance a flight by some whole steps, or to the ground.

    The node calls this for each step, and a call costs more than the step: 3.4 us to hand over
    named tuples from Python, 4.2 us if control, wind and noise were made `Inputs` each time. So
    these are separate arguments, and the flight is an array.

    Args:
        flight: An `IntegratorState` in the order of its fields, shape (INTEGRATOR_STATE_SIZE,).
            Updated to the last whole step that is sound and above the ground. Of a flight at its
            release, with 0 steps done, only the state counts.
        steps: Number of steps.
        plant: Constants of the flight.
        control: Control inputs, held.
        wind: Wind of the flight.
        noise: Gust noise, see `Inputs`.
        step: Integration step [s].
        ground: End where the centre or the rim crosses Z = 0 from above.
        landing: Filled with the state at the landing, shape (14,).

    Returns:
        FLYING (all steps done), LANDED or LOST, and the time since the release [s].
    """
    inputs = Inputs(control, wind, noise)
    x = _unpacked(flight)
    if x.steps == 0:
        x = initialise(x.state, plant, inputs)
    status = FLYING
    t = (x.steps + steps) * step
    for _ in range(steps):
        after = advance(x, step, step, plant, inputs)
        if not is_sound(after.state, step, plant):
            status = LOST
            t = x.steps * step
            break
        if ground and touches(x.state, after.state, plant):
            h, _, s = touchdown(x.state, step, after.state, x.gust, after.gust, plant, inputs)
            store_state(landing, 0, s)
            status = LANDED
            t = x.steps * step + h
            break
        x = after
    _pack(x, flight)
    return status, t


@inline
def _unpacked(a: FloatArray) -> IntegratorState:
    s = load_state(a, 1)
    gust = Velocity(a[15], a[16], a[17])
    filters = GustFilter(a[18], a[19], a[20], a[21], a[22])
    start_gust, end_gust = Velocity(a[23], a[24], a[25]), Velocity(a[26], a[27], a[28])
    return IntegratorState(int(a[0]), s, gust, filters, start_gust, end_gust, int(a[29]))


@inline
def _pack(x: IntegratorState, a: FloatArray) -> None:
    a[0] = x.steps
    store_state(a, 1, x.state)
    for i in range(3):
        a[15 + i] = x.gust[i]
        a[23 + i] = x.start_gust[i]
        a[26 + i] = x.end_gust[i]
    for i in range(5):
        a[18 + i] = x.filters[i]
    a[29] = x.interval


class Observation(NamedTuple):
    """Rates of change in a flight, and the aerodynamic loads that cause them."""

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
    flight: FloatArray, plant: Plant, control: Control, wind: WindData, observation: FloatArray
) -> None:
    """Fill an array of shape (12,) with the `Observation` of a flight from `advance_steps`."""
    x = _unpacked(flight)
    s = x.state
    here = wind_at(s.Z, x.gust, wind)
    d = derivative(s, here, plant, control)
    a = flow(s, here)
    C = coefficients(a, s.r, plant)
    X, Y, Z = force(a, C, plant)
    only_air = Control(control.C_L, control.C_M, control.C_N, 0.0, 0.0, 0.0, control.axes)
    m = moment(a, s, C, plant, only_air)
    L = m.L + m.D_xx * s.p + m.D_xy * s.q
    M = m.M + m.D_xy * s.p + m.D_yy * s.q
    fields = (d.VX, d.VY, d.VZ, d.p, d.q, d.r, X, Y, Z, L, M, m.N)
    for i in range(len(fields)):
        observation[i] = fields[i]
