"""The covariance of drawn landings: its ellipses hold the shares that they state."""

import numpy as np
import pytest

from disc_sim_ros.estimation.prediction.ellipse import (
    DRAWS,
    HELD,
    _draws,
    chi_squared,
    covariance_about,
)

CENTRE = np.array([30.0, -2.0, 3.0])
ALIKE = np.ones(DRAWS)


def inside(covariance: np.ndarray, landings: np.ndarray, share: float) -> float:
    """Return the share of landings in the ellipse of a share."""
    off = (landings - CENTRE)[:, :2]
    squares = np.einsum('ij,ij->i', off, np.linalg.solve(covariance[:2, :2], off.T).T)
    return float(np.mean(squares <= chi_squared(share) * (1.0 + 1e-6)))


def test_where_landings_are_linear_nine_of_ten_are_in_the_ellipse_of_90_percent():
    """The factor is found from 32 draws and their mirror images; the mean over 400 problems."""
    generator = np.random.default_rng(0)
    shares = []
    for m in range(400):
        slopes = generator.normal(size=(8 + m % 8, 3))
        drawn = CENTRE + _draws(len(slopes)) @ slopes
        true = CENTRE + generator.normal(size=(500, len(slopes))) @ slopes
        covariance = covariance_about(CENTRE, drawn, ALIKE)
        shares.append([inside(covariance, true, share) for share in (0.5, 0.9)])
    # The factor of one problem has a deviation of 13 %, so the mean share one of 0.2 %.
    assert np.mean(shares, axis=0) == pytest.approx([0.5, 0.9], abs=0.015)


def test_few_landings_far_away_do_not_widen_it():
    generator = np.random.default_rng(1)
    off = generator.normal(size=(DRAWS, 3))
    near = covariance_about(CENTRE, CENTRE + off, ALIKE)
    far = off.copy()
    far[:4] *= 30.0
    wide = covariance_about(CENTRE, CENTRE + far, ALIKE)
    assert inside(wide, CENTRE + far, HELD) == pytest.approx(HELD, abs=1.5 / DRAWS)
    # Without the factor it is some 3,000 times as large.
    assert np.linalg.det(wide[:2, :2]) < 9.0 * np.linalg.det(near[:2, :2])


def test_a_model_counts_by_its_weight():
    generator = np.random.default_rng(2)
    landings = CENTRE + generator.normal(size=(DRAWS, 3))
    one = covariance_about(CENTRE, landings, ALIKE)
    twice = covariance_about(CENTRE, np.tile(landings, (2, 1)), np.repeat([0.9, 0.1], DRAWS))
    assert twice == pytest.approx(one, rel=1e-12)
    other = np.concatenate([landings, landings + np.array([20.0, 0.0, 0.0])])
    half = covariance_about(CENTRE, other, np.repeat([0.5, 0.5], DRAWS))
    assert inside(half, other, HELD) == pytest.approx(HELD, abs=1.5 / DRAWS)
    hardly = covariance_about(CENTRE, other, np.repeat([1.0 - 1e-9, 1e-9], DRAWS))
    assert hardly == pytest.approx(one, rel=1e-5)


def test_landings_of_a_tenth_of_a_millimetre_keep_their_size():
    off = 1e-4 * np.random.default_rng(3).normal(size=(DRAWS, 3))
    small, large = (covariance_about(CENTRE, CENTRE + k * off, ALIKE) for k in (1.0, 1e4))
    assert 1e8 * small == pytest.approx(large, rel=1e-4)
    assert np.isfinite(covariance_about(CENTRE, np.tile(CENTRE, (DRAWS, 1)), ALIKE)).all()


def test_too_few_landings_have_no_covariance():
    few = np.tile(CENTRE, (DRAWS // 2 - 1, 1))
    assert np.isnan(covariance_about(CENTRE, few, np.ones(len(few)))).all()
