"""The errors of an IMU against the definitions of a data sheet: density, walk, range, filter."""

import dataclasses
import math

import numpy as np
from numpy.testing import assert_allclose
import pytest

pytest.importorskip('rclpy')

from disc_sim_ros.ros.sim.config import configuration
from disc_sim_ros.ros.sim.imu import ImuErrors

RATE = 200.0  # Hz
SPINNING = (0.1, -0.2, 60.0, 3.0, -4.0, 9.8)
ROUNDING = 1e-12  # of sums of a few numbers below 100


def readings(n, reading=SPINNING, flight=0, rate=RATE, **changes):
    """Return n readings with the errors of parameters `imu.*`, shape (n, 6)."""
    imu = configuration({f'imu.{name}': value for name, value in changes.items()}).imu
    errors = ImuErrors(imu, flight, 1.0 / rate)
    given = reading if np.ndim(reading) == 2 else [reading] * n
    return np.array([errors.add_to(tuple(r), i) for i, r in enumerate(given)])


def test_without_errors_the_reading_is_exact():
    assert readings(3).tolist() == [list(SPINNING)] * 3


@pytest.mark.parametrize('rate', [50.0, 200.0, 1000.0])
def test_the_noise_has_its_density_up_to_half_the_sample_rate(rate):
    n = 20_000
    density = [0.01, 0.02, 0.03]
    noise = readings(n, rate=rate, gyroscope_noise_density=density)[:, :3] - SPINNING[:3]
    expected = np.array(density) * math.sqrt(rate / 2)
    # Four standard errors of a standard deviation of n samples.
    assert_allclose(noise.std(axis=0), expected, rtol=4 / math.sqrt(2 * n))
    assert np.abs(np.corrcoef(noise.T)[np.triu_indices(3, 1)]).max() < 4 / math.sqrt(n)


def test_a_filter_takes_its_share_of_the_noise():
    n, cut_off = 20_000, 20.0
    noise = readings(
        n, (0.0,) * 6, accelerometer_noise_density=[0.01] * 3, accelerometer_bandwidth=cut_off
    )[:, 3:]
    assert_allclose(
        noise.std(axis=0), 0.01 * math.sqrt(math.pi / 2 * cut_off), rtol=4 / math.sqrt(2 * n)
    )


def test_the_bias_walks_with_the_root_of_time():
    flights, seconds = 400, 16
    walk = [0.0, 0.02, 0.0]
    ends = np.array(
        [
            readings(int(seconds * 10), (0.0,) * 6, f, 10.0, gyroscope_bias_walk=walk)[[39, -1], 1]
            for f in range(flights)
        ]
    )
    expected = 0.02 * np.sqrt([4.0, 16.0])
    assert_allclose(ends.std(axis=0), expected, rtol=4 / math.sqrt(2 * flights))
    # What comes later does not depend on what was before.
    later = ends[:, 1] - ends[:, 0]
    assert abs(np.corrcoef(ends[:, 0], later)[0, 1]) < 4 / math.sqrt(flights)


def test_readings_stop_at_the_range():
    limit = math.radians(2000.0)
    out = readings(5, gyroscope_range=[limit] * 3, accelerometer_range=[0.0, 2.0, 0.0])
    assert_allclose(out, [[0.1, -0.2, limit, 3.0, -2.0, 9.8]] * 5, atol=0.0)


def test_the_filter_answers_a_step_as_an_exponential():
    cut_off, n = 5.0, 40
    step = np.zeros((n, 6))
    step[1:, 2] = 1.0
    out = readings(n, step, gyroscope_bandwidth=cut_off)[:, 2]
    expected = 1.0 - np.exp(-2.0 * math.pi * cut_off * np.arange(n) / RATE)
    assert_allclose(out, expected, atol=ROUNDING)


def test_the_noise_of_a_sample_does_not_depend_on_the_samples_taken():
    imu = configuration(
        {'imu.gyroscope_noise': 0.1, 'imu.accelerometer_bias_walk': [0.1, 0.2, 0.3]}
    ).imu
    every = ImuErrors(imu, 3, 0.01)
    all_readings = [every.add_to(SPINNING, i) for i in range(3000)]
    some = ImuErrors(imu, 3, 0.01)
    for i in (0, 5, 2900, 1500, 1501, 4):
        assert_allclose(some.add_to(SPINNING, i), all_readings[i], atol=ROUNDING)
    other = ImuErrors(dataclasses.replace(imu, seed=1), 3, 0.01)
    assert other.add_to(SPINNING, 5) != all_readings[5]


def test_bias_noise_and_walk_add_up():
    parts = [
        {'gyroscope_bias': [0.1, 0.2, 0.3]},
        {'gyroscope_noise': 0.05},
        {'gyroscope_bias_walk': [0.01] * 3},
    ]
    each = [readings(50, (0.0,) * 6, **part) for part in parts]
    together = readings(50, (0.0,) * 6, **(parts[0] | parts[1] | parts[2]))
    assert_allclose(together, sum(each), atol=ROUNDING)
