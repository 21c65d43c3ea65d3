"""Wind: profile, Dryden gusts against their correlations, seeds."""

import dataclasses
import itertools
import math

import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.kernels.equations import Velocity
from disc_sim_ros.physics.kernels.wind import first_filter, gust_of, next_filter, scales, wind_at
from disc_sim_ros.physics.launch import Launch
from sample_discs import FRISBEE

STILL = Velocity(0.0, 0.0, 0.0)


def test_scales_are_those_of_the_specification():
    """MIL-F-8785C, 3.7.3.4, at 200 ft by hand: L_u = 200 / (0.177 + 0.1646)^1.2 = 726 ft."""
    L_u, L_w, sigma_u, sigma_w = scales(-200 * 0.3048, 15.0)
    assert L_w == pytest.approx(200 * 0.3048)
    assert L_u == pytest.approx(725.7 * 0.3048, rel=1e-3)
    assert sigma_w == pytest.approx(1.5)
    assert sigma_u == pytest.approx(1.5 / 0.3416**0.4, rel=1e-4)
    assert scales(0.0, 15.0) == scales(-3.0, 15.0)  # below 10 ft


def gusts(seed, V, height, dt, count):
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((count, 5))
    wind = Setup(disc=FRISBEE, wind=Wind(turbulence=10.0)).wind_data
    f = first_filter(noise[0])
    rows = np.empty((count, 3))
    for i in range(count):
        rows[i] = gust_of(f, -height, wind)
        if i + 1 < count:
            f = next_filter(f, V, -height, dt, noise[i + 1])
    return rows


def test_gusts_have_the_variance_and_the_correlation_of_dryden():
    """Longitudinal exp(-tau), lateral and vertical exp(-tau) (1 - tau / 2), tau = V t / L."""
    V, height, dt, count = 15.0, 10.0, 0.05, 100_000
    rows = gusts(1, V, height, dt, count)
    L_u, L_w, sigma_u, sigma_w = scales(-height, 10.0)
    for column, L, sigma, across in ((0, L_u, sigma_u, False), (1, L_u, sigma_u, True),
                                     (2, L_w, sigma_w, True)):  # fmt: skip
        x = rows[:, column] / sigma
        # Independent samples: count V dt / (2 L); five standard deviations.
        error = 5 * math.sqrt(2 * L * 2 / (count * V * dt))
        for lag in (0, 4, 16):
            tau = lag * dt * V / L
            expected = math.exp(-tau) * (1 - tau / 2 if across else 1.0)
            assert np.mean(x[: count - lag] * x[lag:]) == pytest.approx(expected, abs=error)
    assert_allclose(np.corrcoef(rows.T) - np.eye(3), 0.0, atol=0.1)


def test_the_statistics_do_not_depend_on_the_grid():
    """Two half steps of the filter have the mean and the variance of one whole step."""
    from disc_sim_ros.physics.kernels.wind import _next_pair

    zero = (0.0, 0.0)
    for d in (0.01, 0.3, 2.0):
        whole = np.array([_next_pair(*zero, d, *n) for n in ((1.0, 0.0), (0.0, 1.0))])
        first = [_next_pair(*zero, d / 2, *n) for n in ((1.0, 0.0), (0.0, 1.0))]
        carried = np.array([_next_pair(*x, d / 2, 0.0, 0.0) for x in first])
        halves = np.vstack([carried, first])
        assert_allclose(halves.T @ halves, whole.T @ whole, atol=1e-12)


def test_log_profile():
    wind = Wind(mean=(6.0, -2.0, 0.5), roughness_length=0.03, reference_height=10.0)
    data = Setup(disc=FRISBEE, wind=wind).wind_data
    still = wind_at(-10.0, STILL, data)
    assert_allclose(still, (6.0, -2.0, 0.5))
    low = wind_at(-1.0, STILL, data)
    share = math.log(1 / 0.03) / math.log(10 / 0.03)
    assert_allclose(low, (6.0 * share, -2.0 * share, 0.5))
    assert_allclose(wind_at(-0.01, STILL, data), (0.0, 0.0, 0.5))
    assert_allclose(wind_at(5.0, STILL, data), (0.0, 0.0, 0.5))


def gusty(seed, step=1e-3, rate=100.0, **wind):
    setup = Setup(disc=FRISBEE, step=step, wind=Wind(turbulence=15.0, seed=seed, **wind))
    return fly(Launch(height=1.5), setup, sample_rate=rate)


def test_each_seed_gives_a_flight_of_its_own():
    assert gusty(5).end == gusty(5).end
    ends = [gusty(seed).position for seed in range(4)]
    for a, b in itertools.pairwise(ends):
        assert np.linalg.norm(a - b) > 0.05


def test_gusts_do_not_depend_on_the_step():
    """They have a time grid of their own, 10 ms, so that a finer step gives the same flight."""
    coarse, fine = gusty(7, 2e-3), gusty(7, 1e-3 / 4)
    # Gusts drive alpha over many corners of the table, and each adds an error of order (2 ms)^2:
    # less than a millimetre, where other gusts would move the landing by metres.
    assert_allclose(coarse.position, fine.position, atol=1e-3)
    wind = coarse.trajectory.wind
    assert_allclose(wind, fine.trajectory.wind[: len(wind)], atol=1e-3)
    # A step across a grid point takes the new gust up to a step late.
    for step in (3e-3, 7e-3, 2e-2):
        assert_allclose(gusty(7, step).position, fine.position, atol=0.1)


def test_gusts_are_continuous_and_of_the_right_size():
    wind = np.vstack([gusty(seed, rate=1000.0).trajectory.wind for seed in range(30)])
    _, _, sigma_u, sigma_w = scales(-2.0, 15.0)
    # Thirty flights of 4 s hold few independent gusts: 30 of u, 300 of w.
    assert np.std(wind[:, 0]) == pytest.approx(sigma_u, rel=0.5)
    assert np.std(wind[:, 2]) == pytest.approx(sigma_w, rel=0.25)
    one = gusty(1, rate=1000.0).trajectory.wind
    assert np.abs(np.diff(one, axis=0)).max() < 0.1 * sigma_w


def test_gusts_blow_along_and_across_the_mean_wind():
    a = gusty(3, mean=(0.0, 1e-12, 0.0)).trajectory.wind[0]
    b = gusty(3, mean=(1e-12, 0.0, 0.0)).trajectory.wind[0]
    assert_allclose(a, (-b[1], b[0], b[2]), atol=1e-9)


@pytest.mark.parametrize(
    'wrong',
    [
        {'mean': (math.nan, 0.0, 0.0)},
        {'turbulence': -1.0},
        {'roughness_length': 2.0, 'reference_height': 3.0},
        {'seed': -1},
        {'mean': (1e300, 0.0, 0.0)},
    ],
)
def test_impossible_winds_are_refused(wrong):
    with pytest.raises(ConfigError):
        dataclasses.replace(Wind(), **wrong)
