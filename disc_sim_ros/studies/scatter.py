"""Laws of scatter: normal and uniform, their quantiles within hard bounds, and correlations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError

_FAR = 8.5  # standard deviations: less than one in 1e16 samples lies beyond


@dataclass(frozen=True, slots=True)
class Normal:
    """A normal law, truncated at the bounds of the quantity (a speed at 0).

    Attributes:
        sd: Standard deviation, above 0.
        mean: Mean; None for the value that the quantity has without scatter.
    """

    sd: float
    mean: float | None = None

    def __post_init__(self) -> None:
        validation.number('standard deviation', self.sd, above=0.0)
        if self.mean is not None:
            validation.number('mean', self.mean)


@dataclass(frozen=True, slots=True)
class Uniform:
    """A uniform law: all values between `low` and `high` are equally likely."""

    low: float
    high: float

    def __post_init__(self) -> None:
        validation.number('low', self.low)
        validation.number('high', self.high, above=self.low)


def quantiles(
    law: Normal | Uniform, scores: FloatArray, centre: ArrayLike, lowest: float, highest: float
) -> FloatArray:
    """Return the values of a law at standard normal scores, shape (n,).

    Args:
        law: The law of the quantity.
        scores: Standard normal scores, shape (n,).
        centre: Mean of a `Normal` without a mean, shape () or (n,).
        lowest: Lower bound of the quantity; a normal law is truncated there.
        highest: Upper bound, likewise.
    """
    from scipy.special import ndtr, ndtri  # noqa: PLC0415 - 0.1 s, which --help need not wait for

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
    """Return the cumulative probability of each value: the inverse of `quantiles`."""
    below_value: FloatArray
    if isinstance(law, Uniform):
        below_value = (values - law.low) / (law.high - law.low)
        return below_value
    from scipy.special import ndtr  # noqa: PLC0415 - as above

    mean = centre if law.mean is None else law.mean
    below, above = ndtr([(lowest - mean) / law.sd, (highest - mean) / law.sd])
    below_value = (ndtr((values - mean) / law.sd) - below) / (above - below)
    return below_value


def correlation_factor(
    names: Sequence[str], correlations: Mapping[tuple[str, str], float]
) -> FloatArray:
    """Return the Cholesky factor of the correlation matrix of `names`, shape (n, n).

    Raises:
        ConfigError: An unknown name, a pair given twice, or a matrix that is not positive
            definite.
    """
    matrix = np.eye(len(names))
    for (a, b), value in correlations.items():
        for name in (a, b):
            if name not in names:
                allowed = f'only scattered quantities are correlated: {", ".join(names) or "none"}'
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
        allowed = 'the matrix is not positive definite; give smaller correlations'
        raise ConfigError('correlation', text, allowed) from None
