"""Many flights that step together, each with control inputs and a wind of its own.

The flights lie in blocks of `simd.WIDTH`, one in each lane. Between two calls Python may change
the control inputs and the wind of each flight, and release flights again.
"""

import math
from typing import NamedTuple

import numpy as np

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.physics.kernels.equations import Control, Plant, State, Velocity, consistent
from disc_sim_ros.physics.kernels.integrator import FLYING, LANDED, LOST
from disc_sim_ros.physics.kernels.jit import entry, inline
from disc_sim_ros.physics.kernels.rk4 import (
    Inputs,
    depth,
    is_sound,
    rk4_step,
    touchdown,
    touches,
)
from disc_sim_ros.physics.kernels.rows import release
from disc_sim_ros.physics.kernels.simd import WIDTH, any_of, element, store, where
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE, load_state, select, store_state
from disc_sim_ros.physics.kernels.wind import WindData, wind_at

_NO_GUST = Velocity(0.0, 0.0, 0.0)


class Batch(NamedTuple):
    """The flights, in blocks of WIDTH; flight i is in block i // WIDTH, lane i % WIDTH."""

    release: FloatArray  # states at release, shape (blocks, 14, WIDTH)
    state: FloatArray  # present or last sound states, shape (blocks, 14, WIDTH)
    control: FloatArray  # C_L, C_M, C_N, shape (blocks, 3, WIDTH)
    wind: FloatArray  # mean wind, earth axes 1 [m/s], shape (blocks, 3, WIDTH)
    steps: FloatArray  # since the release, shape (blocks, 1, WIDTH)
    active: FloatArray  # 1 in the air, else 0, shape (blocks, 1, WIDTH)
    status: IntArray  # FLYING, LANDED or LOST, shape (blocks, WIDTH)
    end: FloatArray  # states at the landing, shape (blocks, 14, WIDTH)
    end_time: FloatArray  # s since the release, shape (blocks, WIDTH)
    ending: FloatArray  # for `advance_batch`: 1 in lanes that end, shape (blocks, 1, WIDTH)
    beyond: FloatArray  # for `advance_batch`: states after the last step, shape as `state`


