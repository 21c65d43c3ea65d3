"""What measurements tell: the information matrix, standard errors, and what they leave open."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification.coefficients import NAMES
from disc_sim_ros.estimation.identification.normal_equations import weights
from disc_sim_ros.estimation.identification.problem import Problem

_BY_CHANCE = 3.0  # standard deviations of a correlation that white noise exceeds in 1 of 700 fits
# Samples over which correlations are looked for, and the chi squared of so many degrees of freedom
# that 1 of 700 exceeds (test/estimation/test_graduated.py).
LAGS, CHI_SQUARED = 10, 28.6
_CORRELATED = 0.3  # of neighbouring residuals, from which on standard errors are widened


@dataclass(frozen=True)
class Unidentifiable:
    """A coefficient that the throws do not determine.

    Attributes:
        name: The coefficient.
        error: Its standard error from the measurements alone.
        spread: By how much discs of one kind differ, one standard deviation.
        partner: The coefficient with which it is most correlated; empty if it is the only one.
        correlation: With the partner.
    """

    name: str
    error: float
    spread: float
    partner: str
    correlation: float

    @property
    def reason(self) -> str:
        """Return the reason in words."""
        text = (
            f'these throws tell {self.name} to {self.error:.2g}, discs differ by {self.spread:g}'
        )
        if self.partner and abs(self.correlation) > 0.9:
            text += (
                f'; a change of {self.partner} looks alike (correlation {self.correlation:.2f})'
            )
        return text


@dataclass(frozen=True, eq=False)
class Information:
    """Inverse covariances of all parameters at one point.

    Attributes:
        data: Of the measurements, with robust weights, shape (p, p).
        priors: Of what was believed before, shape (p, p).
        widening: Factor on standard errors because residuals are correlated in time, 1 if not.
    """

    data: FloatArray
    priors: FloatArray
    widening: float

    @property
    def fitted(self) -> float:
        """Return how many parameters the measurements determine, rather than the priors."""
        return float(np.trace(self.data @ _inverse(self.data + self.priors)))

    def covariance(self) -> FloatArray:
        """Return the covariance of the parameters, shape (p, p)."""
        return _inverse(self.data / self.widening**2 + self.priors)

    def white_covariance(self) -> FloatArray:
        """Return the covariance as if residuals were not correlated in time, shape (p, p)."""
        return _inverse(self.data + self.priors)


def information(problem: Problem, x: FloatArray) -> Information:
    """Return the information at the parameters `x`."""
    n = problem.shared
    data, priors = np.zeros((problem.size, problem.size)), np.zeros((problem.size, problem.size))
    priors[:n, :n] = np.diag(1.0 / problem.shared_deviations**2)
    for k, throw in enumerate(problem.throws):
        r, slopes = problem.linearised(k, problem.here(k, x))
        places = np.r_[0:n, problem.own(k)]
        data[np.ix_(places, places)] += slopes.T @ (weights(r)[:, np.newaxis] * slopes)
        priors[problem.own(k), problem.own(k)] = throw.information.T @ throw.information
    return Information(data, priors, _widening(problem, x))


@dataclass(frozen=True)
class Correlation:
    """How residuals that follow each other in time are correlated.

    Attributes:
        rho: Correlation of neighbours, mean of all instruments and throws.
        chance: Standard deviation of it for white noise.
        squares: Sum of the squared correlations over 1 to LAGS samples, in squares of their
            standard deviations for white noise (Box and Pierce, 1970). Residuals of a wrong
            minimum swing as the disc turns, so that those of neighbours may cancel.
    """

    rho: float
    chance: float
    squares: float

    @property
    def is_chance(self) -> bool:
        """Return True if white noise gives as much in all but 1 of 700 fits, each of both."""
        return self.rho < _BY_CHANCE * self.chance and self.squares < CHI_SQUARED


def correlation(problem: Problem, x: FloatArray) -> Correlation:
    """Return how residuals that follow each other are correlated at the parameters `x`."""
    whitened = []
    for k, throw in enumerate(problem.throws):
        parts = problem.predictions(k, problem.here(k, x)[np.newaxis])
        whitened += [
            r[0] / problem.noise[o.kind] for o, r in zip(throw.observations, parts, strict=True)
        ]
    return correlation_of(whitened)


def correlation_of(series: Sequence[FloatArray]) -> Correlation:
    """Return how samples that follow each other are correlated.

    Args:
        series: One for each throw and instrument, in standard deviations, each (n, d). Values
            beyond three count as three.
    """
    products, squares, counts = np.zeros((3, LAGS))
    for whole in series:
        values = np.clip(whole, -3.0, 3.0)
        for lag in range(1, min(LAGS, len(values) - 1) + 1):
            later, earlier = values[lag:], values[:-lag]
            products[lag - 1] += float((later * earlier).sum())
            squares[lag - 1] += float((later**2).sum())
            counts[lag - 1] += later.size
    rho = products / np.where(squares > 0.0, squares, np.inf)
    chance = 1.0 / math.sqrt(max(counts[0], 1.0))
    return Correlation(min(float(rho[0]), 0.99), chance, float((rho**2 * counts).sum()))


def _widening(problem: Problem, x: FloatArray) -> float:
    """Return the factor by which correlated residuals widen standard errors.

    Residuals with a correlation rho between neighbours tell as much as (1 - rho) / (1 + rho) of
    their number that are independent (first-order autoregression).
    """
    rho = correlation(problem, x).rho
    return float(np.sqrt((1.0 + rho) / (1.0 - rho))) if rho > _CORRELATED else 1.0


def unidentifiable(problem: Problem, known: Information) -> list[Unidentifiable]:
    """Return the free coefficients that the prior tells better than the measurements, worst first.

    What is believed of releases, wind and camera counts as measured, of coefficients it does not.
    """
    n = len(problem.free)
    priors = known.priors.copy()
    priors[:n, :n] = 0.0
    total = known.data / known.widening**2 + priors
    spread = problem.prior.coefficients[list(problem.free)]
    total[:n, :n] += np.diag(1e-6 / spread**2)  # for what nothing tells at all
    covariance = _inverse(total)[:n, :n]
    errors = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(errors, errors)
    open_ones = []
    for i in np.argsort(-errors / spread, kind='stable'):
        if errors[i] > spread[i]:
            others = np.abs(correlation[i]) - np.eye(n)[i]
            j = int(np.argmax(others))
            partner = NAMES[problem.free[j]] if n > 1 else ''
            open_ones.append(
                Unidentifiable(
                    NAMES[problem.free[int(i)]],
                    float(errors[i]),
                    float(spread[i]),
                    partner,
                    float(correlation[i, j]),
                )
            )
    return open_ones


def without(problem: Problem, names: Sequence[str]) -> tuple[int, ...]:
    """Return the free coefficients without some."""
    return tuple(i for i in problem.free if NAMES[i] not in names)


def _inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse of a positive definite matrix whose parameters have any units."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    inverse: FloatArray = np.linalg.inv(matrix * np.outer(scale, scale)) * np.outer(scale, scale)
    return inverse
