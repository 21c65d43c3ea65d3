"""Standard errors where the sum of squares is no parabola."""

import math

import numpy as np
import pytest
from scipy.optimize import least_squares

from disc_sim_ros.estimation.identification import information, profile
from disc_sim_ros.estimation.identification.problem import Problem
from estimation.one_throw import damping_problem


def deviation(problem: Problem, x: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the covariance by the curvature, and the standard error of the damping."""
    covariance = information.information(problem, x).white_covariance()
    return covariance, math.sqrt(covariance[0, 0])


def rise(problem: Problem, x: np.ndarray, damping: float) -> float:
    """Return by how much the sum of squares rises to another damping, by scipy's search."""
    shared = problem.shared

    def residuals(damping: float, others: np.ndarray) -> np.ndarray:
        here = np.array([damping, *others])
        return np.concatenate(
            [
                problem.residuals(0, here),
                problem.shared_priors(here[:shared]),
                problem.release_priors(0, here[shared:]),
            ]
        )

    # From 1 in units in which a step of 1 % suits a difference: wind, then the release.
    unit = 100.0 * np.array([1e-3] * 8 + [1e-4] * 2 + [1e-2] * 3 + [1e-4])
    fitted = least_squares(
        lambda u: residuals(damping, x[1:] + (u - 1.0) * unit),
        np.ones(len(unit)),
        x_scale='jac',
        diff_step=0.01,
        max_nfev=8,
    )
    lowest = residuals(float(x[0]), x[1:])
    return float(2.0 * fitted.cost - lowest @ lowest)


def test_a_damping_that_hides_the_wobble_is_known_less_well_than_the_curvature_says():
    problem, x = damping_problem(('position', 'attitude'), 0.6)
    covariance, error = deviation(problem, x)
    result = profile.profiled(problem, x, covariance)
    # By squares without the robust loss, which for rises of a few units is 3 % lower.
    far = rise(problem, x, x[0] + 3.0 * error)
    assert far < 0.6 * 9.0
    assert result.stretches[0] == pytest.approx(3.0 / math.sqrt(far / 0.895), rel=0.05)
    assert result.better is None


def test_where_a_gyro_tells_the_damping_the_sum_of_squares_is_a_parabola():
    problem, x = damping_problem(('position', 'gyro'), 1.8)
    covariance, error = deviation(problem, x)
    assert profile.profiled(problem, x, covariance).stretches == pytest.approx([1.0], abs=0.02)
    assert rise(problem, x, x[0] + 3.0 * error) == pytest.approx(9.0, rel=0.05)
