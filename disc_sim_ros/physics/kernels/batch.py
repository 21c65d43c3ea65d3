"""The loop over many flights, `simd.WIDTH` of them side by side, compiled."""

import math
from typing import Any, NamedTuple

import numpy as np

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.physics.kernels.batch_rows import (
    NAMES,
    control_of,
    fill_table,
    plant_of,
    release,
    wind_of,
    write_end,
)
from disc_sim_ros.physics.kernels.equations import Control, Plant, State, Velocity
from disc_sim_ros.physics.kernels.integrator import STATE_SIZE, Progress, begin, go_on
from disc_sim_ros.physics.kernels.jit import entry, inline, jit
from disc_sim_ros.physics.kernels.rk4 import is_sound, rk4_step, top
from disc_sim_ros.physics.kernels.simd import WIDTH, any_of, element, store, where
from disc_sim_ros.physics.kernels.wind import GustFilter, WindData

_CALM = Velocity(0.0, 0.0, 0.0)
_NO_FILTER = GustFilter(0.0, 0.0, 0.0, 0.0, 0.0)


class LaneState(NamedTuple):
    """Who flies in each lane, with what numbers, and how far they are; a column for each lane."""

    flight: IntArray  # its place in the rows, shape (WIDTH,)
    row: FloatArray  # its row, shape (len(NAMES), WIDTH)
    table: FloatArray  # its table, shape (n, 8 WIDTH)
    state: FloatArray  # shape (14, WIDTH)
    apex_Z: FloatArray  # so far, shape (1, WIDTH), as those below
    steps: FloatArray  # made
    manned: FloatArray  # 1, or 0 where nobody flies
    ending: FloatArray  # 1 where the next step would end it


@entry
def fly_lanes(
    rows: FloatArray,
    start: int,
    plant: Plant,
    base_table: FloatArray,
    spin_terms: FloatArray,
    base_control: Control,
    wind: WindData,
    noise: FloatArray,
    step: float,
    duration: float,
    ground: bool,
    status: IntArray,
    time: FloatArray,
    apex: FloatArray,
    drift: FloatArray,
    states: FloatArray,
) -> None:
    """Do what `batch_rows.fly_rows` does, to the same bits, without gusts.

    Whole steps are made in all lanes at once. A flight that such a step would end is ended alone,
    from the state before it, and the next one takes its lane.
    """
    no_samples = np.empty((0, 18))
    one_table = np.empty(base_table.shape)
    whole = _whole_steps(step, duration)
    lowest = 0.0 if ground else math.inf  # Z down
    a = _empty(len(base_table))
    boarded = landed = 0
    change = True
    while landed < len(rows):
        for lane in range(WIDTH if change else 0):
            if a.ending[0, lane] > 0.0:
                i = a.flight[lane]
                fill_table(rows[i], base_table, one_table)
                end = go_on(
                    _alone(a, lane),
                    a.apex_Z[0, lane],
                    plant_of(rows[i], plant),
                    one_table,
                    spin_terms,
                    control_of(rows[i], base_control),
                    wind_of(rows[i], wind),
                    noise,
                    step,
                    duration,
                    ground,
                    0.0,
                    no_samples,
                )
                write_end(rows[i], end, start + i, status, time, apex, drift, states)
                a.manned[0, lane] = a.ending[0, lane] = 0.0
                landed += 1
            if a.manned[0, lane] == 0.0 and boarded < len(rows):
                fill_table(rows[boarded], base_table, one_table)
                p = begin(
                    release(rows[boarded]),
                    plant_of(rows[boarded], plant),
                    one_table,
                    spin_terms,
                    control_of(rows[boarded], base_control),
                    wind_of(rows[boarded], wind),
                    noise,
                )
                _board(a, lane, boarded, rows[boarded], one_table, p.state)
                boarded += 1

        s, k, apex_Z = _loaded(a.state), element(a.steps, 0), element(a.apex_Z, 0)
        plants = plant_of(a.row, plant)
        control, winds = control_of(a.row, base_control), wind_of(a.row, wind)
        x = rk4_step(s, step, _CALM, _CALM, winds, plants, a.table, spin_terms, control)
        goes_on = is_sound(x, step, plants) & (x.Z <= lowest) & (k < whole)  # noqa: SIM300
        ending = where(goes_on, 0.0, element(a.manned, 0))
        change = any_of(ending > 0.0)
        if change:
            x = _chosen(goes_on, x, s)
            store(a.ending, 0, ending)
        turned = (s.VZ < 0.0) & (x.VZ >= 0.0)
        if any_of(turned):
            apex_Z = where(turned, min(apex_Z, top(s, x, step)), apex_Z)
        store(a.apex_Z, 0, min(apex_Z, x.Z))
        store(a.steps, 0, where(goes_on, k + 1.0, k))
        for j in range(STATE_SIZE):
            store(a.state, j, x[j])


