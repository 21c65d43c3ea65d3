"""Local coordinates of a state."""

import numpy as np
import pytest

from disc_sim_ros.estimation import local
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.launch import Launch

STATE = np.array(Launch(pitch=20.0, roll=-30.0, yaw=70.0, spin=50.0, height=1.0).state())


def test_a_turn_about_the_body_x_axis_is_a_roll():
    delta = np.zeros(local.SIZE)
    delta[local.NAMES.index('tilt_x')] = np.radians(10.0)
    rolled = np.array(Launch(pitch=20.0, roll=-20.0, yaw=70.0, spin=50.0, height=1.0).state())
    np.testing.assert_allclose(local.moved(STATE, delta)[6:10], rolled[6:10], atol=1e-12)


def test_a_large_turn_keeps_the_length_and_no_turn_changes_nothing():
    delta = np.zeros((3, local.SIZE))
    delta[1, 6:8] = 2.0, -3.0
    delta[2, :3] = 1.0, 2.0, 3.0
    moved = local.moved(STATE, delta)
    np.testing.assert_allclose(moved[0], STATE, rtol=0.0, atol=1e-15)  # a rounding of the length
    assert np.linalg.norm(moved[1, 6:10]) == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(moved[2, :3], STATE[:3] + np.array([1.0, 2.0, 3.0]))


def test_the_axis_is_the_last_column_of_the_rotation():
    axis = frames.rotation_matrix(STATE[np.newaxis, 6:10])[0][:, 2]
    np.testing.assert_allclose(local.disc_axis(STATE), axis, atol=1e-15)


def test_the_rate_of_the_attitude_is_that_of_the_equations():
    """d/dt e = e (0, p, q, 0) / 2: turning by p dt, q dt for a short time moves the axis alike."""
    delta = np.zeros(local.SIZE)
    delta[6:8] = 1e-6 * np.array([2.0, -1.0])
    change = (local.moved(STATE, delta)[6:10] - STATE[6:10]) / 1e-6
    e0, e1, e2, e3 = STATE[6:10]
    p, q = 2.0, -1.0
    expected = 0.5 * np.array(
        [-e1 * p - e2 * q, e0 * p - e3 * q, e0 * q + e3 * p, e1 * q - e2 * p]
    )
    np.testing.assert_allclose(change, expected, atol=1e-5)  # second order: 1e-6 of 2.5
