"""The damping where only a wobble near the noise tells it."""

import math

import numpy as np
import pytest

from disc_sim_ros.estimation.identification import errors, information, marginal
from disc_sim_ros.estimation.identification.fitting import Best
from disc_sim_ros.estimation.identification.marginal import Point
from estimation.one_throw import damping_problem


def test_a_normal_density_gives_its_mean_and_deviation_back():
    """With the same volume everywhere both halves are the same normal density."""
    dampings = np.linspace(0.55, 1.45, 19)
    points = [
        Point(float(d), np.array([2.0 * d]), 0.5 * ((d - 1.0) / 0.1) ** 2, 7.0) for d in dampings
    ]
    fine, shares, every = marginal.posterior(points, 0)
    assert shares.sum() == pytest.approx(1.0)
    assert shares @ fine == pytest.approx(1.0, abs=1e-3)
    assert math.sqrt(shares @ (fine - 1.0) ** 2) == pytest.approx(0.1, rel=0.01)
    np.testing.assert_allclose(every[:, 0], fine, atol=2e-3)  # interpolated in the logarithm
    np.testing.assert_allclose(every[:, 1], 2.0 * fine, atol=4e-3)


def test_half_of_the_weight_counts_the_volume_of_the_fits():
    """A volume that falls by the square of ten between two equal fits moves half of the weight."""
    points = [
        Point(
            d,
            np.array([0.0]),
            200.0 * min(abs(d - 1.0), abs(d - 2.0)),
            math.log(100.0) * (d < 1.5),
        )
        for d in np.arange(0.8, 2.21, 0.01)
    ]
    fine, shares, _ = marginal.posterior(points, 0)
    assert shares[fine < 1.5].sum() == pytest.approx(0.5 * 0.5 + 0.5 * 0.01, abs=0.01)


def test_where_a_gyro_tells_the_damping_nothing_is_integrated():
    problem, x = damping_problem(('position', 'gyro'), 1.8)
    known = information.information(problem, x)
    assert marginal.marginal(problem, x, known, None) is None


def test_the_error_of_a_damping_near_the_noise_holds_all_dampings_that_fit():
    problem, x = damping_problem(('position', 'attitude'), 0.6)
    result = errors.errors(problem, x, Best(), None)
    by_curvature = errors.by_curvature(problem, x)
    error = math.sqrt(result.covariance[0, 0])
    assert error > math.sqrt(by_curvature.covariance[0, 0])
    assert x[0] < result.x[0] < x[0] + 2.0 * error
    assert abs(result.x[0] - 0.6) < 2.0 * error
    # Only rounding takes an eigenvalue below 0: entries differ by up to 1e8.
    scale = np.sqrt(np.diag(result.covariance))
    assert np.linalg.eigvalsh(result.covariance / np.outer(scale, scale)).min() > -1e-9
