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


def test_a_difference_takes_one_state_to_the_other():
    other = np.array(Launch(pitch=-50.0, roll=60.0, yaw=-100.0, spin=40.0, roll_rate=3.0).state())
    other[13] = 0.7
    delta, turn = local.difference(STATE, other)
    moved = local.moved(STATE, delta)
    np.testing.assert_allclose(moved[[0, 1, 2, 3, 4, 5, 12]], other[[0, 1, 2, 3, 4, 5, 12]])
    np.testing.assert_allclose(local.disc_axis(moved), local.disc_axis(other), atol=1e-12)
    # The same angular velocity over the ground, and the same place of a mark on the rim.
    for state, angle in ((moved, STATE[13] + turn), (other, other[13])):
        turned = frames.rotation_matrix(state[np.newaxis, 6:10])[0]
        say = turned @ state[10:13], turned @ [np.cos(angle), np.sin(angle), 0.0]
        if state is moved:
            expected = say
    np.testing.assert_allclose(say[0], expected[0], atol=1e-12)
    np.testing.assert_allclose(say[1], expected[1], atol=1e-12)


def test_a_difference_is_the_inverse_of_a_move():
    delta = np.array([1.0, -2.0, 3.0, 0.5, 0.4, 0.3, 0.9, -1.7, 4.0, 5.0, -6.0])
    back, turn = local.difference(STATE, local.moved(STATE, delta))
    np.testing.assert_allclose(back, delta, atol=1e-12)
    assert turn == pytest.approx(0.0, abs=1e-12)
