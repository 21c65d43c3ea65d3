"""Fit the release of a throw for given shared parameters, from one first state or from several.

Fits from several states go on side by side: their flights are computed together, and WIDTH
of them take as long as one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification.normal_equations import costs_of, solved, weights
from disc_sim_ros.estimation.identification.problem import Problem, whitened_together
from disc_sim_ros.physics.kernels.simd import WIDTH

SMALL = 1e-3  # decrease of the cost, in half squares of a standard deviation, that ends a search
MOST_TRIES = 8  # of a step with more and more damping
_MOST_STEPS = 8
_FIRST_DAMPING, _LEAST_DAMPING = 1e-4, 1e-6


def fit_release(
    problem: Problem, k: int, here: FloatArray, most_steps: int = _MOST_STEPS
) -> tuple[FloatArray, float]:
    """Fit the release of throw `k` for given shared parameters.

    Args:
        problem: The problem.
        k: Number of the throw.
        here: The shared parameters and a first release, shape (shared + 12,).
        most_steps: Gauss-Newton steps after which to end.

    Returns:
        The same with the fitted release, and the cost of the throw.
    """
    (fitted,) = fit_releases([problem], k, [here], most_steps)
    return fitted


def fit_releases(
    problems: Sequence[Problem],
    k: int,
    first: Sequence[FloatArray],
    most_steps: int = _MOST_STEPS,
) -> list[tuple[FloatArray, float]]:
    """Fit the release of throw `k` from several first releases; see `fit_release`.

    Args:
        problems: One for each fit. They differ in the first state of the throw alone; all are
            flown in the shortest of their steps.
        k: Number of the throw.
        first: The shared parameters and a first release of each, shape (shared + 12,).
        most_steps: Gauss-Newton steps after which to end.
    """
    fits = [_Fit(problem, k, here) for problem, here in zip(problems, first, strict=True)]
    finest = min(problems, key=lambda problem: problem.step)
    going = fits
    for _ in range(most_steps):
        _linearise(finest, going, k)
        going = [fit for fit in going if fit.promised() >= SMALL]
        if not going:
            break
        before = [fit.cost for fit in going]
        _step(finest, going, k)
        going = [fit for fit, cost in zip(going, before, strict=True) if cost - fit.cost >= SMALL]
        if not going:
            break
    return [(fit.here, fit.cost) for fit in fits]


@dataclass(eq=False)
class _Fit:
    """The fit of a release, as far as it has come.

    Attributes:
        problem: With changes of the release counted from the start of the throw.
        k: Number of the throw.
        here: The shared parameters and the release, shape (shared + 12,).
        cost: Of the throw there.
        normal: Normal equations of the release there, shape (12, 12).
        gradient: Of the cost by the release, shape (12,).
        damping: Of the next step.
    """

    problem: Problem
    k: int
    here: FloatArray
    cost: float = math.inf
    normal: FloatArray = field(default_factory=lambda: np.empty(0))
    gradient: FloatArray = field(default_factory=lambda: np.empty(0))
    damping: float = _FIRST_DAMPING

    def linearise(self, r: FloatArray, slopes: FloatArray) -> None:
        """Take residuals, shape (m,), and derivatives by the release, shape (m, 12)."""
        root = self.problem.throws[self.k].information
        prior = self.problem.release_priors(self.k, self.here[self.problem.shared :])
        weighted = weights(r)[:, np.newaxis] * slopes
        self.normal = slopes.T @ weighted + root.T @ root
        self.gradient = weighted.T @ r + root.T @ prior
        self.cost = float(costs_of(self.problem, self.k, self.here[np.newaxis], r[np.newaxis])[0])

    def promised(self) -> float:
        """Return the decrease of the cost that a step without damping promises."""
        return -0.5 * float(self.gradient @ solved(self.normal, -self.gradient, np.zeros(1))[0])

    def tried(self, dampings: FloatArray) -> FloatArray:
        """Return where steps with these dampings end, shape (m, shared + 12)."""
        places = np.tile(self.here, (len(dampings), 1))
        places[:, self.problem.shared :] += solved(self.normal, -self.gradient, dampings)
        return places

    def take(self, dampings: FloatArray, places: FloatArray, r: FloatArray) -> bool:
        """Go to the first place that is better, with residuals `r`; return False if none is."""
        costs = costs_of(self.problem, self.k, places, r)
        for damping, place, cost in zip(dampings.tolist(), places, costs.tolist(), strict=True):
            if cost < self.cost:
                self.here, self.cost, self.damping = place.copy(), cost, damping * 0.1
                return True
            self.damping = _more(damping)
        return False


def _linearise(finest: Problem, fits: Sequence[_Fit], k: int) -> None:
    """Compute the normal equations of each fit."""
    batches = [fit.problem.neighbours(fit.here, release_only=True) for fit in fits]
    residuals = whitened_together(
        finest, [fit.problem for fit in fits], k, [batch.parameters for batch in batches]
    )
    for fit, batch, r in zip(fits, batches, residuals, strict=True):
        fit.linearise(*batch.slopes(r))


def _step(finest: Problem, fits: Sequence[_Fit], k: int) -> None:
    """Do one step of each fit, with as much damping as it takes to make it better.

    As many tries of each are flown at once as take no longer than one of each, and where none of
    these does, all others.
    """
    at_once = max(WIDTH // max(len(fits), 1), 1)
    for tries in (min(at_once, MOST_TRIES), MOST_TRIES - at_once):
        if not fits or tries < 1:
            break
        dampings = [_dampings(fit.damping, tries) for fit in fits]
        places = [fit.tried(d) for fit, d in zip(fits, dampings, strict=True)]
        residuals = whitened_together(finest, [fit.problem for fit in fits], k, places)
        fits = [
            fit
            for fit, d, p, r in zip(fits, dampings, places, residuals, strict=True)
            if not fit.take(d, p, r)
        ]


def _dampings(first: float, count: int) -> FloatArray:
    """Return a damping and larger ones, shape (count,)."""
    dampings = [first]
    while len(dampings) < count:
        dampings.append(_more(dampings[-1]))
    return np.array(dampings)


def _more(damping: float) -> float:
    return max(damping * 10.0, _LEAST_DAMPING)
