"""The loops over many flights with error control; see `batch` for those in fixed steps."""

from typing import NamedTuple

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels import dopri5
from disc_sim_ros.physics.kernels.adaptive import (
    CLOSE,
    SOUND,
    Progress,
    comes_down,
    continue_adaptive,
    ends_of,
    first_progress,
    integrate_adaptive,
    judge,
)
from disc_sim_ros.physics.kernels.aerodynamics import row_of
from disc_sim_ros.physics.kernels.batch import (
    NO_GUST,
    Ends,
    Workspace,
    fill_lane,
    flight_in,
    workspace,
    write_end,
)
from disc_sim_ros.physics.kernels.dopri5 import with_table
from disc_sim_ros.physics.kernels.equations import Plant
from disc_sim_ros.physics.kernels.integrator import Options, initialise
from disc_sim_ros.physics.kernels.jit import entry, inline
from disc_sim_ros.physics.kernels.nutation import remember
from disc_sim_ros.physics.kernels.rk4 import Inputs, is_sound, top
from disc_sim_ros.physics.kernels.rows import fill_table, inputs_of, plant_of, release
from disc_sim_ros.physics.kernels.simd import WIDTH, any_of, element, store, where
from disc_sim_ros.physics.kernels.stages import SPACE, carry
from disc_sim_ros.physics.kernels.state_arrays import load_state, select, store_state


class AdaptiveWorkspace(NamedTuple):
    """Arrays that a loop works in; each thread needs its own."""

    common: Workspace
    K: FloatArray  # of one flight, shape (SPACE,)
    lanes_K: FloatArray  # of each lane, shape (SPACE, WIDTH)
    progress: FloatArray  # of each lane, in the order of Progress, shape (6, WIDTH)


def adaptive_workspace(plant: Plant) -> AdaptiveWorkspace:
    """Return a workspace without flights, for tables as long as that of `plant`."""
    progress = np.zeros((len(Progress._fields), WIDTH))
    progress[1:3] = 1e-3
    return AdaptiveWorkspace(workspace(plant), np.zeros(SPACE), np.zeros((SPACE, WIDTH)), progress)


@entry
def fly_rows_adaptive(
    rows: FloatArray,
    start: int,
    plant: Plant,
    inputs: Inputs,
    options: Options,
    ends: Ends,
    space: AdaptiveWorkspace,
) -> None:
    """Fly rows one after the other; arguments and results are those of `batch.fly_rows`."""
    table, no_samples = space.common.table, space.common.no_samples
    for i in range(len(rows)):
        row = rows[i]
        fill_table(row, plant.table, table)
        own_plant, own_inputs = plant_of(row, plant, table), inputs_of(row, inputs)
        result = integrate_adaptive(
            release(row), own_plant, own_inputs, options, no_samples, space.K
        )
        write_end(row, result, start + i, ends)


@entry
def fly_simd_adaptive(  # noqa: PLR0915 - one loop, whose parts share all of its state
    rows: FloatArray,
    start: int,
    plant: Plant,
    inputs: Inputs,
    options: Options,
    ends: Ends,
    space: AdaptiveWorkspace,
) -> None:
    """Fly rows without gusts, WIDTH at a time; see `batch.fly_simd`.

    All lanes attempt a step together, each of its own length. A flight that the step would end is
    integrated to its end alone, from the state before that step.
    """
    a, table, no_samples = space.common.lanes, space.common.table, space.common.no_samples
    K, lanes_K = space.K, space.lanes_K
    smooth = plant.use_linear and len(plant.spin_terms) == 0
    started = ended = 0
    change = True
    while ended < len(rows):
        for lane in range(WIDTH if change else 0):
            if a.ending[0, lane] > 0.0:
                i = a.flight[lane]
                fill_table(rows[i], plant.table, table)
                own_plant, own_inputs = plant_of(rows[i], plant, table), inputs_of(rows[i], inputs)
                x, apex_Z = flight_in(a, lane), a.apex_Z[0, lane]
                carry(lanes_K[:, lane], K)
                result = continue_adaptive(
                    x, _progress(space, lane), apex_Z, own_plant, own_inputs, options,
                    no_samples, K,
                )  # fmt: skip
                write_end(rows[i], result, start + i, ends)
                a.active[0, lane] = a.ending[0, lane] = 0.0
                ended += 1
            if a.active[0, lane] == 0.0 and started < len(rows):
                row = rows[started]
                fill_table(row, plant.table, table)
                own_plant, own_inputs = plant_of(row, plant, table), inputs_of(row, inputs)
                x = initialise(release(row), own_plant, own_inputs)
                p = first_progress(x.state, NO_GUST, own_plant, own_inputs)
                own_plant = with_table(own_plant, row_of(table, p.row))
                dopri5.start(x.state, NO_GUST, own_plant, own_inputs, K)
                fill_lane(a, lane, started, row, table, x.state)
                carry(K, lanes_K[:, lane])
                for j in range(len(p)):
                    space.progress[j, lane] = p[j]
                started += 1

        s, apex_Zs = load_state(a.state, 0), element(a.apex_Z, 0)
        p = Progress(
            element(space.progress, 0),
            element(space.progress, 1),
            element(space.progress, 2),
            element(space.progress, 3),
            element(space.progress, 4),
            element(space.progress, 5),
        )
        plants, all_inputs = plant_of(a.row, plant, a.table), inputs_of(a.row, inputs)
        line = row_of(a.table, p.row)
        plants = with_table(plants, line)
        low_end, high_end = ends_of(p.row, line, len(plant.table), smooth)
        next_t = p.t + p.h
        ends_early = next_t > options.duration - CLOSE
        next_s = dopri5.step(s, p.h, NO_GUST, NO_GUST, plants, all_inputs, lanes_K)
        accepted, next_p = judge(
            p, p.h, next_t, ends_early, s, next_s, NO_GUST, NO_GUST, plants, all_inputs,
            low_end, high_end, lanes_K,
        )  # fmt: skip
        alone = where(is_sound(next_s, SOUND, plants), 0.0, 1.0)
        if options.ground:
            alone = where(comes_down(s, next_s, p.h, plants), 1.0, alone)
        alone = where(ends_early, 1.0, where(accepted, alone, 0.0))
        ending = where(alone > 0.0, element(a.active, 0), 0.0)
        change = any_of(ending > 0.0)
        store(a.ending, 0, ending)
        accepted = accepted & (alone <= 0.0)

        over_the_top = accepted & (s.VZ < 0.0) & (next_s.VZ >= 0.0)
        if any_of(over_the_top):
            apex_Zs = where(over_the_top, min(apex_Zs, top(s, next_s, p.h)), apex_Zs)
        store(a.apex_Z, 0, where(accepted, min(apex_Zs, next_s.Z), apex_Zs))
        remember(s, next_s, p.h, accepted, plants, lanes_K)
        store_state(a.state, 0, select(accepted, next_s, s))
        for j in range(len(next_p)):
            store(space.progress, j, where(alone > 0.0, p[j], next_p[j]))


@inline
def _progress(space: AdaptiveWorkspace, lane: int) -> Progress:
    a = space.progress
    return Progress(a[0, lane], a[1, lane], a[2, lane], a[3, lane], a[4, lane], a[5, lane])
