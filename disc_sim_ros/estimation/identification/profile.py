"""Standard errors where the sum of squares is no parabola: the profile of each coefficient."""

from dataclasses import dataclass, replace
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification.fitting import BETTER, Progress, solve
from disc_sim_ros.estimation.identification.joint import cost_of, minimised
from disc_sim_ros.estimation.identification.problem import Problem

STAGE = 'errors'
# Rise of the robust loss over that of the weighted squares that the information counts, of normal
# residuals: the mean of its second derivative over the mean of its weights.
_ROBUST = 0.895
_FAR = 3.0  # standard errors of a parabola at which the sum of squares is looked at
_PARABOLA = 0.15  # relative departure of the rise up to which it counts as a parabola
_STEPS, _JOINT_STEPS = 3, 15  # of the fit of all other parameters
_WIDEST = 10.0


@dataclass(frozen=True, eq=False)
class Profile:
    """What the sum of squares does far from its minimum.

    Attributes:
        stretches: For each free coefficient the factor by which its profile is wider than the
            curvature at the minimum says, on the wider side; at least 1.
        better: Parameters that fit better than the minimum, shape (p,); None if none was met.
    """

    stretches: FloatArray
    better: FloatArray | None = None


def profiled(
    problem: Problem, x: FloatArray, covariance: FloatArray, progress: Progress | None = None
) -> Profile:
    """Look at the sum of squares three standard errors to each side of each coefficient.

    All other parameters are fitted again there. A parabola rises by 9; where the robust sum of
    squares rises by less, values that far away fit better than the curvature says. A damping is
    such a coefficient: where it is large, the wobble that shows it is soon over.

    Args:
        problem: The problem.
        x: The best parameters, shape (p,).
        covariance: Of white noise: inverse of the curvature at `x`, shape (p, p).
        progress: Called with `STAGE`, the number of the coefficient and the cost.

    Returns:
        The profile. It ends at the first parameters that fit better.
    """
    problem = replace(problem, margin=problem.roughest)
    low, high = problem.bounds
    x = solve(problem, x, most_steps=2).x
    lowest = cost_of(problem, x)
    factors = np.ones(len(problem.free))
    for i in range(len(problem.free)):
        if progress is not None:
            progress(STAGE, i + 1, lowest)
        error = math.sqrt(covariance[i, i])
        for side in (-_FAR, _FAR):
            distance = float(np.clip(x[i] + side * error, low[i], high[i]) - x[i]) / error
            if abs(distance) < 1.0:
                continue  # a bound is near: it limits the coefficient more than the throws do
            moved = x + covariance[:, i] / covariance[i, i] * distance * error
            moved[: problem.shared] = np.clip(moved[: problem.shared], low, high)
            cost = cost_of(problem, moved)
            if abs(2.0 * (cost - lowest) / _ROBUST / distance**2 - 1.0) > _PARABOLA:
                moved = _fitted_beside(problem, moved, i)
                cost = cost_of(problem, moved)
                if cost < lowest - BETTER:
                    return Profile(factors, moved)
            rise = 2.0 * (cost - lowest) / _ROBUST
            wider = abs(distance) / math.sqrt(max(rise, (distance / _WIDEST) ** 2))
            factors[i] = max(factors[i], wider)
    return Profile(factors)


def _fitted_beside(problem: Problem, x: FloatArray, i: int) -> FloatArray:
    """Return the parameters with coefficient `i` held and the others fitted."""
    held = problem.held.copy()
    held[problem.free[i]] = x[i]
    rest = replace(problem, free=tuple(np.delete(problem.free, i)), held=held)
    others = np.delete(x, i)
    # A gyro holds each release: steps over all parameters then come as far in a quarter of the
    # time. Positions leave valleys, along which only releases that are fitted anew follow.
    if problem.turns_only:
        fitted, _ = minimised(rest, others, _JOINT_STEPS)
    else:
        fitted = solve(rest, others, most_steps=_STEPS).x
    return np.insert(fitted, i, x[i])
