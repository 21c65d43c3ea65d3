"""Flights from any state, sampled at any times: what estimators compare with measurements."""

import math
from typing import Any, NamedTuple

import numpy as np

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.physics.kernels.equations import (
    Plant,
    State,
    Velocity,
    consistent,
    derivative,
)
from disc_sim_ros.physics.kernels.integrator import FLYING, LANDED, LOST, initialise
from disc_sim_ros.physics.kernels.jit import entry, inline, jit
from disc_sim_ros.physics.kernels.rk4 import (
    Inputs,
    axpy,
    is_sound,
    rk4_step,
    touchdown,
    touches,
)
from disc_sim_ros.physics.kernels.rows import NAMES, fill_table, inputs_of, plant_of
from disc_sim_ros.physics.kernels.simd import WIDTH, any_of, element, store, where
from disc_sim_ros.physics.kernels.state_arrays import (
    STATE_SIZE,
    load_state,
    select,
    store_state,
)
from disc_sim_ros.physics.kernels.wind import wind_at

NO_GUST = Velocity(0.0, 0.0, 0.0)


class Grid(NamedTuple):
    """When to compute a state."""

    step: float  # of the integration [s]
    duration: float  # in which a landing is looked for [s]
    times: FloatArray  # of the samples, ascending from 0 [s], shape (k,)


class Samples(NamedTuple):
    """Samples and ends of n flights, filled by the loops."""

    states: FloatArray  # at the times of the grid, nan from a loss on; shape (n, k, 14)
    status: IntArray  # LANDED, FLYING (no landing in the duration) or LOST, shape (n,)
    time: FloatArray  # of the end [s], shape (n,)
    ends: FloatArray  # states then, shape (n, 14)


class SampleSpace(NamedTuple):
    """Arrays that a loop works in; a column for each lane."""

    own_table: FloatArray  # of one flight, shape (n, 8)
    row: FloatArray  # shape (len(NAMES), WIDTH)
    table: FloatArray  # shape (n, 8 WIDTH)
    state: FloatArray  # shape (14, WIDTH)
    next_state: FloatArray  # after a step
    flags: FloatArray  # shape (2, WIDTH): 1 in the air, and how the present step ends the flight


def sample_space(plant: Plant) -> SampleSpace:
    """Return work arrays, for tables as long as that of `plant`."""
    n = len(plant.table)
    state = np.ones((STATE_SIZE, WIDTH))
    return SampleSpace(
        np.empty((n, 8)),
        np.ones((len(NAMES), WIDTH)),
        np.zeros((n, 8 * WIDTH)),
        state,
        state.copy(),
        np.zeros((2, WIDTH)),
    )


@entry
def sample_rows(
    states: FloatArray,
    rows: FloatArray,
    plant: Plant,
    inputs: Inputs,
    grid: Grid,
    out: Samples,
    space: SampleSpace,
) -> None:
    """Fly from states to the landing and to the last sample, one flight after the other.

    Samples lie on the cubic through the states and their rates of change at both ends of a step.
    They go on below the ground, so that residuals change smoothly with the release.

    Args:
        states: First states, columns as in State, shape (n, 14).
        rows: Constants of each flight, shape (n, len(NAMES)); those of a launch are not used.
        plant: Constants that all flights share; the rows replace the others.
        inputs: Moments and profile of the wind that all flights share; without gusts.
        grid: Step, duration and times of the samples.
        out: Filled.
        space: See `sample_space`.
    """
    step, times = grid.step, grid.times
    for i in range(len(states)):
        fill_table(rows[i], plant.table, space.own_table)
        own_plant = plant_of(rows[i], plant, space.own_table)
        own_inputs = inputs_of(rows[i], inputs)
        s = initialise(load_state(states[i], 0), own_plant, own_inputs).state
        out.status[i] = FLYING
        j = k = 0
        while j < len(times) or (out.status[i] == FLYING and k * step < grid.duration):
            t = k * step
            next_s = rk4_step(s, step, NO_GUST, NO_GUST, own_plant, own_inputs)
            sound = is_sound(next_s, step, own_plant)
            if not sound:
                next_s = s
            if j < len(times) and times[j] < t + step:
                d, next_d = (
                    rate_of_change(s, own_plant, own_inputs),
                    rate_of_change(next_s, own_plant, own_inputs),
                )
                while j < len(times) and times[j] < t + step:
                    x = between(s, d, next_s, next_d, step, times[j] - t, own_plant, own_inputs)
                    if not sound:
                        x = axpy(x, math.nan, x)
                    store_state(out.states[i, j], 0, x)
                    j += 1
            if out.status[i] == FLYING and (not sound or touches(s, next_s, own_plant)):
                _write_end(i, s, next_s, t, step, sound, own_plant, own_inputs, out)
            s = next_s
            k += 1
        if out.status[i] == FLYING:
            write_state(i, k * step, s, out)


