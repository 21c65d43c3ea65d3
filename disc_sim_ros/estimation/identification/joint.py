"""Least squares over all parameters at once, shared ones and releases."""

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification.normal_equations import (
    Block,
    costs_of_throw,
    each,
    linear_blocks,
    reduced,
)
from disc_sim_ros.estimation.identification.problem import Problem

_ENOUGH = 1e-2  # decrease of the cost that ends it, in half squares
# On the diagonal of the normal equations, times what was best in the step before. All are flown
# side by side, which takes about a third of the time of the derivatives.
_DAMPINGS = 10.0 ** np.arange(-3.0, 5.0)
_FIRST_DAMPING, _MOST_DAMPING = 1e-3, 1e6
_SINGULAR = 1e-13  # keeps an equation solvable whose parameters nothing tells apart


def minimised(problem: Problem, x: FloatArray, most_steps: int = 60) -> tuple[FloatArray, float]:
    """Minimise the robust sum of squares from `x`.

    Levenberg-Marquardt steps. `fitting.solve` fits all releases anew for each set of shared
    parameters: that takes five times as long for a step, and pays where the valley is narrow.

    Args:
        problem: The problem.
        x: First parameters, shape (p,).
        most_steps: After which it ends.

    Returns:
        The parameters, shape (p,), and half the robust sum of squares.
    """
    cost = cost_of(problem, x)
    damping = _FIRST_DAMPING
    for _ in range(most_steps):
        blocks = linear_blocks(problem, x)
        gain = 0.0
        while gain <= 0.0 and damping < _MOST_DAMPING:
            tried = np.stack([_moved(problem, x, blocks, d * damping) for d in _DAMPINGS])
            of_each = costs(problem, tried)
            i = int(np.argmin(of_each))
            gain = cost - float(of_each[i])
            damping *= float(_DAMPINGS[i]) if gain > 0.0 else float(_DAMPINGS[-1])
        if gain <= 0.0:
            break
        x, cost = tried[i], float(of_each[i])
        if gain < _ENOUGH:
            break
    return x, cost


def _moved(problem: Problem, x: FloatArray, blocks: list[Block], damping: float) -> FloatArray:
    """Return the parameters after one damped step."""
    equations = reduced(problem, x, blocks, damping)
    return equations.moved(equations.step(_SINGULAR))


def costs(problem: Problem, several: FloatArray) -> FloatArray:
    """Return half the robust sums of squares of sets of parameters, shape (m,), from (m, p)."""
    n = problem.shared

    def of_throw(k: int) -> FloatArray:
        own = several[:, problem.own(k)]
        return costs_of_throw(problem, k, np.concatenate([several[:, :n], own], axis=1))

    priors = (several[:, :n] - problem.means[:n]) / problem.shared_deviations
    total: FloatArray = 0.5 * (priors**2).sum(axis=1) + sum(each(problem, of_throw))
    return total


def cost_of(problem: Problem, x: FloatArray) -> float:
    """Return half the robust sum of squares for one set of parameters, shape (p,)."""
    return float(costs(problem, x[np.newaxis])[0])
