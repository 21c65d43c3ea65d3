"""Standard errors of an identification: curvature, profiles, and the damping integrated out."""

from dataclasses import dataclass

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification import information, marginal, profile
from disc_sim_ros.estimation.identification.fitting import Best, Progress, solve
from disc_sim_ros.estimation.identification.problem import Problem

_PROFILES = 4  # at most: one may meet parameters that fit better


@dataclass(frozen=True, eq=False)
class Errors:
    """Parameters with their covariance.

    Attributes:
        x: The parameters, shape (p,).
        covariance: Of the parameters, shape (p, p).
        widening: Factor in it because residuals are correlated in time.
        stretches: Factors in it of the free coefficients because profiles are no parabolas.
    """

    x: FloatArray
    covariance: FloatArray
    widening: float
    stretches: FloatArray


def by_curvature(problem: Problem, x: FloatArray) -> Errors:
    """Return the errors by the curvature of the sum of squares at `x`."""
    known = information.information(problem, x)
    return Errors(x, known.covariance(), known.widening, np.ones(len(problem.free)))


def errors(problem: Problem, x: FloatArray, best: Best, progress: Progress | None) -> Errors:
    """Return the parameters with errors that hold far from the minimum, too.

    Args:
        problem: The problem.
        x: Its best parameters, shape (p,).
        best: Updated with each better point.
        progress: Called with a stage, a count and the cost.
    """
    known = information.information(problem, x)
    integrated = marginal.marginal(problem, x, known, progress)
    if integrated is None:
        x, stretches = _profiled(problem, x, best, progress)
        known = information.information(problem, x)
        return Errors(x, _scaled(known.covariance(), stretches), known.widening, stretches)
    place = problem.free.index(marginal.DAMPING)
    held = marginal.holding(problem, integrated.mean)
    rest, stretches = _profiled(held, np.delete(integrated.x, place), Best(), progress)
    known = information.information(held, rest)
    within = _scaled(known.covariance(), stretches)
    covariance = np.insert(np.insert(within, place, 0.0, axis=0), place, 0.0, axis=1)
    return Errors(
        np.insert(rest, place, integrated.mean),
        covariance + integrated.between,
        known.widening,
        np.insert(stretches, place, 1.0),
    )


def _scaled(covariance: FloatArray, stretches: FloatArray) -> FloatArray:
    """Return a covariance with wider errors of the first parameters."""
    factors = np.concatenate([stretches, np.ones(len(covariance) - len(stretches))])
    scaled: FloatArray = covariance * np.outer(factors, factors)
    return scaled


def _profiled(
    problem: Problem, x: FloatArray, best: Best, progress: Progress | None
) -> tuple[FloatArray, FloatArray]:
    """Return the best parameters and the stretches of the standard errors."""
    for _ in range(_PROFILES):
        curvature = information.information(problem, x).white_covariance()
        result = profile.profiled(problem, x, curvature, progress)
        if result.better is None:
            break
        x = solve(problem, result.better, best=best, progress=progress, stage=profile.STAGE).x
    return x, result.stretches
