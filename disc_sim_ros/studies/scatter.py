"""How a quantity scatters: its law, its quantiles within hard bounds, and correlations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError

_FAR = 8.5  # standard deviations: beyond is less than one in 1e16


@dataclass(frozen=True, slots=True)
class Normal:
    """A normal law, cut off where the quantity itself ends (a speed at 0).

    Attributes:
        sd: Standard deviation, above 0.
        mean: None for the value that would be flown without scatter.
    """

    sd: float
    mean: float | None = None

    def __post_init__(self) -> None:
        validation.number('standard deviation', self.sd, above=0.0)
        if self.mean is not None:
            validation.number('mean', self.mean)


@dataclass(frozen=True, slots=True)
class Uniform:
    """Every value between `low` and `high` is as likely as another."""

    low: float
    high: float

    def __post_init__(self) -> None:
        validation.number('low', self.low)
        validation.number('high', self.high, above=self.low)


def quantiles(
    law: Normal | Uniform, scores: FloatArray, centre: ArrayLike, lowest: float, highest: float
) -> FloatArray:
    """Return the values of a law that belong to standard normal scores.

    Args:
        law: How the quantity scatters.
        scores: Standard normal numbers, shape (n,).
        centre: Mean of a `Normal` that has none of its own, shape () or (n,).
        lowest: Hard bounds of the quantity; the law is cut off there and keeps its shape inside.
        highest: The other one.
    """
    if isinstance(law, Uniform):
        values: FloatArray = law.low + (law.high - law.low) * ndtr(scores)
        return values
    mean = np.asarray(centre if law.mean is None else law.mean, dtype=float)
    a, b = (lowest - mean) / law.sd, (highest - mean) / law.sd
    if np.any((a > -_FAR) | (b < _FAR)):
        below, above = ndtr(a), ndtr(b)
        scores = ndtri(below + (above - below) * ndtr(scores))
    return np.clip(mean + law.sd * scores, lowest, highest)


def probabilities(
    law: Normal | Uniform, values: FloatArray, centre: float, lowest: float, highest: float
) -> FloatArray:
    """Return the share of a law below each value: what `quantiles` undoes."""
    found: FloatArray
    if isinstance(law, Uniform):
        found = (values - law.low) / (law.high - law.low)
        return found
    mean = centre if law.mean is None else law.mean
    below, above = ndtr([(lowest - mean) / law.sd, (highest - mean) / law.sd])
    found = (ndtr((values - mean) / law.sd) - below) / (above - below)
    return found


def correlation_factor(
    names: Sequence[str], correlations: Mapping[tuple[str, str], float]
) -> FloatArray:
    """Return L with L L^T = the correlation matrix of `names`, shape (n, n), lower triangular.

    Raises:
        ConfigError: A name that is not there, a pair twice, or a matrix that no scatter has.
    """
    matrix = np.eye(len(names))
    for (a, b), value in correlations.items():
        for name in (a, b):
            if name not in names:
                allowed = f'only what scatters is correlated: {", ".join(names) or "nothing"}'
                raise ConfigError('correlation', name, allowed)
        i, j = names.index(a), names.index(b)
        if i == j:
            raise ConfigError('correlation', f'{a},{b}', 'give two different names')
        if matrix[i, j] != 0.0:
            raise ConfigError('correlation', f'{a},{b}', 'the pair is given twice')
        matrix[i, j] = matrix[j, i] = validation.number(f'correlation {a},{b}', value, -1.0, 1.0)
    try:
        return np.asarray(np.linalg.cholesky(matrix), dtype=float)
    except np.linalg.LinAlgError:
        text = ', '.join(f'{a},{b}={r:g}' for (a, b), r in correlations.items())
        allowed = 'no quantities can be correlated so; give smaller correlations'
        raise ConfigError('correlation', text, allowed) from None
