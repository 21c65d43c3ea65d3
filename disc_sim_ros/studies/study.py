"""A study: an ensemble of flights, the quantities that differ between them, and their law."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros import __version__, validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError, brief
from disc_sim_ros.physics import disc_file, flight, frames, theory
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.quantities import DURATION, LARGEST_SEED, STUDY
from disc_sim_ros.studies import sampling
from disc_sim_ros.studies.columns import (
    ADVANCE_RATIO,
    CONTROL,
    LAUNCH,
    WIND,
    fixed_property,
    quantity,
)
from disc_sim_ros.studies.scatter import Normal, Uniform, correlation_factor, quantiles
from disc_sim_ros.validation import Quantity

EACH, SAME = 'each', 'same'
GUSTS = (EACH, SAME)
MOST_FLIGHTS = 10**9


@dataclass(frozen=True, kw_only=True)
class Study:
    """Flights at every point of a grid, each with `count` samples of scatter.

    Flight i is sample i mod count at grid point i div count; the last name of `vary` changes
    fastest. Sample k is the same at every grid point, so that differences between grid points are
    not caused by the scatter.

    Attributes:
        setup: Disc, model, air, wind and step.
        launch: The release, for quantities that neither vary nor scatter.
        control: Control inputs, likewise; coefficients only.
        advance_ratio: Spin of each flight as r c / (2 V), instead of `launch.spin`; or None.
        vary: Values of each grid quantity; names as in `quantities.VARIED`.
        scatter: The law of each scattered quantity. A grid quantity may scatter too: by a
            `Normal` without a mean, around each value of the grid.
        correlations: Correlation of pairs of scattered quantities, from -1 to 1; of uniform
            quantities, that of their normal scores. Pairs without an entry are uncorrelated.
        count: Samples at each grid point.
        seed: Seed of the scatter. The seed of the gusts is `setup.wind.seed`.
        sampling: 'random' or 'sobol'.
        gusts: 'each': sample k flies in the gusts of seed `setup.wind.seed` + k; 'same': all
            flights fly in the gusts of seed `setup.wind.seed`.
        duration: Longest time of flight [s].
        ground: True to end a flight where the centre or the rim of the disc crosses z = 0.

    Raises:
        ConfigError: A value is out of range, or two of them contradict each other.
    """

    setup: flight.Setup
    launch: Launch = field(default_factory=Launch)
    control: Control = flight.NO_CONTROL
    advance_ratio: float | None = None
    vary: Mapping[str, Sequence[float]] = field(default_factory=dict)
    scatter: Mapping[str, Normal | Uniform] = field(default_factory=dict)
    correlations: Mapping[tuple[str, str], float] = field(default_factory=dict)
    count: int = STUDY['count'].default
    seed: int = STUDY['scatter_seed'].default
    sampling: str = sampling.RANDOM
    gusts: str = EACH
    duration: float = DURATION.default
    ground: bool = True

    def __post_init__(self) -> None:
        STUDY['count'].check(self.count)
        STUDY['scatter_seed'].check(self.seed, 'seed')
        validation.choice('sampling', self.sampling, sampling.METHODS)
        validation.choice('gusts', self.gusts, GUSTS)
        self._check_names()
        self._check_kinds()
        if self.size > MOST_FLIGHTS:
            raise ConfigError('count', self.size, f'at most {MOST_FLIGHTS} flights in total')
        _ = self._factor
        self._check_extremes()

    @cached_property
    def varied(self) -> tuple[Quantity, ...]:
        """Return the grid quantities, followed by those that only scatter."""
        names = dict.fromkeys([*self.vary, *self.scatter])
        return tuple(quantity('name', name) for name in names)

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Return the number of values of each grid quantity."""
        return tuple(len(values) for values in self.vary.values())

    @property
    def points(self) -> int:
        """Return the number of grid points; 1 without a grid."""
        return math.prod(self.shape)

    @property
    def size(self) -> int:
        """Return the number of flights."""
        return self.points * self.count

    @property
    def gusts_differ(self) -> bool:
        """Return True if each sample flies in gusts of its own."""
        return self.setup.wind.turbulence > 0.0 and self.gusts == EACH

    def values(self, start: int, stop: int) -> dict[str, FloatArray]:
        """Return the values that differ, of flights `start` to `stop`, by name; shape (n,)."""
        index = np.arange(start, stop)
        columns: dict[str, FloatArray] = {}
        if self.vary:
            places = np.unravel_index(index // self.count, self.shape)
            for (name, values), place in zip(self.vary.items(), places, strict=True):
                columns[name] = np.asarray(values, dtype=float)[place]
        if self.scatter:
            scores = self._scores_of(index % self.count)
            for j, (name, law) in enumerate(self.scatter.items()):
                centre = columns.get(name, self.fixed(name))
                lowest, highest = self.bounds(name)
                columns[name] = quantiles(law, scores[:, j], centre, lowest, highest)
        return columns

    def scores(self, start: int, stop: int) -> FloatArray:
        """Return the standard normal scores of samples, shape (stop - start, scattered)."""
        from scipy.special import ndtri  # noqa: PLC0415 - as in `scatter`

        unit = sampling.unit_samples(
            self.sampling, len(self.scatter), self.seed, start, stop, count=self.count
        )
        scores: FloatArray = ndtri(unit)
        if not self.correlations:
            return scores
        # Not a matrix product: its last bit would depend on the number of rows.
        mixed = np.zeros_like(scores)
        for i, row in enumerate(self._factor):
            for j in range(i + 1):
                mixed[:, i] += row[j] * scores[:, j]
        return mixed

    def gust_seeds(self, start: int, stop: int) -> NDArray[np.int64] | None:
        """Return the seeds of the gusts of flights `start` to `stop`; None if all are the same.

        `fly --seed` with one of them flies in the same gusts.
        """
        if not self.gusts_differ:
            return None
        return self.setup.wind.seed + np.arange(start, stop) % self.count

    def fixed(self, name: str) -> float:
        """Return the value of a quantity that neither varies nor scatters."""
        if name in LAUNCH:
            return float(getattr(self.launch, name))
        if name in WIND:
            return float(frames.map_from_paper(self.setup.wind.mean)[WIND.index(name)])
        if name in CONTROL:
            return float(self.control[CONTROL.index(name)])
        if name == ADVANCE_RATIO:
            return self.advance_ratio or 0.0
        return fixed_property(self.setup, name)

    def bounds(self, name: str) -> tuple[float, float]:
        """Return the least and the greatest value that a quantity may have in a flight."""
        q = quantity('name', name)
        return (0.0 if name == 'height' and self.ground else q.lowest), q.highest

    @cached_property
    def _factor(self) -> FloatArray:
        return correlation_factor(tuple(self.scatter), self.correlations)

    def _scores_of(self, sample: NDArray[np.int64]) -> FloatArray:
        """Return the scores of runs of ascending samples, shape (n, scattered)."""
        turns = np.flatnonzero(np.diff(sample) < 0) + 1
        if len(turns) > 1:  # every sample occurs
            return self.scores(0, self.count)[sample]
        runs = [run for run in np.split(sample, turns) if len(run)]
        return np.concatenate([self.scores(int(run[0]), int(run[-1]) + 1) for run in runs])

    def _check_names(self) -> None:
        for thing, given in (('vary', list(self.vary)), ('scatter', list(self.scatter))):
            for name in given:
                if quantity(thing, name).name != name:
                    raise ConfigError(thing, name, f'its name is {quantity(thing, name).name}')
        both = [n for n in self.vary if n in self.scatter and not _is_around(self.scatter[n])]
        if both:
            allowed = 'it is varied already; give its scatter as a standard deviation only'
            raise ConfigError('scatter', both[0], allowed)
        names = {q.name for q in self.varied}
        if 'spin' in names and (ADVANCE_RATIO in names or self.advance_ratio is not None):
            raise ConfigError('spin', ADVANCE_RATIO, 'one determines the other; give one')
        for name, values in self.vary.items():
            if not len(values):
                raise ConfigError(f'vary {name}', [], 'give at least one value')
            if len(set(values)) < len(values):
                raise ConfigError(f'vary {name}', list(values), 'a value occurs twice')

    def _check_kinds(self) -> None:
        if self.sampling == sampling.SOBOL and not self.scatter:
            raise ConfigError('sampling', 'sobol', 'no quantity scatters; give one that does')
        if self.count > 1 and not self.scatter and not self.gusts_differ:
            allowed = 'all samples would be the same; give a scatter, or gusts that differ'
            raise ConfigError('count', self.count, allowed)
        if self.gusts_differ and self.setup.wind.seed + self.count > LARGEST_SEED:
            allowed = f'seed + count is at most {LARGEST_SEED}'
            raise ConfigError('seed', self.setup.wind.seed, allowed)

    @cached_property
    def fastest_spin(self) -> float:
        """Return the greatest spin of any flight [rad/s]; normal scatter counts to 6 sd."""
        ratio = self.largest(ADVANCE_RATIO)
        if ratio == 0.0:
            return self.largest('spin')
        return theory.spin_rate(ratio, self.setup.disc.diameter, self.largest('speed'))

    def largest(self, name: str) -> float:
        """Return the greatest amount of a quantity in any flight; normal scatter to 6 sd."""
        return max(abs(x) for x in self._ends(quantity('name', name)))

    def _check_extremes(self) -> None:
        """Refuse values out of range, and a step that is too long for the fastest spin."""
        for q in self.varied:
            self._ends(q)
        spin = quantity('name', 'spin').within(0.0).check(self.fastest_spin)
        height = min(self._ends(quantity('name', 'height')))
        flight.check_flight(
            replace(self.launch, spin=spin, speed=self.largest('speed'), height=height),
            self.setup,
            self.duration,
            ground=self.ground,
            sample_rate=0.0,
        )
        flight.checked_control(self.control)

    def _ends(self, q: Quantity) -> tuple[float, ...]:
        """Return the values between which a quantity lies; normal scatter counts to 6 sd."""
        lowest, highest = self.bounds(q.name)
        values = [
            validation.number(f'vary {q.name}', x, lowest, highest, unit=q.unit)
            for x in self.vary.get(q.name, ())
        ]
        law = self.scatter.get(q.name)
        if isinstance(law, Uniform):
            ends = (law.low, law.high)
            thing = f'uniform {q.name}'
            values += [validation.number(thing, x, lowest, highest, unit=q.unit) for x in ends]
        elif law is not None:
            centres = values or [self.fixed(q.name) if law.mean is None else law.mean]
            values = []
            for centre in (min(centres), max(centres)):
                validation.number(f'mean of {q.name}', centre, lowest, highest, unit=q.unit)
                values += [max(centre - 6 * law.sd, lowest), min(centre + 6 * law.sd, highest)]
        return tuple(values) or (self.fixed(q.name),)


def _is_around(law: Normal | Uniform) -> bool:
    return isinstance(law, Normal) and law.mean is None


def study_document(study: Study) -> dict[str, Any]:
    """Return everything that determines the flights of a study, as values for JSON.

    Angles are in degrees, all other quantities in SI units; the disc has the keys of a disc file;
    the wind is the velocity of the air in `map` axes.
    """
    setup = study.setup
    names = (*LAUNCH, *WIND, *CONTROL)
    fixed = {name: study.fixed(name) for name in names}
    if study.advance_ratio is not None or ADVANCE_RATIO in study.vary:
        fixed[ADVANCE_RATIO] = study.fixed(ADVANCE_RATIO)
        del fixed['spin']
    return {
        'version': __version__,
        'disc': setup.disc.name,
        'disc_file': disc_file.disc_document(setup.disc),
        'model': setup.model,
        'aero': setup.aero or setup.disc.aero,
        'moment_axes': setup.moment_axes,
        'air_density': setup.air.density,
        'gravity': setup.air.gravity,
        'roughness_length': setup.wind.roughness_length,
        'reference_height': setup.wind.reference_height,
        'turbulence': setup.wind.turbulence,
        'gust_seed': setup.wind.seed,
        'gust_seeds': study.gusts,
        'step': setup.step,
        'duration': study.duration,
        'ground': study.ground,
        'ground_contact': setup.lands_on,
        'fixed': fixed,
        'vary': {name: [float(x) for x in values] for name, values in study.vary.items()},
        'scatter': {
            name: {'normal': [law.mean, law.sd]}
            if isinstance(law, Normal)
            else {'uniform': [law.low, law.high]}
            for name, law in study.scatter.items()
        },
        'correlations': {f'{a},{b}': r for (a, b), r in study.correlations.items()},
        'count': study.count,
        'seed': study.seed,
        'sampling': study.sampling,
    }


def study_differences(
    old: Mapping[str, Any], new: Mapping[str, Any], prefix: str = ''
) -> list[str]:
    """Return the differences between two documents, each as 'name OLD, now NEW'."""
    differences: list[str] = []
    for key in dict.fromkeys([*old, *new]):
        before, after = old.get(key), new.get(key)
        if isinstance(before, dict) and isinstance(after, dict):
            within = '' if key == 'fixed' else f'{key} '
            differences += study_differences(before, after, f'{prefix}{within}')
        elif before != after:
            differences.append(f'{prefix}{key} {_shown(before)}, now {_shown(after)}')
    return differences


def _shown(value: object) -> str:
    return 'not given' if value is None else brief(value)