@entry
def sample_simd(
    states: FloatArray,
    rows: FloatArray,
    plant: Plant,
    inputs: Inputs,
    grid: Grid,
    out: Samples,
    space: SampleSpace,
) -> None:
    """Do as `sample_rows`, with WIDTH flights at a time and the same bits."""
    step, times, a = grid.step, grid.times, space
    for first in range(0, len(states), WIDTH):
        count = min(WIDTH, len(states) - first)
        for lane in range(WIDTH):
            fill_lane(a, lane, first + min(lane, count - 1), states, rows, plant, inputs, out)
        plants, all_inputs = plant_of(a.row, plant, a.table), inputs_of(a.row, inputs)
        s = load_state(a.state, 0)
        j = k = 0
        flying = WIDTH
        while j < len(times) or (flying > 0 and k * step < grid.duration):
            t = k * step
            next_s = rk4_step(s, step, NO_GUST, NO_GUST, plants, all_inputs)
            sound = is_sound(next_s, step, plants)
            next_s = select(sound, next_s, s)
            if j < len(times) and times[j] < t + step:
                j = _write_samples(
                    s,
                    next_s,
                    sound,
                    t,
                    j,
                    plants,
                    all_inputs,
                    grid,
                    out,
                    first,
                    count,
                    a.next_state,
                )
            how = where(sound, where(touches(s, next_s, plants), 1.0, 0.0), 2.0)
            how = how * element(a.flags, 0)
            if any_of(how > 0.0):
                store(a.flags, 1, how)
                store_state(a.state, 0, s)
                store_state(a.next_state, 0, next_s)
                flying -= end_lanes(a, first, count, t, step, rows, plant, inputs, out)
            s = next_s
            k += 1
        write_flying(a, s, first, count, k * step, out)


@jit
def fill_lane(
    a: SampleSpace,
    lane: int,
    i: int,
    states: FloatArray,
    rows: FloatArray,
    plant: Plant,
    inputs: Inputs,
    out: Samples,
) -> None:
    """Start flight `i` in a lane."""
    row, table = rows[i], a.own_table
    fill_table(row, plant.table, table)
    s = initialise(
        load_state(states[i], 0), plant_of(row, plant, table), inputs_of(row, inputs)
    ).state
    for j in range(len(row)):
        a.row[j, lane] = row[j]
    for j in range(len(table)):
        for k in range(8):
            a.table[j, 8 * lane + k] = table[j, k]
    store_state(a.state[:, lane], 0, s)
    a.flags[0, lane] = 1.0
    out.status[i] = FLYING


