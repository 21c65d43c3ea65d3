"""Many flights at once, equal to those of `flight.fly`: in SIMD registers, on all cores."""

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from functools import partial
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import flight, frames
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.adaptive_batch import (
    adaptive_workspace,
    fly_rows_adaptive,
    fly_simd_adaptive,
)
from disc_sim_ros.physics.kernels.batch import Ends, fly_rows, fly_simd, workspace
from disc_sim_ros.physics.kernels.equations import Control, State
from disc_sim_ros.physics.kernels.integrator import FLYING, LANDED, Options
from disc_sim_ros.physics.kernels.jit import COMPILED, note_before
from disc_sim_ros.physics.kernels.rk4 import STABLE, Inputs
from disc_sim_ros.physics.kernels.rows import AT, NAMES
from disc_sim_ros.physics.kernels.simd import WIDTH
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE
from disc_sim_ros.physics.kernels.wind import GUST_INTERVAL, NOISE_COLUMNS
from disc_sim_ros.physics.launch import ABOVE_GROUND
from disc_sim_ros.quantities import DURATION, LAUNCH, VARIED
from disc_sim_ros.threads import Threads

# A thread takes as many flights at a time as it flies in about 0.1 s, so that Ctrl-C acts soon.
_ON_GROUND = 1e-8  # m; a landing is located to 1e-9 s
_CHUNK = 2e6  # steps
_USUAL_STEP = 5e-3  # s; most steps with error control are longer
_USUAL_FLIGHT = 10.0  # s; most are shorter
_LONGEST_CHUNK = 4096  # flights
_FIRST_GUSTS = 500  # rows of noise drawn at first, for 5 s; most flights have landed by then


@dataclass(frozen=True, slots=True)
class Landings:
    """The ends of the flights of an ensemble; positions in `map`.

    Attributes:
        status: LANDED, FLYING (time was up) or LOST (the step could not follow: the state is the
            last sound one), shape (n,).
        time: Time of flight [s], shape (n,).
        apex: Greatest height above the ground [m], shape (n,).
        drift: Distance of each end to the left of its launch heading [m], shape (n,).
        states: States at the end in the paper's axes, columns as in State, shape (n, 14).
    """

    status: IntArray
    time: FloatArray
    apex: FloatArray
    drift: FloatArray
    states: FloatArray

    @property
    def x(self) -> FloatArray:
        """Return x of each end, forward [m]."""
        return self.states[:, 0]

    @property
    def y(self) -> FloatArray:
        """Return y of each end, left [m]."""
        return frames.flip(self.states[:, 1])

    @property
    def z(self) -> FloatArray:
        """Return z of the centre at each end, up [m]; 0 where it landed on its centre."""
        z = frames.flip(self.states[:, 2])
        return np.where((self.status == LANDED) & (np.abs(z) < _ON_GROUND), 0.0, z)

    @property
    def range(self) -> FloatArray:
        """Return the distance over the ground from the release [m]."""
        return np.hypot(self.states[:, 0], self.states[:, 1])

    @property
    def end_speed(self) -> FloatArray:
        """Return the speed over the ground at the end [m/s]."""
        speeds: FloatArray = np.sqrt(np.sum(self.states[:, 3:6] ** 2, axis=1))
        return speeds

    @property
    def end_spin(self) -> FloatArray:
        """Return the spin at the end [rad/s], clockwise from above positive."""
        return self.states[:, State._fields.index('r')]


