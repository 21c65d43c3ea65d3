"""Samples: each depends only on the seed and on its number, and follows its law."""

import json
import math
import subprocess
import sys
import warnings

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
import pytest

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.studies import sampling
from disc_sim_ros.studies.scatter import Normal, Uniform, probabilities
from disc_sim_ros.studies.study import Study

SETUP = Setup(disc=disc_file.load_disc('frisbee'), step=0.01)


@pytest.fixture(scope='module')
def stats():
    """`scipy.stats`, which is slow to load: one of three workers needs it."""
    from scipy import stats

    return stats


def study_of(**changes) -> Study:
    return Study(**({'setup': SETUP} | changes))


@pytest.mark.parametrize('method', sampling.METHODS)
def test_a_sample_is_the_same_wherever_it_is_drawn(method):
    whole = sampling.unit_samples(method, 5, 7, 0, 10_000, count=10_000)
    for start, stop in ((0, 1), (4095, 4097), (1234, 9876), (9999, 10_000)):
        piece = sampling.unit_samples(method, 5, 7, start, stop, count=10**7)
        assert_array_equal(piece, whole[start:stop])
    assert np.all((whole > 0.0) & (whole < 1.0))
    assert not np.any(whole == sampling.unit_samples(method, 5, 8, 0, 10_000, count=10_000))


def test_sobol_points_before_scrambling_are_those_of_scipy(stats):
    index = np.arange(1000)
    gray = index ^ (index >> 1)
    basis = sampling._sobol_basis(6, 10)
    digits = np.zeros((1000, 6), dtype=int)
    for j in range(10):
        digits[(gray >> j) & 1 == 1] ^= basis[j]
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # 1000 is no power of 2
        expected = stats.qmc.Sobol(6, scramble=False).random(1000)
    assert_array_equal(digits * 2.0**-30, expected)


def test_scrambled_sobol_points_are_still_a_net():
    """Each of 2^k equal slices of each axis holds the same number of 2^m points, k <= m."""
    points = sampling.unit_samples('sobol', 8, 3, 0, 1024, count=1024)
    slices = np.floor(points * 1024).astype(int)
    assert_array_equal(np.sort(slices, axis=0), np.tile(np.arange(1024)[:, None], (1, 8)))


def test_sobol_integrates_better_than_random_samples():
    """The mean of a smooth function: about 1/n against 1/sqrt(n), here 30 times better."""
    errors = {}
    for method in sampling.METHODS:
        means = [
            sampling.unit_samples(method, 3, seed, 0, 4096, count=4096).prod(axis=1).mean()
            for seed in range(8)
        ]
        errors[method] = math.sqrt(np.mean((np.array(means) - 0.125) ** 2))
    assert errors['sobol'] < errors['random'] / 10


def test_scattered_quantities_follow_their_laws(stats):
    study = study_of(
        scatter={'speed': Normal(1.5, 20.0), 'pitch': Uniform(5.0, 15.0), 'roll': Normal(2.0)},
        launch=Launch(roll=-4.0), count=20_000, seed=5,
    )  # fmt: skip
    values = study.values(0, 20_000)
    # Kolmogorov-Smirnov: a p-value below 1e-3 in one of three would be chance once in 300 seeds.
    assert stats.kstest(values['speed'], stats.norm(20.0, 1.5).cdf).pvalue > 1e-3
    assert stats.kstest(values['pitch'], stats.uniform(5.0, 10.0).cdf).pvalue > 1e-3
    assert stats.kstest(values['roll'], stats.norm(-4.0, 2.0).cdf).pvalue > 1e-3


def test_correlations_are_as_given():
    study = study_of(
        scatter={'speed': Normal(1.0, 20.0), 'spin': Normal(3.0, 40.0), 'yaw': Normal(2.0)},
        correlations={('speed', 'spin'): 0.8, ('spin', 'yaw'): -0.3},
        count=2**16, sampling='sobol',
    )  # fmt: skip
    values = study.values(0, 2**16)
    matrix = np.corrcoef([values['speed'], values['spin'], values['yaw']])
    # Quasi-random: the error of 65536 samples is far below the 0.004 of random ones.
    assert_allclose(matrix, [[1, 0.8, 0], [0.8, 1, -0.3], [0, -0.3, 1]], atol=2e-3)


def test_a_normal_law_is_truncated_at_the_bounds_of_the_quantity(stats):
    study = study_of(scatter={'height': Normal(1.0, 0.5)}, count=20_000)
    height = study.values(0, 20_000)['height']
    assert height.min() >= 0.0
    expected = stats.truncnorm(-0.5, math.inf, 0.5, 1.0)
    assert stats.kstest(height, expected.cdf).pvalue > 1e-3
    share = probabilities(Normal(1.0, 0.5), height, 0.0, 0.0, 10_000.0)
    assert_allclose(share, expected.cdf(height), atol=1e-12)


