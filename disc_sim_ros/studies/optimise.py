"""Search of the launch with the best range, time of flight or accuracy, also under scatter."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
import inspect
import math
from typing import Any

import numpy as np

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.ensemble import Landings, fly_many
from disc_sim_ros.physics.kernels.integrator import LOST
from disc_sim_ros.quantities import STUDY
from disc_sim_ros.studies import sampling
from disc_sim_ros.studies.columns import ADVANCE_RATIO, LAUNCH, quantity
from disc_sim_ros.studies.flying import kernel_values
from disc_sim_ros.studies.scatter import Normal, quantiles
from disc_sim_ros.studies.study import Study

RANGE, TIME, ACCURACY = 'range', 'time', 'accuracy'
GOALS = (RANGE, TIME, ACCURACY)
_WORST = 1e6  # m, distance of a flight that was lost
_POPULATION = 12  # launches per free quantity
_GENERATIONS, _TOLERANCE = 150, 1e-5  # of the global search
_FEW = 16  # samples of the scatter in the global search
_GENERATIONS_OF_SCATTER, _TOLERANCE_OF_SCATTER = 60, 1e-3  # of the global search
_ON_LINES = 128  # samples of the scatter along the lines through the optimum


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A goal, the free quantities with their limits, and everything that is fixed.

    Attributes:
        study: The fixed quantities, and the scatter of throws around each launch: only `Normal`
            without a mean, `count` samples, no grid.
        limits: Least and greatest value of each free quantity.
        goal: 'range', 'time' or 'accuracy'.
        target: x, y in `map` [m], for accuracy.
        percentile: Percentile of the results to optimise instead of their mean, or None. With 10,
            nine of ten throws exceed the range, or one of ten is closer to the target.

    Raises:
        ConfigError: A value is out of range, or two of them contradict each other.
    """

    study: Study
    limits: Mapping[str, tuple[float, float]]
    goal: str = RANGE
    target: tuple[float, float] | None = None
    percentile: float | None = None

    def __post_init__(self) -> None:
        validation.choice('goal', self.goal, GOALS)
        if (self.goal == ACCURACY) != (self.target is not None):
            text = 'accuracy needs a target' if self.target is None else 'only accuracy takes one'
            raise ConfigError('target', self.target, text)
        if not self.limits:
            raise ConfigError('limits', {}, 'at least one quantity must be free')
        for name, (low, high) in self.limits.items():
            if name not in {*LAUNCH, ADVANCE_RATIO}:
                allowed = f'free may be {", ".join(LAUNCH)} and {ADVANCE_RATIO}'
                raise ConfigError(f'limits {name}', 'free', allowed)
            lowest, highest = self.study.bounds(quantity('limits', name).name)
            if not lowest <= low < high <= highest:
                allowed = f'from {lowest:g} to {highest:g}, the lower limit first'
                raise ConfigError(f'limits {name}', [low, high], allowed)
        for name, law in self.study.scatter.items():
            if not isinstance(law, Normal) or law.mean is not None:
                raise ConfigError(f'scatter {name}', str(law), 'give a standard deviation only')
        if self.percentile is not None:
            STUDY['percentile'].check(self.percentile)
            if not self.scatters:
                raise ConfigError('percentile', self.percentile, 'no quantity scatters')
        if 'spin' in self.limits and self.study.advance_ratio is not None:
            raise ConfigError('limits spin', 'free', 'the advance ratio determines it')

    @property
    def free(self) -> tuple[str, ...]:
        """Return the names of the free quantities."""
        return tuple(self.limits)

    @property
    def scatters(self) -> bool:
        """Return True if throws of one launch differ."""
        return bool(self.study.scatter) or self.study.gusts_differ

    @cached_property
    def fixed_target(self) -> tuple[float, float]:
        """Return the target, or the origin without a target."""
        return self.target or (0.0, 0.0)

    def landings(self, launches: FloatArray, samples: int) -> Landings:
        """Fly several throws of each launch.

        Args:
            launches: Values of the free quantities, shape (n, free).
            samples: Throws of each launch; each launch has the same scatter.

        Returns:
            n x samples flights, all throws of a launch one after the other.
        """
        study = self.study
        n = len(launches)
        values: dict[str, FloatArray] = {
            name: np.repeat(launches[:, j], samples) for j, name in enumerate(self.free)
        }
        if study.scatter:
            scores = np.tile(study.scores(0, samples), (n, 1))
            for j, (name, law) in enumerate(study.scatter.items()):
                centre = values.get(name, study.fixed(name))
                values[name] = quantiles(law, scores[:, j], centre, *study.bounds(name))
        seeds = study.gust_seeds(0, samples)
        return fly_many(
            kernel_values(study, values),
            study.setup,
            control=study.control,
            seeds=None if seeds is None else np.tile(seeds, n),
            duration=study.duration,
        )

    def results(self, ended: Landings) -> FloatArray:
        """Return the result of each flight: range [m], time [s] or distance to the target [m]."""
        if self.goal == ACCURACY:
            x, y = self.fixed_target
            distance = np.hypot(ended.x - x, ended.y - y)
            return np.where(ended.status == LOST, _WORST, distance)
        result = ended.range if self.goal == RANGE else ended.time
        return np.where(ended.status == LOST, 0.0, result)

    def values(self, launches: FloatArray, samples: int) -> FloatArray:
        """Return the mean or the percentile of the results of each launch, shape (n,)."""
        samples = samples if self.scatters else 1
        results = self.results(self.landings(launches, samples)).reshape(len(launches), samples)
        if self.percentile is None:
            mean: FloatArray = results.mean(axis=1)
            return mean
        percentile: FloatArray = np.percentile(results, self.percentile, axis=1)
        return percentile