def fly_many(
    launches: Mapping[str, ArrayLike],
    setup: Setup,
    *,
    control: Control = flight.NO_CONTROL,
    seeds: ArrayLike | None = None,
    duration: float = DURATION.default,
    ground: bool = True,
    threads: int | None = None,
) -> Landings:
    """Fly many discs, each as `flight.fly` would.

    Args:
        launches: Quantities that differ between flights, by a name of NAMES: fields of Launch,
            components of the mean wind in `map`, control coefficients, properties of the disc and
            of the air. Each is a number or an array of shape (n,). Others are those of a default
            Launch, of `setup` and of `control`.
        setup: The disc, the model, the air, the wind and the step of all.
        control: Control inputs of all, held for the whole flight.
        seeds: Seeds of the gusts, shape (n,); None for that of `setup` in every flight.
        duration: Longest time of flight [s].
        ground: End where the centre or the rim (`Setup.ground_contact`) crosses z = 0 from above;
            else fly for `duration`.
        threads: Number of threads; None for one per core.

    Returns:
        The ends of the flights, in their order; they do not depend on `threads`.

    Raises:
        ConfigError: A name is unknown, shapes differ, a value is out of range or the step is too
            long for a flight; it names the first such flight.
    """
    if not hasattr(launches, 'items'):  # a table of pandas has them too
        raise ConfigError('launches', launches, "give columns, such as {'speed': [17.0, 18.0]}")
    flight.check_setup(setup)
    DURATION.check(duration)
    control = flight.checked_control(control)
    columns = _checked_columns(launches, setup, control, ground=ground)
    n = max((x.size for x in columns.values() if x.ndim), default=1)
    ends = Ends(
        np.empty(n, np.int64), np.empty(n), np.empty(n), np.empty(n), np.empty((n, STATE_SIZE))
    )
    gust_seeds = None
    seconds = min(duration, _USUAL_FLIGHT) if ground else duration
    step = _USUAL_STEP if setup.step is None else setup.step
    chunk = round(min(max(_CHUNK * step / seconds, WIDTH), _LONGEST_CHUNK))
    if setup.wind.turbulence > 0.0:
        gust_seeds = _seeds(setup.wind.seed if seeds is None else seeds, n)
        chunk = max(chunk // 16, 1)
    common = _Common(setup, control, float(duration), ground, ends)

    def work(start: int) -> None:
        rows, space = _rows(columns, start, min(start + chunk, n)), _space(setup)
        if gust_seeds is None:
            common.fly(rows, start, flight.NO_NOISE, common.duration, space)
            return
        for i, row in enumerate(rows, start):
            common.fly_in_gusts(row[np.newaxis], i, int(gust_seeds[i]), space)

    starts = range(0, n, chunk)
    with closing(Threads(threads, most=len(starts))) as pool:
        pool.run(partial(work, start) for start in starts)
    return Landings(*ends)


def first_call_note(setup: Setup) -> str:
    """Return one line for users on why the next `fly_many` takes long; '' if it does not."""
    return note_before(_kernel(setup), seconds=20)


def _kernel(setup: Setup) -> Callable[..., None]:
    """Return the loop over flights: in SIMD registers, but singly in gusts and in plain Python."""
    in_registers = COMPILED and setup.wind.turbulence == 0.0
    if setup.step is None:
        return fly_simd_adaptive if in_registers else fly_rows_adaptive
    return fly_simd if in_registers else fly_rows


def _space(setup: Setup) -> Any:
    """Return a workspace for the loop over flights."""
    if setup.step is None:
        return adaptive_workspace(setup.corner_plant)
    return workspace(setup.plant)


@dataclass(frozen=True)
class _Common:
    """The values that all flights of an ensemble share, and the arrays of their ends."""

    setup: Setup
    control: Control
    duration: float
    ground: bool
    ends: Ends

    def fly(
        self,
        rows: FloatArray,
        start: int,
        noise: FloatArray,
        duration: float,
        space: Any,
    ) -> None:
        """Fly all rows, the first of which is flight `start`."""
        setup = self.setup
        inputs = Inputs(self.control, setup.wind_data, noise)
        step, plant = setup.fixed_step, setup.plant
        if setup.step is None:
            plant = setup.corner_plant
        options = Options(step, duration, self.ground, 0.0)
        _kernel(setup)(rows, start, plant, inputs, options, self.ends, space)

    def fly_in_gusts(self, row: FloatArray, i: int, seed: int, space: Any) -> None:
        """Fly one row; draw more of the same numbers if it is in the air for long."""
        needed = math.ceil(self.duration / GUST_INTERVAL) + 3
        for count in (min(_FIRST_GUSTS, needed), min(4 * _FIRST_GUSTS, needed), needed):
            generator = np.random.Generator(np.random.Philox(seed))
            noise = generator.standard_normal((count, NOISE_COLUMNS))
            duration = min(self.duration, (count - 3) * GUST_INTERVAL)
            self.fly(row, i, noise, duration, space)
            if self.ends.status[i] != FLYING or count == needed:
                return


def _checked_columns(
    launches: Mapping[str, ArrayLike], setup: Setup, control: Control, *, ground: bool
) -> dict[str, FloatArray]:
    """Return a checked column for each of NAMES, of shape (n,) or ()."""
    columns = {name: np.array(x) for name, x in defaults(setup, control).items()}
    for name, values in launches.items():
        validation.choice('launches', name, NAMES)
        try:
            columns[name] = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            raise ConfigError(name, values, 'give numbers') from None
    n = max((x.size for x in columns.values() if x.ndim), default=1)
    for name, x in columns.items():
        if x.ndim > 1 or (x.ndim == 1 and x.size != n):
            raise ConfigError(name, x.shape, f'give a number or an array of shape ({n},)')
    for name in launches:
        x, quantity = columns[name], VARIED[name]
        _refuse(name, x, (x >= quantity.lowest) & (x <= quantity.highest), quantity.allowed)
    if ground:
        _refuse('height', columns['height'], columns['height'] >= 0.0, ABOVE_GROUND)
    axial, most = columns['inertia_axial'], 2.0 * columns['inertia_diametral']
    axial = np.broadcast_to(axial, np.broadcast_shapes(axial.shape, most.shape))
    _refuse('inertia_axial', axial, axial <= most * (1 + 1e-9), 'at most twice inertia_diametral')
    for start in range(0, n, _LONGEST_CHUNK):
        _refuse_long_steps(_rows(columns, start, min(start + _LONGEST_CHUNK, n)), start, setup)
    return columns


def _rows(columns: dict[str, FloatArray], start: int, stop: int) -> FloatArray:
    """Return some flights as rows for the compiled loops, shape (stop - start, len(NAMES))."""
    rows = np.empty((stop - start, len(NAMES)))
    for j, name in enumerate(NAMES):
        x = columns[name]
        rows[:, j] = x[start:stop] if x.ndim else x
    return rows


def _refuse(name: str, values: FloatArray, good: NDArray[np.bool_], allowed: str) -> None:
    if not good.all():
        i = int(np.argmin(good))
        raise ConfigError(f'{name} of flight {i}', float(values.flat[i]), allowed, name)


def _refuse_long_steps(rows: FloatArray, start: int, setup: Setup) -> None:
    """Refuse a step that RK4 cannot follow in some flight, as `Setup.check_step` does for one."""
    if setup.model == 'precession' or setup.step is None:
        return
    of = {name: rows[:, j] for name, j in AT.items()}
    spin = of['spin']
    V = of['speed'] + np.sqrt(of['wind_x'] ** 2 + of['wind_y'] ** 2 + of['wind_z'] ** 2)
    arrays: dict[str, Any] = {
        'I_x': of['inertia_diametral'],
        'I_z': of['inertia_axial'],
        'rho': of['air_density'],
    }
    plant = setup.plant._replace(C_Lp=-1.0, C_Mq=-1.0, **arrays)
    steepest = setup.disc.steepest_moment(setup.aero or setup.disc.aero)
    nutation, damping, pitching = flight.rates(spin, V, plant, steepest)
    damping = damping * np.maximum(-of['C_Lp'], -of['C_Mq'])
    pitching = pitching * np.sqrt(of['pitching_factor'])
    fastest = np.maximum.reduce([nutation, damping, pitching])
    good = setup.step * fastest <= STABLE
    if not good.all():
        i = int(np.argmin(good))
        allowed = (
            f'flight {start + i}, at spin {spin[i]:g} rad/s and {V[i]:g} m/s through the air, '
            f'needs at most {STABLE / fastest[i]:.3g} s'
        )
        raise ConfigError('step', setup.step, allowed, 'step')


def defaults(setup: Setup, control: Control) -> dict[str, float]:
    """Return the default of each of NAMES."""
    wind = (frames.map_from_paper(setup.wind.mean) + 0.0).tolist()
    plant = setup.plant
    other = [*wind, control.C_L, control.C_M, control.C_N]
    other += [plant.m, plant.I_z, plant.I_x, plant.C_Lp, plant.C_Mq, plant.C_Nr, plant.rho]
    other += [plant.g, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    values = [*(quantity.default for quantity in LAUNCH.values()), *other]
    return dict(zip(NAMES, values, strict=True))


def _seeds(seeds: ArrayLike, n: int) -> IntArray:
    """Return a checked seed for each of `n` flights."""
    array = np.asarray(seeds)
    if array.dtype.kind not in 'iu' or array.shape not in {(), (n,)} or (array < 0).any():
        raise ConfigError('seeds', seeds, f'give whole numbers from 0, one or {n} of them')
    return np.broadcast_to(array.astype(np.int64), (n,))