def new_batch(n: int) -> Batch:
    """Return room for `n` flights, none of which is in the air."""
    blocks = -(-n // WIDTH)
    states = np.zeros((4, blocks, STATE_SIZE, WIDTH))
    states[:, :, State._fields.index('e0')] = 1.0
    return Batch(
        release=states[0],
        state=states[1],
        control=np.zeros((blocks, 3, WIDTH)),
        wind=np.zeros((blocks, 3, WIDTH)),
        steps=np.zeros((blocks, 1, WIDTH)),
        active=np.zeros((blocks, 1, WIDTH)),
        status=np.full((blocks, WIDTH), FLYING),
        end=states[2],
        end_time=np.zeros((blocks, WIDTH)),
        ending=np.zeros((blocks, 1, WIDTH)),
        beyond=states[3],
    )


@entry
def release_batch(
    batch: Batch,
    flights: IntArray,
    launches: FloatArray,
    states: FloatArray,
    winds: FloatArray,
    plant: Plant,
    inputs: Inputs,
) -> None:
    """Release some flights of a batch; their control inputs become 0.

    Args:
        batch: Updated.
        flights: Their numbers, shape (m,).
        launches: A launch in each row, the first ten columns of `rows.NAMES`, shape (m, 10).
        states: States at release instead, shape (14, m); shape (0, 0) for the launches.
        winds: Mean winds, earth axes 1 [m/s], shape (m, 3).
        plant: Constants of the flights.
        inputs: Moments in N m, and profile of the wind.
    """
    for k in range(len(flights)):
        b, lane = flights[k] // WIDTH, flights[k] % WIDTH
        for i in range(3):
            batch.control[b, i, lane] = 0.0
            batch.wind[b, i, lane] = winds[k, i]
        s = load_state(states[:, k], 0) if len(states) > 0 else release(launches[k])
        store_state(batch.release[b, :, lane], 0, s)
        own = _inputs_of_lane(batch, b, lane, inputs)
        s = consistent(s, wind_at(s.Z, _NO_GUST, own.wind), plant, own.control)
        store_state(batch.state[b, :, lane], 0, s)
        batch.steps[b, 0, lane] = 0.0
        batch.active[b, 0, lane] = 1.0
        batch.status[b, lane] = FLYING


@entry
def advance_batch(
    batch: Batch,
    start: int,
    stop: int,
    steps: int,
    plant: Plant,
    lanes_plant: Plant,
    inputs: Inputs,
    step: float,
    ground: bool,
) -> None:
    """Advance the flights of some blocks by whole steps, or to the ground.

    A flight makes the steps of `integrator.advance_steps`, to the bit. One that lands or is lost
    stays at the state before that step. Threads may advance different blocks at the same time.

    Args:
        batch: Updated.
        start: First block.
        stop: The block after the last.
        steps: Number of steps.
        plant: Constants of the flights.
        lanes_plant: The same with the table of `lanes_table`.
        inputs: Moments in N m and profile of the wind; no gusts.
        step: Integration step [s].
        ground: End where the centre or the rim crosses Z = 0 from above.
    """
    lowest = 0.0 if ground else math.inf  # Z down
    rim = plant.rim
    for b in range(start, stop):
        s, done = load_state(batch.state[b], 0), element(batch.steps[b], 0)
        active = element(batch.active[b], 0)
        own = _inputs_of_block(batch, b, inputs)
        new = done <= 0.0
        if any_of(new):  # as `integrator.initialise`, with the control inputs of the first step
            first = load_state(batch.release[b], 0)
            wind = wind_at(first.Z, _NO_GUST, own.wind)
            s = select(new, consistent(first, wind, lanes_plant, own.control), s)
        for _ in range(steps):
            next_s = rk4_step(s, step, _NO_GUST, _NO_GUST, lanes_plant, own)
            goes_on = is_sound(next_s, step, lanes_plant) & (next_s.Z <= lowest)  # noqa: SIM300
            if ground and rim > 0.0:  # see `rk4.touches`
                goes_on = goes_on & ((depth(next_s, rim) <= 0.0) | (depth(s, rim) > 0.0))
            ending = where(goes_on, 0.0, active)
            if any_of(ending > 0.0):
                store(batch.ending[b], 0, ending)
                store(batch.steps[b], 0, done)
                store_state(batch.state[b], 0, s)
                store_state(batch.beyond[b], 0, next_s)
                for lane in range(WIDTH):
                    if batch.ending[b, 0, lane] > 0.0:
                        _end(batch, b, lane, plant, inputs, step)
                active = where(goes_on, active, 0.0)
                if not any_of(active > 0.0):
                    break
            goes_on = goes_on & (active > 0.0)
            s = select(goes_on, next_s, s)
            done = where(goes_on, done + 1.0, done)
        store(batch.steps[b], 0, done)
        store(batch.active[b], 0, active)
        store_state(batch.state[b], 0, s)


@entry
def advance_singly(
    batch: Batch,
    start: int,
    stop: int,
    steps: int,
    plant: Plant,
    _lanes_plant: Plant,
    inputs: Inputs,
    step: float,
    ground: bool,
) -> None:
    """Advance the flights one after the other; arguments and results are those of `advance_batch`.

    For plain Python, which has no SIMD vectors.
    """
    for b in range(start, stop):
        for lane in range(WIDTH):
            if batch.active[b, 0, lane] == 0.0:
                continue
            own = _inputs_of_lane(batch, b, lane, inputs)
            s, done = load_state(batch.state[b, :, lane], 0), batch.steps[b, 0, lane]
            if done == 0.0:
                s = load_state(batch.release[b, :, lane], 0)
                s = consistent(s, wind_at(s.Z, _NO_GUST, own.wind), plant, own.control)
            next_s = s
            for _ in range(steps):
                next_s = rk4_step(s, step, _NO_GUST, _NO_GUST, plant, own)
                ends = not is_sound(next_s, step, plant)
                if ends or (ground and touches(s, next_s, plant)):
                    batch.active[b, 0, lane] = 0.0
                    break
                s = next_s
                done += 1.0
            batch.steps[b, 0, lane] = done
            store_state(batch.state[b, :, lane], 0, s)
            store_state(batch.beyond[b, :, lane], 0, next_s)
            if batch.active[b, 0, lane] == 0.0:
                _end(batch, b, lane, plant, inputs, step)


@inline
def _end(batch: Batch, b: int, lane: int, plant: Plant, inputs: Inputs, step: float) -> None:
    """Write how a flight ends in the step from `state` to `beyond`."""
    s = load_state(batch.state[b, :, lane], 0)
    beyond = load_state(batch.beyond[b, :, lane], 0)
    t = batch.steps[b, 0, lane] * step
    status = LOST
    if is_sound(beyond, step, plant):
        own = _inputs_of_lane(batch, b, lane, inputs)
        h, _, s = touchdown(s, step, beyond, _NO_GUST, _NO_GUST, plant, own)
        t += h
        status = LANDED
    store_state(batch.end[b, :, lane], 0, s)
    batch.end_time[b, lane] = t
    batch.status[b, lane] = status


@inline
def _inputs_of_block(batch: Batch, b: int, inputs: Inputs) -> Inputs:
    """Return the inputs of the flights of a block, as vectors."""
    c, w, u, v = inputs.control, inputs.wind, batch.control[b], batch.wind[b]
    control = Control(element(u, 0), element(u, 1), element(u, 2), c.L, c.M, c.N, c.axes)
    X, Y, Z = element(v, 0), element(v, 1), element(v, 2)
    wind = WindData(X, Y, Z, w.z0, w.per_log, w.W_20, w.x_X, w.x_Y)
    return Inputs(control, wind, inputs.noise)


@inline
def _inputs_of_lane(batch: Batch, b: int, lane: int, inputs: Inputs) -> Inputs:
    """Return the inputs of one flight, as floats."""
    c, w, u, v = inputs.control, inputs.wind, batch.control, batch.wind
    control = Control(u[b, 0, lane], u[b, 1, lane], u[b, 2, lane], c.L, c.M, c.N, c.axes)
    X, Y, Z = v[b, 0, lane], v[b, 1, lane], v[b, 2, lane]
    wind = WindData(X, Y, Z, w.z0, w.per_log, w.W_20, w.x_X, w.x_Y)
    return Inputs(control, wind, inputs.noise)


def lanes_table(table: FloatArray) -> FloatArray:
    """Return a table for all lanes, shape (n, 8 WIDTH), from that of one flight, shape (n, 8)."""
    return np.tile(table, (1, WIDTH))
