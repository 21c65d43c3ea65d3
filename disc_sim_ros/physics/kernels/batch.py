"""The loops over many flights: one after the other, or `simd.WIDTH` at a time."""

import math
from typing import NamedTuple

import numpy as np

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.physics.kernels.equations import Plant, State, Velocity
from disc_sim_ros.physics.kernels.integrator import (
    IntegrationResult,
    IntegratorState,
    Options,
    initialise,
    integrate,
    integrate_from,
)
from disc_sim_ros.physics.kernels.jit import entry, inline, jit
from disc_sim_ros.physics.kernels.rk4 import Inputs, depth, is_sound, rk4_step, top
from disc_sim_ros.physics.kernels.rotation import cos_sin_degrees
from disc_sim_ros.physics.kernels.rows import NAMES, YAW, fill_table, inputs_of, plant_of, release
from disc_sim_ros.physics.kernels.simd import WIDTH, any_of, element, store, where
from disc_sim_ros.physics.kernels.state_arrays import (
    STATE_SIZE,
    load_state,
    select,
    store_state,
)
from disc_sim_ros.physics.kernels.wind import GustFilter

NO_GUST = Velocity(0.0, 0.0, 0.0)
_NO_FILTER = GustFilter(0.0, 0.0, 0.0, 0.0, 0.0)


class Ends(NamedTuple):
    """The ends of n flights: the arrays of `ensemble.Landings`, filled by the loops."""

    status: IntArray  # FLYING, LANDED or LOST, shape (n,)
    time: FloatArray  # s, shape (n,)
    apex: FloatArray  # m above the ground, shape (n,)
    drift: FloatArray  # m left of the launch heading, shape (n,)
    states: FloatArray  # shape (n, 14)


class LaneState(NamedTuple):
    """The flight in each lane, its numbers and its progress; a column for each lane."""

    flight: IntArray  # its place in the rows, shape (WIDTH,)
    row: FloatArray  # its row, shape (len(NAMES), WIDTH)
    table: FloatArray  # its table, shape (n, 8 WIDTH)
    state: FloatArray  # shape (14, WIDTH)
    apex_Z: FloatArray  # so far, shape (1, WIDTH), as those below
    steps: FloatArray  # done
    active: FloatArray  # 1, or 0 for a lane without a flight
    ending: FloatArray  # 1 where the next step would end the flight


class Workspace(NamedTuple):
    """Arrays that a loop works in; each thread needs its own."""

    table: FloatArray  # of one flight, shape (n, 8)
    no_samples: FloatArray  # shape (0, 18)
    lanes: LaneState


def workspace(plant: Plant) -> Workspace:
    """Return a workspace without flights, for tables as long as that of `plant`."""
    n = len(plant.table)
    lanes = LaneState(
        flight=np.zeros(WIDTH, np.int64),
        row=np.ones((len(NAMES), WIDTH)),
        table=np.zeros((n, 8 * WIDTH)),
        state=np.ones((STATE_SIZE, WIDTH)),
        apex_Z=np.zeros((1, WIDTH)),
        steps=np.zeros((1, WIDTH)),
        active=np.zeros((1, WIDTH)),
        ending=np.zeros((1, WIDTH)),
    )
    return Workspace(np.empty((n, 8)), np.empty((0, 18)), lanes)


@entry
def fly_rows(
    rows: FloatArray,
    start: int,
    plant: Plant,
    inputs: Inputs,
    options: Options,
    ends: Ends,
    space: Workspace,
) -> None:
    """Fly rows one after the other.

    Args:
        rows: A flight in each row, shape (m, len(NAMES)).
        start: Place of the first flight in `ends`.
        plant: Constants that all flights share; the rows replace the others.
        inputs: Moments, profile of the wind and noise that all flights share.
        options: Step, duration and ground.
        ends: Filled from `start` on.
        space: See `workspace`.
    """
    table = space.table
    for i in range(len(rows)):
        row = rows[i]
        fill_table(row, plant.table, table)
        own_plant, own_inputs = plant_of(row, plant, table), inputs_of(row, inputs)
        result = integrate(release(row), own_plant, own_inputs, options, space.no_samples)
        write_end(row, result, start + i, ends)


@jit
def write_end(row: FloatArray, result: IntegrationResult, i: int, ends: Ends) -> None:
    """Write the end of flight `i`."""
    ends.status[i] = result.status
    ends.time[i] = result.t
    ends.apex[i] = 0.0 - result.apex_Z
    c_yaw, s_yaw = cos_sin_degrees(row[YAW])
    ends.drift[i] = s_yaw * result.state.X - c_yaw * result.state.Y
    store_state(ends.states[i], 0, result.state)