@jit
def _whole_steps(step: float, duration: float) -> float:
    """Return how many steps `integrate` makes before the last one."""
    k = max(math.floor(duration / step) - 3.0, 0.0)
    while (k + 1.0) * step <= duration - 1e-9 * step:
        k += 1.0
    return k


@jit
def _empty(rows: int) -> LaneState:
    """Return lanes in which nobody flies; what is computed there is not looked at."""
    return LaneState(
        np.zeros(WIDTH, np.int64),
        np.ones((len(NAMES), WIDTH)),
        np.zeros((rows, 8 * WIDTH)),
        np.ones((STATE_SIZE, WIDTH)),
        np.zeros((1, WIDTH)),
        np.zeros((1, WIDTH)),
        np.zeros((1, WIDTH)),
        np.zeros((1, WIDTH)),
    )


@jit
def _board(a: LaneState, lane: int, i: int, row: FloatArray, table: FloatArray, s: State) -> None:
    """Let a flight begin in a lane."""
    a.flight[lane] = i
    a.row[:, lane] = row
    a.table[:, 8 * lane : 8 * lane + 8] = table
    for k in range(STATE_SIZE):
        a.state[k, lane] = s[k]
    a.apex_Z[0, lane] = s.Z
    a.steps[0, lane] = 0.0
    a.manned[0, lane] = 1.0


@inline
def _alone(a: LaneState, lane: int) -> Progress:
    """Return the flight in a lane as scalar functions take it."""
    e = a.state
    s = State(
        e[0, lane],
        e[1, lane],
        e[2, lane],
        e[3, lane],
        e[4, lane],
        e[5, lane],
        e[6, lane],
        e[7, lane],
        e[8, lane],
        e[9, lane],
        e[10, lane],
        e[11, lane],
        e[12, lane],
        e[13, lane],
    )
    return Progress(int(a.steps[0, lane]), s, _CALM, _NO_FILTER, _CALM, _CALM, 0)


@inline
def _loaded(a: FloatArray) -> State:
    return State(
        element(a, 0),
        element(a, 1),
        element(a, 2),
        element(a, 3),
        element(a, 4),
        element(a, 5),
        element(a, 6),
        element(a, 7),
        element(a, 8),
        element(a, 9),
        element(a, 10),
        element(a, 11),
        element(a, 12),
        element(a, 13),
    )


@inline
def _chosen(condition: Any, a: State, b: State) -> State:
    """Return the state `a` in the lanes where the condition holds, else `b`."""
    return State(
        where(condition, a.X, b.X),
        where(condition, a.Y, b.Y),
        where(condition, a.Z, b.Z),
        where(condition, a.VX, b.VX),
        where(condition, a.VY, b.VY),
        where(condition, a.VZ, b.VZ),
        where(condition, a.e0, b.e0),
        where(condition, a.e1, b.e1),
        where(condition, a.e2, b.e2),
        where(condition, a.e3, b.e3),
        where(condition, a.p, b.p),
        where(condition, a.q, b.q),
        where(condition, a.r, b.r),
        where(condition, a.sigma, b.sigma),
    )
