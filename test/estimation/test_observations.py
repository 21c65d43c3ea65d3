"""What instruments would measure of a simulated flight, beside independent sources of it."""

import numpy as np
import pytest

from disc_sim_ros.estimation.identification.observations import (
    Accelerations,
    Attitudes,
    Camera,
    Gyro,
)
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.imu import reading
from disc_sim_ros.physics.kernels.equations import Control, State, Velocity, derivative
from disc_sim_ros.physics.kernels.wind import wind_at
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.sampled import default_row, fly_sampled

SETUP = Setup(disc=load_disc('ultrastar'))
LAUNCH = Launch(speed=18.0, pitch=10.0, roll=5.0, yaw=20.0, spin=60.0, height=1.3, roll_rate=2.0)
T = np.array([0.0, 0.3, 0.71])
FOOT = np.zeros((1, 2))


def states_at(times: np.ndarray) -> np.ndarray:
    state = np.array(LAUNCH.state())[np.newaxis]
    row = default_row(SETUP)[np.newaxis]
    ascending, places = np.unique(times, return_inverse=True)
    return fly_sampled(state, row, SETUP, ascending, step=0.001, duration=0.0).states[:, places]


def ideal_imu(s: State) -> np.ndarray:
    """Return what the IMU of sim_node reads, in the paper's axes."""
    d = derivative(
        s, wind_at(s.Z, Velocity(0.0, 0.0, 0.0), SETUP.wind_data), SETUP.plant, Control()
    )
    numbers = reading(s, (d.VX, d.VY, d.VZ), (d.p, d.q, d.r), (0.0, 0.0, 0.0), SETUP.air.gravity)
    return np.concatenate([frames.paper_from_map(numbers[:3]), frames.paper_from_map(numbers[3:])])


def test_gyro_and_accelerometer_read_what_the_imu_of_the_simulator_reads():
    expected = np.array([ideal_imu(State(*x)) for x in states_at(T)[0]])
    gyro = Gyro(T, np.zeros((3, 3)))
    np.testing.assert_allclose(gyro.residuals(states_at(T), FOOT)[0], expected[:, :3], atol=1e-9)
    accelerations = Accelerations(T, np.zeros((3, 3)), SETUP.air.gravity)
    states = states_at(accelerations.sample_times)
    # Over 2 ms the air force turns with the wobble only: by 1e-3 of 20 m/s^2.
    # The first measurement has its difference over 1 ms, half a millisecond late.
    np.testing.assert_allclose(
        accelerations.residuals(states, FOOT)[0][1:], expected[1:, 3:], atol=0.1
    )


def test_samples_at_the_end_of_the_range_do_not_count():
    f = np.full((3, 3), 160.0)
    f[1] = 0.0
    accelerations = Accelerations(T, f, SETUP.air.gravity, 160.0)
    r = accelerations.residuals(states_at(accelerations.sample_times), FOOT)[0]
    assert (r[[0, 2]] == 0.0).all()
    assert (r[1] != 0.0).any()


def test_an_attitude_off_by_a_degree_leaves_a_degree():
    states = states_at(T)
    axis = frames.rotation_matrix(states[0, :, 6:10])[:, :, 2]
    tilt = np.radians(1.0)
    across = np.cross(axis, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    tilted = np.cos(tilt) * axis + np.sin(tilt) * across
    r = Attitudes(T, tilted).residuals(states, FOOT)[0]
    np.testing.assert_allclose(np.linalg.norm(r, axis=1), np.sin(tilt), rtol=1e-9)


def test_a_camera_draws_a_high_disc_farther_out():
    states = np.zeros((1, 1, 14))
    states[0, 0, :3] = 50.0, 10.0, -20.0  # 20 m up
    foot = np.array([[10.0, 0.0]])
    drawn = Camera(np.zeros(1), np.zeros((1, 2)), 100.0).residuals(states, foot)[0, 0]
    assert drawn == pytest.approx([10.0 + 40.0 * 100 / 80, 10.0 * 100 / 80])
