"""The cost of fitted throws, and its normal equations."""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification.problem import Problem
from disc_sim_ros.threads import Threads

_CORNER = 2.5  # standard deviations at which the loss of a residual turns from square to straight
_T = TypeVar('_T')


def robust_loss(residuals: FloatArray) -> FloatArray:
    """Return half the loss of each residual: its square, and beyond the corner straight on."""
    loss: FloatArray = _CORNER**2 * (np.sqrt(1.0 + residuals**2 / _CORNER**2) - 1.0)
    return loss


def weights(residuals: FloatArray) -> FloatArray:
    """Return the weight of each residual in the robust loss, 1 for a small one."""
    weight: FloatArray = 1.0 / np.sqrt(1.0 + residuals**2 / _CORNER**2)
    return weight


def costs_of_throw(problem: Problem, k: int, several: FloatArray) -> FloatArray:
    """Return half the robust sums of squares of throw `k` with the prior of its release.

    Args:
        problem: The problem.
        k: Number of the throw.
        several: Sets of shared parameters and its release, shape (m, shared + 12).

    Returns:
        Shape (m,).
    """
    return costs_of(problem, k, several, problem.whitened(k, several))


def costs_of(problem: Problem, k: int, several: FloatArray, residuals: FloatArray) -> FloatArray:
    """Return the same where the residuals are known, in standard deviations, shape (m, n)."""
    prior = problem.release_priors(k, several[:, problem.shared :])
    costs: FloatArray = robust_loss(residuals).sum(axis=1) + 0.5 * (prior**2).sum(axis=1)
    return costs


def cost_of_throw(problem: Problem, k: int, here: FloatArray) -> float:
    """Return the cost for one set of parameters, shape (shared + 12,); see `costs_of_throw`."""
    return float(costs_of_throw(problem, k, here[np.newaxis])[0])


def each(problem: Problem, work: Callable[[int], _T]) -> list[_T]:
    """Return the results for all throws, computed side by side."""
    n = len(problem.throws)
    with closing(Threads(most=n)) as pool:
        return pool.run(partial(work, k) for k in range(n))


@dataclass(frozen=True, eq=False)
class Block:
    """The normal equations of one throw."""

    shared: FloatArray  # of the shared parameters, shape (s, s)
    mixed: FloatArray  # shape (s, 12)
    own: FloatArray  # of the release, with its prior, shape (12, 12)
    gradient: FloatArray  # by the shared parameters, shape (s,)
    own_gradient: FloatArray  # by the release, shape (12,)


def linear_blocks(problem: Problem, x: FloatArray) -> list[Block]:
    """Return the normal equations of each throw at the parameters, shape (p,)."""
    return each(problem, lambda k: _block(problem, k, x))


def _block(problem: Problem, k: int, x: FloatArray) -> Block:
    here = problem.here(k, x)
    r, slopes = problem.linearised(k, here)
    weighted = weights(r)[:, np.newaxis] * slopes
    normal, gradient = slopes.T @ weighted, weighted.T @ r
    n, root = problem.shared, problem.throws[k].information
    prior = problem.release_priors(k, here[n:])
    return Block(
        normal[:n, :n],
        normal[:n, n:],
        normal[n:, n:] + root.T @ root,
        gradient[:n],
        gradient[n:] + root.T @ prior,
    )


@dataclass(frozen=True, eq=False)
class Reduced:
    """The normal equations of the shared parameters, from which the releases are eliminated."""

    problem: Problem
    x: FloatArray  # the parameters, shape (p,)
    normal: FloatArray  # shape (s, s)
    gradient: FloatArray  # shape (s,)
    blocks: Sequence[Block]
    inverses: Sequence[FloatArray]  # of the equations of each release, shape (12, 12)

    def step(self, damping: float) -> FloatArray:
        """Return a step that stays in the bounds; a parameter at one does not move outwards."""
        low, high = self.problem.bounds
        x, gradient = self.x[: self.problem.shared], self.gradient
        free = ~(((x <= low) & (gradient > 0.0)) | ((x >= high) & (gradient < 0.0)))
        step = np.zeros_like(x)
        of_free = self.normal[np.ix_(free, free)]
        (step[free],) = solved(of_free, -gradient[free], np.array([damping]))
        return np.clip(x + step, low, high) - x

    def moved(self, step: FloatArray) -> FloatArray:
        """Return all parameters after a step of the shared ones, which the releases follow."""
        moved = self.x.copy()
        moved[: self.problem.shared] += step
        for k, (b, inverse) in enumerate(zip(self.blocks, self.inverses, strict=True)):
            moved[self.problem.own(k)] -= inverse @ (b.own_gradient + b.mixed.T @ step)
        return moved


def reduced(
    problem: Problem, x: FloatArray, blocks: Sequence[Block], damping: float = 0.0
) -> Reduced:
    """Return the normal equations of the shared parameters.

    Args:
        problem: The problem.
        x: Its parameters, shape (p,).
        blocks: Those of each throw there.
        damping: Share of each diagonal element that is added to it, also of the releases.
    """
    whole = np.diag(1.0 / problem.shared_deviations**2) + sum(b.shared for b in blocks)
    normal = whole + damping * np.diag(np.diag(whole))
    gradient = problem.shared_priors(x[: problem.shared]) / problem.shared_deviations
    inverses: list[FloatArray] = []
    for b in blocks:
        own = b.own + damping * np.diag(np.diag(b.own))
        inverse = np.asarray(np.linalg.inv(own), dtype=float)
        inverses.append(inverse)
        normal = normal - b.mixed @ inverse @ b.mixed.T
        gradient = gradient + b.gradient - b.mixed @ (inverse @ b.own_gradient)
    return Reduced(problem, x, normal, gradient, blocks, inverses)


def solved(normal: FloatArray, right: FloatArray, dampings: FloatArray) -> FloatArray:
    """Return damped Gauss-Newton steps, in parameters of any units.

    Args:
        normal: Normal equations, shape (n, n).
        right: Their right-hand side, shape (n,).
        dampings: Added to each element of the diagonal, which is scaled to 1, shape (m,).

    Returns:
        A step for each damping, shape (m, n).
    """
    scale = 1.0 / np.sqrt(np.diag(normal))
    scaled = normal * np.outer(scale, scale)
    damped = scaled + dampings[:, np.newaxis, np.newaxis] * np.eye(len(scale))
    steps: FloatArray = scale * np.linalg.solve(damped, (scale * right)[:, np.newaxis])[..., 0]
    return steps