@dataclass(frozen=True)
class Optimum:
    """The best launch of a search.

    Attributes:
        problem: The problem.
        launch: Values of the free quantities, rounded as in the command that repeats the flight.
        value: Mean or percentile of the results of all samples.
        results: Results of the samples, shape (samples,).
        flat: For each free quantity, the range around the optimum in which the value stays within
            `slack` while the others do not change.
        at_limit: Free quantities whose optimum is at a limit.
        launches: Number of launches that the search evaluated.
    """

    problem: Problem
    launch: dict[str, float]
    value: float
    results: FloatArray
    flat: dict[str, tuple[float, float]]
    at_limit: tuple[str, ...]
    launches: int

    @property
    def slack(self) -> float:
        """Return the greatest loss that counts as flat: 1 %, but for accuracy at least 5 cm."""
        return slack(self.problem, self.value)

    @property
    def study(self) -> Study:
        """Return the study of throws with this launch."""
        return at(self.problem.study, self.launch)


def optimise(problem: Problem, seed: int = 0) -> Optimum:
    """Return the best launch: differential evolution over the limits, then a simplex search.

    The same problem and seed give the same launch. Differential evolution may miss a narrow
    optimum; repeat the search with another seed to check.

    Args:
        problem: The problem.
        seed: Seed of the search.

    Source: Storn & Price, J. of Global Optimization 11 (1997) 341-359; Nelder & Mead, Computer J.
    7 (1965) 308-313; both as implemented in scipy.
    """
    sign = 1.0 if problem.goal == ACCURACY else -1.0
    from scipy import optimize  # noqa: PLC0415 - 0.2 s, which --help need not wait for

    low, high = np.array(list(problem.limits.values())).T
    samples = problem.study.count
    evaluated = 0

    def cost(unit: FloatArray, few: int) -> FloatArray:
        nonlocal evaluated
        evaluated += len(unit)
        return sign * problem.values(low + np.clip(unit, 0.0, 1.0) * (high - low), few)

    sampling.load_sobol()
    best = optimize.differential_evolution(
        lambda x: cost(x.T if x.ndim > 1 else x[None], min(samples, _FEW)),
        [(0.0, 1.0)] * len(low),
        vectorized=True,
        updating='deferred',
        init='sobol',
        popsize=_POPULATION,
        maxiter=_GENERATIONS_OF_SCATTER if problem.scatters else _GENERATIONS,
        tol=_TOLERANCE_OF_SCATTER if problem.scatters else _TOLERANCE,
        polish=False,
        **_seeded(optimize.differential_evolution, seed),
    ).x
    for width in (0.05, 0.005):  # twice, because a simplex can collapse
        simplex = np.clip(best + width * np.vstack([np.zeros(len(low)), np.eye(len(low))]), 0, 1)
        turned = np.where(best + width > 1.0, best - width, simplex.max(axis=0))
        for j in range(len(low)):
            simplex[j + 1, j] = turned[j]
        best = optimize.minimize(
            lambda x: cost(x[None], samples)[0],
            best,
            method='Nelder-Mead',
            bounds=[(0.0, 1.0)] * len(low),
            options={'initial_simplex': simplex, 'xatol': 1e-5, 'fatol': 1e-7, 'maxfev': 200},
        ).x
    launch = {
        name: _rounded(value, *problem.limits[name])
        for name, value in zip(problem.free, low + best * (high - low), strict=True)
    }
    return _described(problem, launch, evaluated)