@entry
def fly_simd(
    rows: FloatArray,
    start: int,
    plant: Plant,
    inputs: Inputs,
    options: Options,
    ends: Ends,
    space: Workspace,
) -> None:
    """Fly rows without gusts, WIDTH at a time; arguments and results are those of `fly_rows`.

    All lanes make whole steps together. A flight that the next step would end is integrated to its
    end alone, from the state before that step, and its lane takes the next row. Lanes without a
    flight compute numbers that are not used.
    """
    step = options.step
    whole = _whole_steps(step, options.duration)
    lowest = 0.0 if options.ground else math.inf  # Z down
    a, table, no_samples = space.lanes, space.table, space.no_samples
    started = ended = 0
    change = True
    while ended < len(rows):
        for lane in range(WIDTH if change else 0):
            if a.ending[0, lane] > 0.0:
                i = a.flight[lane]
                fill_table(rows[i], plant.table, table)
                own_plant, own_inputs = plant_of(rows[i], plant, table), inputs_of(rows[i], inputs)
                x, apex_Z = flight_in(a, lane), a.apex_Z[0, lane]
                result = integrate_from(x, apex_Z, own_plant, own_inputs, options, no_samples)
                write_end(rows[i], result, start + i, ends)
                a.active[0, lane] = a.ending[0, lane] = 0.0
                ended += 1
            if a.active[0, lane] == 0.0 and started < len(rows):
                row = rows[started]
                fill_table(row, plant.table, table)
                own_plant, own_inputs = plant_of(row, plant, table), inputs_of(row, inputs)
                x = initialise(release(row), own_plant, own_inputs)
                fill_lane(a, lane, started, row, table, x.state)
                started += 1

        s, k, apex_Zs = load_state(a.state, 0), element(a.steps, 0), element(a.apex_Z, 0)
        plants, all_inputs = plant_of(a.row, plant, a.table), inputs_of(a.row, inputs)
        next_s = rk4_step(s, step, NO_GUST, NO_GUST, plants, all_inputs)
        goes_on = is_sound(next_s, step, plants) & (next_s.Z <= lowest) & (k < whole)  # noqa: SIM300
        if options.ground and plant.rim > 0.0:
            clear = depth(next_s, plant.rim) <= 0.0
            never_clear = depth(s, plant.rim) > 0.0
            goes_on = goes_on & (clear | never_clear)
        ending = where(goes_on, 0.0, element(a.active, 0))
        change = any_of(ending > 0.0)
        if change:
            next_s = select(goes_on, next_s, s)
            store(a.ending, 0, ending)
        over_the_top = (s.VZ < 0.0) & (next_s.VZ >= 0.0)
        if any_of(over_the_top):
            apex_Zs = where(over_the_top, min(apex_Zs, top(s, next_s, step)), apex_Zs)
        store(a.apex_Z, 0, min(apex_Zs, next_s.Z))
        store(a.steps, 0, where(goes_on, k + 1.0, k))
        store_state(a.state, 0, next_s)


@jit
def _whole_steps(step: float, duration: float) -> float:
    """Return how many steps `integrate` makes before the last one."""
    k = max(math.floor(duration / step) - 3.0, 0.0)
    while (k + 1.0) * step <= duration - 1e-9 * step:
        k += 1.0
    return k


@jit
def fill_lane(
    a: LaneState, lane: int, i: int, row: FloatArray, table: FloatArray, s: State
) -> None:
    """Start flight `i` in a lane."""
    a.flight[lane] = i
    for j in range(len(row)):
        a.row[j, lane] = row[j]
    for j in range(len(table)):
        for k in range(8):
            a.table[j, 8 * lane + k] = table[j, k]
    store_state(a.state[:, lane], 0, s)
    a.apex_Z[0, lane] = s.Z
    a.steps[0, lane] = 0.0
    a.active[0, lane] = 1.0


@inline
def flight_in(a: LaneState, lane: int) -> IntegratorState:
    """Return the flight in a lane as floats."""
    s = load_state(a.state[:, lane], 0)
    steps = int(a.steps[0, lane])
    return IntegratorState(steps, s, NO_GUST, _NO_FILTER, NO_GUST, NO_GUST, 0)