def test_the_last_name_of_a_grid_changes_fastest_and_each_point_has_all_samples():
    study = study_of(
        vary={'pitch': [5.0, 10.0], 'roll': [-1.0, 0.0, 1.0]},
        scatter={'speed': Normal(1.0), 'roll': Normal(0.5)}, count=4,
    )  # fmt: skip
    assert (study.size, study.shape) == (24, (2, 3))
    values = study.values(0, 24)
    assert_array_equal(values['pitch'], np.repeat([5.0, 10.0], 12))
    speed = values['speed'].reshape(6, 4)
    assert_array_equal(speed, np.tile(speed[0], (6, 1)))
    away = values['roll'].reshape(6, 4) - np.tile([-1.0, 0.0, 1.0], 2)[:, None]
    assert_allclose(away, np.tile(away[0], (6, 1)), atol=1e-12)  # rounding of sums of order 1


def test_values_do_not_depend_on_the_batch():
    study = study_of(
        vary={'pitch': [5.0, 10.0, 15.0]},
        scatter={'speed': Normal(1.0), 'spin': Normal(3.0), 'roll': Uniform(-5.0, 5.0)},
        correlations={('speed', 'spin'): 0.5}, count=700,
    )  # fmt: skip
    whole = study.values(0, study.size)
    for start, stop in ((0, 100), (650, 750), (699, 2100), (1399, 1400)):
        for name, values in study.values(start, stop).items():
            assert_array_equal(values, whole[name][start:stop])


def test_the_seed_of_the_gusts_follows_the_sample():
    windy = Setup(disc=SETUP.disc, step=0.01, wind=Wind(turbulence=5.0, seed=40))
    study = study_of(setup=windy, vary={'pitch': [5.0, 10.0]}, count=3)
    assert_array_equal(study.gust_seeds(0, 6), [40, 41, 42, 40, 41, 42])
    assert study_of(setup=windy, vary={'pitch': [5.0]}, gusts='same').gust_seeds(0, 1) is None


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'vary': {'pitch': []}}, 'at least one value'),
        ({'vary': {'pitch': [1.0, 1.0]}}, 'twice'),
        ({'vary': {'speed': [-1.0]}}, 'from 0 to 200 m/s'),
        ({'vary': {'pich': [1.0]}}, 'choose from speed, pitch'),
        ({'vary': {'pitch': [1.0]}, 'scatter': {'pitch': Normal(1.0, 5.0)}}, 'varied already'),
        ({'vary': {'spin': [1.0]}, 'advance_ratio': 0.3}, 'one determines the other'),
        ({'scatter': {'speed': Normal(1.0, -3.0)}}, 'from 0 to 200 m/s'),
        ({'scatter': {'speed': Uniform(1.0, 300.0)}}, 'from 0 to 200 m/s'),
        ({'scatter': {'spin': Normal(200.0)}, 'count': 9}, 'RK4 needs at most'),
        ({'count': 5}, 'all samples would be the same'),
        ({'sampling': 'sobol'}, 'no quantity scatters'),
        ({'vary': {'height': [-1.0]}}, 'from 0 to'),
        ({'scatter': {'speed': Normal(1.0)}, 'correlations': {('speed', 'spin'): 0.5}}, 'only'),
        ({'scatter': {n: Normal(1.0) for n in ('speed', 'spin', 'roll')},
          'correlations': {('speed', 'spin'): 0.9, ('spin', 'roll'): 0.9,
                           ('speed', 'roll'): -0.9}}, 'smaller correlations'),
    ],
)  # fmt: skip
def test_contradictions_are_refused(changes, message):
    with pytest.raises(ConfigError, match=message):
        study_of(**changes)


@pytest.mark.parametrize('sd', [0.0, -1.0, math.nan, math.inf])
def test_a_scatter_needs_a_standard_deviation(sd):
    with pytest.raises(ConfigError, match='standard deviation'):
        Normal(sd)


INTERRUPTED = """
from contextlib import suppress
import signal
import numpy as np
from scipy.stats import qmc
from disc_sim_ros.studies.sampling import load_sobol

read = np.load

def interrupted(*what, **more):
    np.load = read
    signal.raise_signal(signal.SIGINT)
    return read(*what, **more)

np.load = interrupted  # by which scipy reads the table
with suppress(KeyboardInterrupt):
    load_sobol()
    raise SystemExit('Ctrl-C is lost')
assert np.load is read
print(qmc.Sobol(40, scramble=False).random(8).tolist())
"""


def test_ctrl_c_leaves_scipy_no_half_table_of_direction_numbers(stats):
    """Its compiled code prints KeyboardInterrupt and goes on, with other points from then on."""
    done = subprocess.run(
        [sys.executable, '-c', INTERRUPTED],
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, '')
    assert json.loads(done.stdout) == stats.qmc.Sobol(40, scramble=False).random(8).tolist()
