"""Flights as a tracker sees them: positions and axes at given times, and the landings."""

from dataclasses import dataclass

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics import flight
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.integrator import LANDED
from disc_sim_ros.physics.kernels.jit import COMPILED
from disc_sim_ros.physics.kernels.rk4 import Inputs
from disc_sim_ros.physics.kernels.rotation import rotation_elements
from disc_sim_ros.physics.kernels.sampling import Grid, Samples, sample_space
from disc_sim_ros.physics.kernels.simd import WIDTH
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE
from disc_sim_ros.physics.kernels.tracking import SEEN, Sight, track_simd
from disc_sim_ros.physics.sampled import fly_sampled

_NO_STATES = np.empty((0, 0, STATE_SIZE))


@dataclass(frozen=True, slots=True)
class Tracks:
    """Flights as they are seen, in the paper's axes.

    Attributes:
        sights: Position [m] and axis through the underside at the k times, in groups of WIDTH
            flights: shape (groups, k, SEEN, WIDTH). nan from a loss on; what lies in lanes without
            a flight has no meaning.
        last: States at the last time, shape (n, 14).
        landing: X, Y [m] and time [s]; nan without a landing in the duration, shape (n, 3).
        ends: States at the ends, shape (n, 14).
    """

    sights: FloatArray
    last: FloatArray
    landing: FloatArray
    ends: FloatArray


class Tracker:
    """Flies throws of one setup and step, as `sampled.fly_sampled` does; one thread at a time.

    What an estimator needs for each measurement is computed once. Nothing is checked.
    """

    def __init__(self, setup: Setup, step: float) -> None:
        """Take a setup without gusts and a step [s]."""
        self._setup, self._step = setup, step
        self._plant = setup.plant
        self._inputs = Inputs(flight.NO_CONTROL, setup.wind_data, flight.NO_NOISE)
        self._space = sample_space(self._plant)

    def fly(
        self, states: FloatArray, rows: FloatArray, times: FloatArray, duration: float
    ) -> Tracks:
        """Return the tracks of n flights.

        Args:
            states: First states, shape (n, 14).
            rows: Constants of each flight, shape (n, len(NAMES)).
            times: At least one, ascending from 0 [s], shape (k,).
            duration: Time in which landings are looked for [s]; 0: none.
        """
        if not COMPILED:
            return self._in_python(states, rows, times, duration)
        n, k = len(states), len(times)
        groups = -(-n // WIDTH)
        out = Samples(_NO_STATES, np.empty(n, np.int64), np.empty(n), np.empty((n, STATE_SIZE)))
        sight = Sight(np.empty((groups * k * SEEN, WIDTH)), np.empty((n, STATE_SIZE)))
        grid = Grid(self._step, duration, times)
        track_simd(states, rows, self._plant, self._inputs, grid, out, sight, self._space)
        landing = _landings(out.status == LANDED, out.ends, out.time)
        return Tracks(sight.sights.reshape(groups, k, SEEN, WIDTH), sight.last, landing, out.ends)

    def _in_python(
        self, states: FloatArray, rows: FloatArray, times: FloatArray, duration: float
    ) -> Tracks:
        n, k = len(states), len(times)
        flown = fly_sampled(states, rows, self._setup, times, step=self._step, duration=duration)
        sights = np.full((-(-n // WIDTH) * WIDTH, k, SEEN), np.nan)
        sights[:n, :, :3] = flown.states[:, :, :3]
        _, _, x, _, _, y, _, _, z = rotation_elements(*np.moveaxis(flown.states[:, :, 6:10], 2, 0))
        sights[:n, :, 3:] = np.stack([x, y, z], axis=2)
        lanes = np.moveaxis(sights.reshape(-1, WIDTH, k, SEEN), 1, 3)
        landing = _landings(flown.status == LANDED, flown.ends, flown.time)
        return Tracks(np.ascontiguousarray(lanes), flown.states[:, -1], landing, flown.ends)


def _landings(landed: FloatArray, ends: FloatArray, time: FloatArray) -> FloatArray:
    landing = np.empty((len(ends), 3))
    landing[:, :2] = ends[:, :2]
    landing[:, 2] = time
    landing[np.logical_not(landed)] = np.nan
    return landing