@jit
def end_lanes(
    a: SampleSpace,
    first: int,
    count: int,
    t: float,
    step: float,
    rows: FloatArray,
    plant: Plant,
    inputs: Inputs,
    out: Samples,
) -> int:
    """End the flights whose lanes are flagged, and return how many."""
    ended = 0
    for lane in range(WIDTH):
        if a.flags[1, lane] > 0.0:
            a.flags[0, lane] = 0.0
            ended += 1
            if lane < count:
                i = first + lane
                fill_table(rows[i], plant.table, a.own_table)
                own_plant = plant_of(rows[i], plant, a.own_table)
                own_inputs = inputs_of(rows[i], inputs)
                s, next_s = load_state(a.state[:, lane], 0), load_state(a.next_state[:, lane], 0)
                sound = a.flags[1, lane] < 2.0
                _write_end(i, s, next_s, t, step, sound, own_plant, own_inputs, out)
    return ended


@jit
def _write_samples(
    s: State,
    next_s: State,
    sound: Any,
    t: float,
    j: int,
    plants: Plant,
    inputs: Inputs,
    grid: Grid,
    out: Samples,
    first: int,
    count: int,
    buffer: FloatArray,
) -> int:
    """Write the samples in a step that starts at `t`, from the j-th on; return the next one."""
    step, times = grid.step, grid.times
    d, next_d = rate_of_change(s, plants, inputs), rate_of_change(next_s, plants, inputs)
    while j < len(times) and times[j] < t + step:
        x = between(s, d, next_s, next_d, step, times[j] - t, plants, inputs)
        write_lanes(x, sound, count, buffer, out.states[first:, j])
        j += 1
    return j


@jit
def rate_of_change(s: State, plant: Plant, inputs: Inputs) -> State:
    """Return the rate of change of a state without gusts."""
    return derivative(s, wind_at(s.Z, NO_GUST, inputs.wind), plant, inputs.control)


@jit
def between(
    s: State, d: State, end: State, end_d: State, h: float, t: float, plant: Plant, inputs: Inputs
) -> State:
    """Return the state at time `t` in a step of `h`, on the cubic of its ends and their rates."""
    f = t / h
    zero = axpy(s, -1.0, s)
    rise = axpy(end, -1.0, s)
    c2 = axpy(axpy(axpy(zero, 3.0, rise), -2.0 * h, d), -h, end_d)
    c3 = axpy(axpy(axpy(zero, -2.0, rise), h, d), h, end_d)
    x = axpy(axpy(axpy(s, t, d), f * f, c2), f * f * f, c3)
    return consistent(x, wind_at(x.Z, NO_GUST, inputs.wind), plant, inputs.control)


@jit
def _write_end(
    i: int,
    s: State,
    next_s: State,
    t: float,
    step: float,
    sound: bool,
    plant: Plant,
    inputs: Inputs,
    out: Samples,
) -> None:
    """Write the end of flight `i`: a landing in a step, or its loss."""
    if not sound:
        out.status[i] = LOST
        write_state(i, t, s, out)
        return
    out.status[i] = LANDED
    h, _, end = touchdown(s, step, next_s, NO_GUST, NO_GUST, plant, inputs)
    write_state(i, t + h, end, out)


@inline
def write_state(i: int, t: float, s: State, out: Samples) -> None:
    """Write the end of flight `i`."""
    out.time[i] = t
    store_state(out.ends[i], 0, s)


@inline
def write_flying(a: SampleSpace, s: State, first: int, count: int, t: float, out: Samples) -> None:
    """Write the states in the lanes as the ends of the flights that have not ended."""
    store_state(a.state, 0, s)
    for lane in range(count):
        if out.status[first + lane] == FLYING:
            write_state(first + lane, t, load_state(a.state[:, lane], 0), out)


@inline
def write_lanes(s: State, sound: Any, count: int, buffer: FloatArray, states: FloatArray) -> None:
    """Write the states in the first lanes to rows; nan where not sound.

    Args:
        s: A state in each lane.
        sound: Condition in each lane.
        count: Number of lanes.
        buffer: Shape (14, WIDTH), overwritten.
        states: Filled, shape (at least count, 14).
    """
    store_state(buffer, 0, select(sound, s, axpy(s, math.nan, s)))
    for lane in range(count):
        store_state(states[lane], 0, load_state(buffer[:, lane], 0))