def at(study: Study, launch: Mapping[str, float]) -> Study:
    """Return a study with another launch: fields of Launch, or an advance ratio."""
    fields = {name: value for name, value in launch.items() if name in LAUNCH}
    ratio = launch.get(ADVANCE_RATIO, study.advance_ratio)
    return replace(study, launch=replace(study.launch, **fields), advance_ratio=ratio)


def slack(problem: Problem, value: float) -> float:
    """Return the loss against `value` that still counts as flat."""
    return max(0.01 * value, 0.05) if problem.goal == ACCURACY else 0.01 * value


def lines(
    problem: Problem, launch: Mapping[str, float], points: int = 161
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return x and value along each free quantity, with the others as in `launch`."""
    curves = {}
    centre = np.array([launch[name] for name in problem.free])
    for j, (name, (low, high)) in enumerate(problem.limits.items()):
        x = np.unique(np.append(np.linspace(low, high, points), centre[j]))
        launches = np.tile(centre, (len(x), 1))
        launches[:, j] = x
        samples = min(problem.study.count, _ON_LINES)
        curves[name] = (x, problem.values(launches, samples))
    return curves


def _described(problem: Problem, launch: dict[str, float], evaluated: int) -> Optimum:
    centre = np.array([[launch[name] for name in problem.free]])
    samples = problem.study.count if problem.scatters else 1
    results = problem.results(problem.landings(centre, samples))
    value = float(problem.values(centre, samples)[0])
    flat = {}
    sign = 1.0 if problem.goal == ACCURACY else -1.0
    for name, (x, values) in lines(problem, launch).items():
        place = int(np.searchsorted(x, launch[name]))
        good = sign * (values - values[place]) <= slack(problem, abs(float(values[place])))
        below = np.flatnonzero(~good[:place])
        above = np.flatnonzero(~good[place:])
        first = int(below[-1]) + 1 if len(below) else 0
        last = place + int(above[0]) - 1 if len(above) else len(x) - 1
        flat[name] = (float(x[first]), float(x[last]))
    at_limit = tuple(
        name
        for name, (low, high) in problem.limits.items()
        if min(launch[name] - low, high - launch[name]) <= 1e-3 * (high - low)
    )
    return Optimum(problem, launch, value, results, flat, at_limit, evaluated)


def _rounded(value: float, low: float, high: float) -> float:
    """Return a value rounded to 1e-4 of its limits or finer, within the limits."""
    digits = max(0, 4 - math.floor(math.log10(high - low)))
    return float(min(max(round(float(value), digits), low), high))


def _seeded(search: Callable[..., Any], seed: int) -> dict[str, Any]:
    """Return the seed as the argument that a search of the installed scipy takes."""
    known = inspect.signature(search).parameters
    return {'rng' if 'rng' in known else 'seed': np.random.default_rng(seed)}


HUMAN_LIMITS = {
    'speed': (5.0, 25.0),  # m/s
    'pitch': (-20.0, 60.0),  # degrees
    'roll': (-60.0, 60.0),  # degrees
    'spin': (10.0, 70.0),  # rad/s
}
# Standard deviations of a practised thrower, in the same units.
HUMAN_SCATTER = {'speed': 0.5, 'pitch': 1.5, 'roll': 2.0, 'yaw': 1.5, 'spin': 3.0}
