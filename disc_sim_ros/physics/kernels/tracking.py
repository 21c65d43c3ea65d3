"""What a tracker would see of flights: positions and axes at given times, and the landings.

The same flights as in `sampling`, which writes whole states. An estimator flies some ten throws
for each measurement and compares only these six numbers, so they stay in the order of the lanes.
"""

import math
from typing import Any, NamedTuple

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import Plant, State
from disc_sim_ros.physics.kernels.jit import entry, inline, jit
from disc_sim_ros.physics.kernels.rk4 import Inputs, is_sound, rk4_step, touches
from disc_sim_ros.physics.kernels.rotation import rotation_elements
from disc_sim_ros.physics.kernels.rows import inputs_of, plant_of
from disc_sim_ros.physics.kernels.sampling import (
    NO_GUST,
    Grid,
    Samples,
    SampleSpace,
    between,
    end_lanes,
    fill_lane,
    rate_of_change,
    write_flying,
    write_lanes,
)
from disc_sim_ros.physics.kernels.simd import WIDTH, any_of, element, store, where
from disc_sim_ros.physics.kernels.state_arrays import load_state, select, store_state

SEEN = 6  # X, Y, Z and the axis through the underside in earth axes 1


class Sight(NamedTuple):
    """What is seen of n flights; filled by the loop."""

    sights: FloatArray  # group by group, sample by sample, SEEN rows; shape (groups k SEEN, WIDTH)
    last: FloatArray  # states at the last sample, shape (n, 14)


@entry
def track_simd(
    states: FloatArray,
    rows: FloatArray,
    plant: Plant,
    inputs: Inputs,
    grid: Grid,
    out: Samples,
    sight: Sight,
    space: SampleSpace,
) -> None:
    """Fly WIDTH flights at a time to the last sample and, within the duration, to the landing.

    Args:
        states: First states, columns as in State, shape (n, 14).
        rows: Constants of each flight, shape (n, len(NAMES)).
        plant: Constants that all flights share; the rows replace the others.
        inputs: Moments and profile of the wind that all flights share; without gusts.
        grid: Step, duration and times of the samples.
        out: Ends of the flights; its `states` are not used.
        sight: Filled.
        space: See `sampling.sample_space`.
    """
    a = space
    for first in range(0, len(states), WIDTH):
        count = min(WIDTH, len(states) - first)
        for lane in range(WIDTH):
            fill_lane(a, lane, first + min(lane, count - 1), states, rows, plant, inputs, out)
        _track_group(first, count, rows, plant, inputs, grid, out, sight, a)


@jit
def _track_group(
    first: int,
    count: int,
    rows: FloatArray,
    plant: Plant,
    inputs: Inputs,
    grid: Grid,
    out: Samples,
    sight: Sight,
    a: SampleSpace,
) -> None:
    """Fly the flights in the lanes, `count` of them from `first` on."""
    plants, all_inputs = plant_of(a.row, plant, a.table), inputs_of(a.row, inputs)
    step, times = grid.step, grid.times
    s = load_state(a.state, 0)
    d = rate_of_change(s, plants, all_inputs)
    place = first // WIDTH * len(times) * SEEN
    j = k = 0
    flying = WIDTH
    while j < len(times) or (flying > 0 and k * step < grid.duration):
        t = k * step
        next_s = rk4_step(s, step, NO_GUST, NO_GUST, plants, all_inputs)
        sound = is_sound(next_s, step, plants)
        next_s = select(sound, next_s, s)
        if j < len(times):
            next_d = rate_of_change(next_s, plants, all_inputs)
            while j < len(times) and times[j] < t + step:
                _see(s, d, next_s, next_d, step, times[j] - t, sound, sight.sights, place)
                place += SEEN
                j += 1
            if j == len(times):
                x = between(s, d, next_s, next_d, step, times[j - 1] - t, plants, all_inputs)
                write_lanes(x, sound, count, a.next_state, sight.last[first:])
            d = next_d
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


@inline
def _see(
    s: State,
    d: State,
    end: State,
    end_d: State,
    h: float,
    t: float,
    sound: Any,
    sights: FloatArray,
    place: int,
) -> None:
    """Write what is seen at time `t` in a step of `h`, on the cubic of `sampling.between`."""
    f = t / h
    f2, f3 = f * f, f * f * f
    # Hermite's polynomials: of the rise from `s` to `end`, and of both rates.
    rise, start, stop = 3.0 * f2 - 2.0 * f3, h * (f - 2.0 * f2 + f3), h * (f3 - f2)
    for c in range(3):
        x = s[c] + rise * (end[c] - s[c]) + start * d[c] + stop * end_d[c]
        store(sights, place + c, where(sound, x, math.nan))
    e0 = s.e0 + rise * (end.e0 - s.e0) + start * d.e0 + stop * end_d.e0
    e1 = s.e1 + rise * (end.e1 - s.e1) + start * d.e1 + stop * end_d.e1
    e2 = s.e2 + rise * (end.e2 - s.e2) + start * d.e2 + stop * end_d.e2
    e3 = s.e3 + rise * (end.e3 - s.e3) + start * d.e3 + stop * end_d.e3
    n = 1.0 / math.sqrt(e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3)
    _, _, xz, _, _, yz, _, _, zz = rotation_elements(e0 * n, e1 * n, e2 * n, e3 * n)
    store(sights, place + 3, where(sound, xz, math.nan))
    store(sights, place + 4, where(sound, yz, math.nan))
    store(sights, place + 5, where(sound, zz, math.nan))
