"""Many flights at once: `integration.integrate` over arrays of launches, on all cores."""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
import math
import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from disc_sim_ros.core import axes, check, flight
from disc_sim_ros.core._jit import is_compiled
from disc_sim_ros.core.disc import FloatArray
from disc_sim_ros.core.ensemble_rows import ALL_LIMITS, AT, NAMES, IntArray, fly_rows
from disc_sim_ros.core.equations import Control, State
from disc_sim_ros.core.errors import ConfigError
from disc_sim_ros.core.flight import Setup
from disc_sim_ros.core.integration import FLYING, LANDED, STATE_SIZE
from disc_sim_ros.core.launch import LIMITS, Launch
from disc_sim_ros.core.rk4 import STABLE
from disc_sim_ros.core.turbulence import GUST_INTERVAL, NOISE_COLUMNS

_CHUNK = 256  # flights that a thread takes at a time: 25 ms, so that Ctrl-C is heard
_FIRST_GUSTS = 1000  # rows of noise drawn at first, 10 s; nearly every flight has landed by then


@dataclass(frozen=True, slots=True)
class Landings:
    """How the flights of an ensemble ended; positions in `map`.

    Attributes:
        status: LANDED, FLYING (time was up) or LOST (the step could not follow: the state is the
            last sound one), shape (n,).
        time: Time of flight [s], shape (n,).
        apex: Greatest height above the ground [m], shape (n,).
        drift: How far left of its launch heading each ended [m], shape (n,).
        states: States at the end in the paper's axes, columns as in State, shape (n, 14).
    """

    status: IntArray
    time: FloatArray
    apex: FloatArray
    drift: FloatArray
    states: FloatArray

    @property
    def x(self) -> FloatArray:
        """Return how far forward each ended [m]."""
        return self.states[:, 0]

    @property
    def y(self) -> FloatArray:
        """Return how far left each ended [m]."""
        return 0.0 - self.states[:, 1]

    @property
    def z(self) -> FloatArray:
        """Return how high each ended [m]; 0 where it landed."""
        return np.where(self.status == LANDED, 0.0, 0.0 - self.states[:, 2])

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
    duration: float = 60.0,
    ground: bool = True,
    threads: int | None = None,
) -> Landings:
    """Fly many discs, each as `flight.fly` would.

    Args:
        launches: What differs by name, as in NAMES: fields of Launch, components of the mean wind
            in `map`, control coefficients, properties of the disc and of the air. Each is a
            number or an array of shape (n,); what is not named is that of a default Launch, of
            `setup` and of `control`.
        setup: The disc, the model, the air, the wind and the step of all.
        control: Control inputs of all, held for the whole flight.
        seeds: Seeds of the gusts, shape (n,); all fly in those of `setup` otherwise.
        duration: Longest time of flight [s].
        ground: End where the centre crosses z = 0 from above; else fly for `duration`.
        threads: Number of threads; None for one a core.

    Returns:
        The ends of the flights, in their order; they do not depend on `threads`.

    Raises:
        ConfigError: A name is unknown, shapes differ, a value is out of range or a step too long
            for a flight; it names the first such flight.
    """
    check.number('duration', duration, above=0.0, highest=flight.LONGEST, unit='s')
    rows = _rows(launches, setup, flight.checked_control(control), ground=ground)
    n = len(rows)
    found = Landings(
        np.empty(n, np.int64), np.empty(n), np.empty(n), np.empty(n), np.empty((n, STATE_SIZE))
    )
    fixed = _Fixed(setup, flight.checked_control(control), float(duration), ground=ground)
    gusts = None
    if setup.wind.turbulence > 0.0:
        gusts = _seeds(setup.wind.seed if seeds is None else seeds, n)

    def work(start: int) -> None:
        stop = min(start + _CHUNK, n)
        if gusts is None:
            fixed.fly(rows, found, start, stop, flight.NO_NOISE)
            return
        for i in range(start, stop):
            fixed.fly_in_gusts(rows, found, i, int(gusts[i]))

    workers = min(threads or os.cpu_count() or 1, -(-n // _CHUNK))
    if workers <= 1:
        for start in range(0, n, _CHUNK):
            work(start)
        return found
    pool = ThreadPoolExecutor(workers)
    try:
        futures: list[Future[None]] = [pool.submit(work, s) for s in range(0, n, _CHUNK)]
        for future in futures:
            future.result()
    finally:
        pool.shutdown(cancel_futures=True)
    return found


def is_ready() -> bool:
    """Say whether `fly_many` needs no compilation first."""
    return is_compiled(fly_rows)


@dataclass(frozen=True)
class _Fixed:
    """What all flights of an ensemble share."""

    setup: Setup
    control: Control
    duration: float
    ground: bool

    def fly(
        self, rows: FloatArray, found: Landings, start: int, stop: int, noise: FloatArray
    ) -> None:
        setup = self.setup
        fly_rows(
            rows,
            start,
            stop,
            setup.plant,
            setup.disc.table_rows,
            setup.disc.spin_terms,
            self.control,
            setup.wind_data,
            noise,
            float(setup.step),
            self.duration,
            self.ground,
            found.status,
            found.time,
            found.apex,
            found.drift,
            found.states,
        )

    def fly_in_gusts(self, rows: FloatArray, found: Landings, i: int, seed: int) -> None:
        """Fly one; draw more of the same numbers where it is in the air for long."""
        needed = math.ceil(self.duration / GUST_INTERVAL) + 3
        for count in (min(_FIRST_GUSTS, needed), needed):
            generator = np.random.Generator(np.random.Philox(seed))
            noise = generator.standard_normal((count, NOISE_COLUMNS))
            duration = min(self.duration, (count - 3) * GUST_INTERVAL)
            _Fixed(self.setup, self.control, duration, self.ground).fly(
                rows, found, i, i + 1, noise
            )
            if found.status[i] != FLYING or count == needed:
                return


def _rows(
    launches: Mapping[str, ArrayLike], setup: Setup, control: Control, *, ground: bool
) -> FloatArray:
    """Return the columns of NAMES for all flights, checked, shape (n, len(NAMES))."""
    for name in launches:
        check.choice('launches', name, NAMES)
    given = {name: np.asarray(x, dtype=float) for name, x in launches.items()}
    sizes = {name: x.size for name, x in given.items() if x.ndim}
    n = max(sizes.values(), default=1)
    for name, x in given.items():
        if x.ndim > 1 or (x.ndim == 1 and x.size != n):
            raise ConfigError(name, x.shape, f'give a number or an array of shape ({n},)')
    defaults = _defaults(setup, control)
    rows = np.empty((n, len(NAMES)))
    for j, name in enumerate(NAMES):
        rows[:, j] = given.get(name, defaults[name])
    lowest, highest, _ = zip(*ALL_LIMITS.values(), strict=True)
    for name in given:
        j = AT[name]
        _refuse(name, rows[:, j], (rows[:, j] >= lowest[j]) & (rows[:, j] <= highest[j]))
    if ground:
        _refuse(
            'height',
            rows[:, AT['height']],
            rows[:, AT['height']] >= 0.0,
            'release at 0 m or above',
        )
    axial, most = rows[:, AT['inertia_axial']], 2.0 * rows[:, AT['inertia_diametral']]
    _refuse('inertia_axial', axial, axial <= most, 'at most twice inertia_diametral')
    _refuse_long_steps(rows, setup)
    return rows


def _refuse(name: str, values: FloatArray, good: NDArray[np.bool_], allowed: str = '') -> None:
    if not good.all():
        i = int(np.argmin(good))
        if not allowed:
            low, high, unit = ALL_LIMITS[name]
            allowed = f'give a number from {low:g} to {high:g} {unit}'.rstrip()
        raise ConfigError(f'{name} of flight {i}', float(values[i]), allowed)


def _refuse_long_steps(rows: FloatArray, setup: Setup) -> None:
    """Refuse a step that RK4 cannot follow in some flight, as `Setup.check_step` does for one."""
    if setup.model == 'precession':
        return
    of = {name: rows[:, j] for name, j in AT.items()}
    wind = np.sqrt(of['wind_x'] ** 2 + of['wind_y'] ** 2 + of['wind_z'] ** 2)
    aero = setup.aero or setup.disc.aero
    most_damped = min(float(of['C_Lp'].min()), float(of['C_Mq'].min()))
    arrays: dict[str, Any] = {
        'I_x': of['inertia_diametral'],
        'I_z': of['inertia_axial'],
        'rho': of['air_density'],
    }
    plant = setup.plant._replace(C_Lp=most_damped, C_Mq=most_damped, **arrays)
    steepest = setup.disc.steepest_moment(aero) * float(of['pitching_factor'].max())
    spin, V = of['spin'], of['speed'] + wind
    fastest = np.maximum.reduce(flight.rates(spin, V, plant, steepest))
    good = setup.step * fastest <= STABLE
    if not good.all():
        i = int(np.argmin(good))
        allowed = (
            f'flight {i}, at spin {spin[i]:g} rad/s and {V[i]:g} m/s through the air, needs at '
            f'most {STABLE / fastest[i]:.3g} s'
        )
        raise ConfigError('step', setup.step, allowed)


def _defaults(setup: Setup, control: Control) -> dict[str, float]:
    """Return what each of NAMES is where it is not given."""
    release = Launch()
    wind = (axes.map_from_paper(setup.wind.mean) + 0.0).tolist()
    plant = setup.plant
    other = [*wind, control.C_L, control.C_M, control.C_N]
    other += [plant.m, plant.I_z, plant.I_x, plant.C_Lp, plant.C_Mq, plant.C_Nr, plant.rho]
    other += [plant.g, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    values = [*(getattr(release, name) for name in LIMITS), *other]
    return dict(zip(NAMES, values, strict=True))


def _seeds(seeds: ArrayLike, n: int) -> IntArray:
    found = np.asarray(seeds)
    if found.dtype.kind not in 'iu' or found.shape not in {(), (n,)} or (found < 0).any():
        raise ConfigError('seeds', seeds, f'give whole numbers from 0, one or {n} of them')
    return np.broadcast_to(found.astype(np.int64), (n,))
