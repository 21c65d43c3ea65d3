"""Many flights in single steps, with control of each on the way: for learning and for swarms."""

from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.flight import NO_CONTROL, NO_NOISE, Setup, check_setup
from disc_sim_ros.physics.kernels import step_batch
from disc_sim_ros.physics.kernels.integrator import LANDED, LOST
from disc_sim_ros.physics.kernels.jit import COMPILED, note_before
from disc_sim_ros.physics.kernels.rk4 import Inputs
from disc_sim_ros.physics.kernels.simd import WIDTH
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE
from disc_sim_ros.physics.launch import ABOVE_GROUND
from disc_sim_ros.quantities import CONTROL, LAUNCH, MEAN_WIND
from disc_sim_ros.threads import Threads
from disc_sim_ros.validation import Quantity

_LEAST = 64  # blocks for which a second thread pays
_CONTROL_NAMES = tuple(CONTROL)
_NO_STATES = np.empty((0, 0))
_NO_LAUNCHES = np.empty((0, len(LAUNCH)))


class BatchSimulator:
    """Flies many equal discs in whole steps, each as a `FlightSimulator` does, to the bit.

    The flights share the disc, the model, the air and the step. Each has a launch, a mean wind
    and control inputs of its own. There is no turbulence.

    Attributes:
        setup: The disc, its surroundings and the integration; its mean wind is not used.
        count: Number of flights.
        ground: True if flights end where the centre or the rim crosses z = 0 from above.
    """

    def __init__(
        self, setup: Setup, count: int, *, ground: bool = True, threads: int | None = None
    ) -> None:
        """Prepare flights, none of which is in the air yet.

        Args:
            setup: The disc, the model, the air, the profile of the wind and the step.
            count: Number of flights.
            ground: End flights on the ground.
            threads: Number of threads; None for one per core. Results do not depend on it.

        Raises:
            ConfigError: The wind has turbulence, or a number is below 1.
        """
        check_setup(setup)
        if setup.wind.turbulence > 0.0:
            raise ConfigError('turbulence', setup.wind.turbulence, 'batches fly without gusts')
        for name, value in (('count', count), ('threads', threads)):
            if value is not None and value < 1:
                raise ConfigError(name, value, 'give 1 or more')
        self.setup = setup
        self.count = count
        self.ground = ground
        self._batch = step_batch.new_batch(count)
        self._inputs = Inputs(NO_CONTROL, setup.wind_data, NO_NOISE)
        table = setup.plant.table
        lanes_table = step_batch.lanes_table(table) if COMPILED else table
        self._lanes_plant = setup.plant._replace(table=lanes_table)
        blocks = len(self._batch.status)
        self._threads = Threads(threads, most=blocks // _LEAST)
        workers = self._threads.count
        self._bounds = [blocks * k // workers for k in range(workers + 1)]

    def close(self) -> None:
        """End the threads."""
        self._threads.close()

    def release(self, flights: ArrayLike, launches: ArrayLike, winds: ArrayLike) -> None:
        """Release some discs, and set their control inputs to 0.

        Args:
            flights: Numbers of the flights, shape (m,).
            launches: The fields of Launch in its order, shape (m, 10).
            winds: Mean winds in `map` [m/s], shape (m, 3).

        Raises:
            ConfigError: A value is out of range, or the step too long for a flight.
        """
        launches = np.ascontiguousarray(launches, dtype=float)
        numbers, winds = self._checked(flights, winds)
        _check_columns(launches, LAUNCH, len(numbers))
        if not numbers.size:
            return
        if self.ground and launches[:, -1].min() < 0.0:
            raise ConfigError('height', float(launches[:, -1].min()), ABOVE_GROUND, 'height')
        speeds = launches[:, 0] + np.linalg.norm(winds, axis=1)
        spin = float(np.abs(launches[:, list(LAUNCH).index('spin')]).max())
        self.setup.check_step(spin, float(speeds.max()))
        self._release(numbers, launches, _NO_STATES, winds)

    def place(self, flights: ArrayLike, states: FloatArray, winds: ArrayLike) -> None:
        """Let some discs fly from any states, with control inputs 0.

        Args:
            flights: Numbers of the flights, shape (m,).
            states: Columns as in State, of sound flights, shape (14, m).
            winds: Mean winds in `map` [m/s], shape (m, 3).

        Raises:
            ConfigError: A number is not finite, or a wind out of range.
        """
        numbers, winds = self._checked(flights, winds)
        if states.shape != (STATE_SIZE, len(numbers)):
            allowed = f'give shape ({STATE_SIZE}, {len(numbers)})'
            raise ConfigError('states', states.shape, allowed)
        if not np.isfinite(states).all():
            raise ConfigError('states', 'nan or inf', 'give finite numbers')
        self._release(numbers, _NO_LAUNCHES, np.ascontiguousarray(states), winds)

    def _checked(self, flights: ArrayLike, winds: ArrayLike) -> tuple[IntArray, FloatArray]:
        numbers = np.asarray(flights, dtype=np.int64)
        if numbers.size and (numbers.min() < 0 or numbers.max() >= self.count):
            raise ConfigError('flights', numbers.tolist(), f'give numbers below {self.count}')
        columns = np.ascontiguousarray(winds, dtype=float)
        _check_columns(columns, MEAN_WIND, len(numbers))
        return numbers, columns

    def _release(
        self, flights: IntArray, launches: FloatArray, states: FloatArray, winds: FloatArray
    ) -> None:
        step_batch.release_batch(
            self._batch,
            flights,
            launches,
            states,
            frames.paper_from_map(winds),
            self.setup.plant,
            self._inputs,
        )

    def set_control(self, control: FloatArray) -> None:
        """Hold control coefficients from the next step on.

        Args:
            control: C_L, C_M, C_N in the paper's signs, shape (count, 3).

        Raises:
            ConfigError: A coefficient is out of the range of `quantities.CONTROL`.
        """
        most = CONTROL[_CONTROL_NAMES[0]].highest
        if control.shape != (self.count, 3):
            raise ConfigError('control', control.shape, f'give shape ({self.count}, 3)')
        if not np.abs(control).max() <= most:  # not a number, too
            i, j = np.unravel_index(np.argmax(~(np.abs(control) <= most)), control.shape)
            CONTROL[_CONTROL_NAMES[j]].check(float(control[i, j]))
        to_lanes(control, self._batch.control)

    def set_wind(self, winds: FloatArray) -> None:
        """Change the mean wind from the next step on.

        Args:
            winds: In `map` [m/s], shape (count, 3).

        Raises:
            ConfigError: A component is out of range.
        """
        _check_columns(winds, MEAN_WIND, self.count)
        to_lanes(frames.paper_from_map(winds), self._batch.wind)

    def advance(self, steps: int) -> None:
        """Fly some whole steps, on all threads; flights that have ended stay as they are.

        Args:
            steps: Number of steps.
        """
        parts = zip(self._bounds, self._bounds[1:], strict=False)
        self._threads.run(partial(self._advance, *part, steps) for part in parts)

    def _advance(self, start: int, stop: int, steps: int) -> None:
        advance = step_batch.advance_batch if COMPILED else step_batch.advance_singly
        advance(
            self._batch,
            start,
            stop,
            steps,
            self.setup.plant,
            self._lanes_plant,
            self._inputs,
            self.setup.fixed_step,
            self.ground,
        )

    @property
    def columns(self) -> FloatArray:
        """Return the present states, a copy: columns as in State, shape (14, count).

        A flight that has ended is at its last state above the ground.
        """
        return from_lanes(self._batch.state, self.count)

    def present(self, flights: ArrayLike) -> FloatArray:
        """Return the present states of some flights: of those that landed, at the landing.

        Args:
            flights: Their numbers, shape (m,).

        Returns:
            Columns as in State, shape (14, m).
        """
        b, lane = np.divmod(np.asarray(flights, dtype=np.int64), WIDTH)
        landed = self._batch.status[b, lane] == LANDED
        states = self._batch.end[b, :, lane], self._batch.state[b, :, lane]
        return np.where(landed[:, np.newaxis], *states).T

    @property
    def end_columns(self) -> FloatArray:
        """Return the states at the end, a copy, shape (14, count); of ended flights only."""
        return from_lanes(self._batch.end, self.count)

    @property
    def end_times(self) -> FloatArray:
        """Return the times of the ends since the release [s], shape (count,)."""
        return self._batch.end_time.reshape(-1)[: self.count]

    @property
    def flying(self) -> NDArray[np.bool_]:
        """Return where a disc is in the air, shape (count,)."""
        return self._batch.active.reshape(-1)[: self.count] > 0.0

    @property
    def landed(self) -> NDArray[np.bool_]:
        """Return where the last flight has landed, shape (count,)."""
        return np.equal(self._status, LANDED)

    @property
    def lost(self) -> NDArray[np.bool_]:
        """Return where a disc turned or moved faster than the step can follow, shape (count,)."""
        return np.equal(self._status, LOST)

    @property
    def steps(self) -> FloatArray:
        """Return the whole steps that each flight has made, shape (count,)."""
        return self._batch.steps.reshape(-1)[: self.count]

    @property
    def _status(self) -> IntArray:
        return self._batch.status.reshape(-1)[: self.count]


def _check_columns(columns: FloatArray, quantities: dict[str, Quantity], count: int) -> None:
    """Refuse numbers that are out of range, or columns of another shape."""
    if columns.shape != (count, len(quantities)):
        allowed = f'give shape ({count}, {len(quantities)})'
        raise ConfigError('shape', columns.shape, allowed)
    for x, quantity in zip(columns.T, quantities.values(), strict=True):
        good = (x >= quantity.lowest) & (x <= quantity.highest)
        if not good.all():
            quantity.check(float(x[np.argmin(good)]))


def to_lanes(rows: FloatArray, lanes: FloatArray) -> None:
    """Write rows, shape (count, m), to blocks of lanes, shape (blocks, m, WIDTH)."""
    n, m = rows.shape
    whole = n // WIDTH
    lanes[:whole] = rows[: whole * WIDTH].reshape(whole, WIDTH, m).swapaxes(1, 2)
    if n > whole * WIDTH:
        lanes[whole, :, : n - whole * WIDTH] = rows[whole * WIDTH :].T


def from_lanes(lanes: FloatArray, count: int) -> FloatArray:
    """Return columns, shape (m, count), of blocks of lanes, shape (blocks, m, WIDTH)."""
    columns = lanes.swapaxes(0, 1).copy()  # a reshaped single block would be a view
    return columns.reshape(lanes.shape[1], -1)[:, :count]


def first_call_note() -> str:
    """Return one line for users on why the first steps take long; '' if they do not."""
    return note_before(step_batch.advance_batch, step_batch.release_batch, seconds=10)
