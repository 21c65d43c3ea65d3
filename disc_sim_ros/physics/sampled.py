"""Flights from any state, sampled at any times: the model that estimators fit to measurements."""

from contextlib import closing
from dataclasses import dataclass
from functools import partial
import os

import numpy as np

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import flight
from disc_sim_ros.physics.ensemble import defaults
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.kernels.jit import COMPILED, note_before
from disc_sim_ros.physics.kernels.rk4 import STABLE, Inputs
from disc_sim_ros.physics.kernels.rows import NAMES
from disc_sim_ros.physics.kernels.sampling import (
    Grid,
    Samples,
    sample_rows,
    sample_simd,
    sample_space,
)
from disc_sim_ros.physics.kernels.simd import WIDTH
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE
from disc_sim_ros.threads import Threads

_FLIGHTS_A_THREAD = 64  # fewer are not worth a second thread


@dataclass(frozen=True, slots=True)
class Sampled:
    """Samples and ends of n flights, in the paper's axes.

    Attributes:
        states: States at the k times, columns as in State, shape (n, k, 14). They go on below the
            ground as if it were not there; nan from the moment at which a flight is LOST.
        status: LANDED, FLYING (no landing within the duration) or LOST (the step cannot follow),
            shape (n,).
        time: Time of the landing, or of the end of another kind [s], shape (n,).
        ends: States at that time, shape (n, 14).
    """

    states: FloatArray
    status: IntArray
    time: FloatArray
    ends: FloatArray


def default_row(setup: Setup, control: Control = flight.NO_CONTROL) -> FloatArray:
    """Return the constants of a flight with this setup, shape (len(NAMES),).

    `kernels.rows.AT` has the place of each name. Wind components are in `map`; factors are 1 and
    offsets 0. The columns of a launch are not used by `fly_sampled`.
    """
    return np.array(list(defaults(setup, control).values()))


def fly_sampled(
    states: FloatArray,
    rows: FloatArray,
    setup: Setup,
    times: FloatArray,
    *,
    step: float,
    duration: float,
    threads: int = 1,
) -> Sampled:
    """Fly from given states to their landings, and sample each flight at given times.

    Nothing is checked for its range, because an estimator calls this for each measurement. Samples
    lie on cubics through the ends of the steps. `good_step` tells how exact they are.

    Args:
        states: First states, paper's axes, columns as in State, shape (n, 14).
        rows: Constants of each flight, from `default_row`, shape (n, len(NAMES)).
        setup: The disc, the model, the profile of the wind and the ground contact of all.
        times: Times of the samples after the first state, ascending from 0 [s], shape (k,).
        step: Integration step [s].
        duration: Time in which a landing is looked for [s].
        threads: Most threads to use.

    Returns:
        The samples and the ends, which do not depend on `threads`.

    Raises:
        ConfigError: The setup has gusts, which no estimator can know, times do not ascend, or an
            array has another shape.
    """
    if setup.wind.turbulence > 0.0:
        raise ConfigError('turbulence', setup.wind.turbulence, 'sampled flights have no gusts: 0')
    states = np.ascontiguousarray(states, dtype=float)
    rows = np.ascontiguousarray(rows, dtype=float)
    if states.ndim != 2 or states.shape[1] != STATE_SIZE:
        raise ConfigError('states', states.shape, f'give an array of shape (n, {STATE_SIZE})')
    n = len(states)
    if rows.shape != (n, len(NAMES)):
        raise ConfigError('rows', rows.shape, f'give an array of shape ({n}, {len(NAMES)})')
    grid = Grid(float(step), float(duration), np.ascontiguousarray(times, dtype=float))
    if (np.diff(grid.times, prepend=0.0) < 0.0).any():
        raise ConfigError('times', grid.times.tolist(), 'give them ascending from 0')
    out = Samples(
        np.empty((n, len(grid.times), STATE_SIZE)),
        np.empty(n, np.int64),
        np.empty(n),
        np.empty((n, STATE_SIZE)),
    )
    inputs = Inputs(flight.NO_CONTROL, setup.wind_data, flight.NO_NOISE)
    plant = setup.plant
    kernel = sample_simd if COMPILED else sample_rows

    def work(start: int, stop: int) -> None:
        part = Samples(
            out.states[start:stop],
            out.status[start:stop],
            out.time[start:stop],
            out.ends[start:stop],
        )
        kernel(
            states[start:stop], rows[start:stop], plant, inputs, grid, part, sample_space(plant)
        )

    parts = max(min(threads, os.cpu_count() or 1, -(-n // _FLIGHTS_A_THREAD)), 1)
    size = -(-n // (parts * WIDTH)) * WIDTH
    with closing(Threads(parts)) as pool:
        pool.run(partial(work, i, min(i + size, n)) for i in range(0, n, max(size, 1)))
    return Sampled(*out)


def good_step(
    setup: Setup, spin: float, speed: float, *, margin: float = 10.0, longest: float = 0.01
) -> float:
    """Return a step that follows the fastest motion of a disc [s].

    A throw with 3.6 rad/s of wobble is within 0.1 mm and 0.003 rad/s of a far finer flight with
    the margin 10, and within 3 mm and 0.1 rad/s with the margin 4 (test/physics/test_sampled.py).

    Args:
        setup: The disc and the air.
        spin: Largest spin rate expected [rad/s].
        speed: Largest airspeed expected [m/s].
        margin: How many times shorter the step is than the limit of RK4.
        longest: Longest step to return [s].
    """
    if setup.model == 'precession':
        return longest
    steepest = setup.disc.steepest_moment(setup.aero or setup.disc.aero)
    fastest = float(max(flight.rates(spin, speed, setup.plant, steepest)))
    return min(longest, STABLE / (margin * max(fastest, 1e-9)))


def first_call_note() -> str:
    """Return one line for users on why the next `fly_sampled` takes long; '' if it does not."""
    return note_before(sample_simd if COMPILED else sample_rows, seconds=10)
