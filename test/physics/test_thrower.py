"""A thrower's words: attitude and velocity by scipy's rotations, mirror images, the atmosphere."""

import math

import numpy as np
from numpy.testing import assert_allclose
import pytest
from scipy.spatial.transform import Rotation

from disc_sim_ros.physics import thrower
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch

ROUNDING = 1e-12  # of products of a few numbers of order 1


def axes(launch: Launch) -> tuple[Rotation, np.ndarray]:
    """Return attitude and direction of the velocity, in the paper's earth axes."""
    s = launch.state()
    return Rotation.from_quat([s.e1, s.e2, s.e3, s.e0]), np.array(s[3:6]) / launch.speed


@pytest.mark.parametrize('clockwise', [True, False])
@pytest.mark.parametrize('hyzer', [-30.0, 0.0, 10.0, 80.0])
@pytest.mark.parametrize(
    ('climb', 'nose', 'yaw'), [(8.0, 0.0, 0.0), (12.0, -3.0, 20.0), (0, 5, 0)]
)
def test_the_velocity_climbs_and_the_disc_is_tilted_as_named(climb, nose, yaw, hyzer, clockwise):
    given = thrower.angles(climb, nose, hyzer, yaw=yaw, clockwise=clockwise)
    attitude, velocity = axes(Launch(**given))
    c, y = math.radians(climb), math.radians(yaw)
    expected = [math.cos(c) * math.cos(y), math.cos(c) * math.sin(y), -math.sin(c)]
    assert_allclose(velocity, expected, atol=ROUNDING)
    roll = -hyzer if clockwise else hyzer
    path = Rotation.from_euler('ZYX', [yaw, climb, roll], degrees=True)
    other = path * Rotation.from_euler('Y', nose, degrees=True)
    assert_allclose(attitude.as_matrix(), other.as_matrix(), atol=ROUNDING)
    # The nose stands above the velocity by the nose angle, in the plane of the disc's axis.
    x, _, z = attitude.as_matrix().T
    assert math.degrees(math.atan2(velocity @ z, velocity @ x)) == pytest.approx(nose, abs=1e-9)


def test_hyzer_puts_the_edge_down_to_which_the_disc_fades():
    for throw, sign in thrower.THROWS.items():
        given = thrower.angles(10.0, 0.0, 15.0, clockwise=sign > 0)
        attitude, _ = axes(Launch(**given))
        right_edge_down = attitude.apply([0.0, 1.0, 0.0])[2] > 0.0  # Z points down
        assert right_edge_down == (throw in {'rhfh', 'lhbh'})


def test_left_and_right_hand_are_mirror_images():
    setup = Setup(disc=load_disc('wraith'))
    ends = [
        fly(
            Launch(
                speed=25.0, spin=spin, height=1.2,
                **thrower.angles(8.0, 1.0, 10.0, clockwise=spin > 0),
            ),
            setup,
        )
        for spin in (100.0, -100.0)
    ]  # fmt: skip
    assert_allclose(ends[0].position * (1, -1, 1), ends[1].position, atol=1e-9)
    assert ends[0].position[1] != 0.0


@pytest.mark.parametrize(
    ('altitude', 'density'),  # ISO 2533, table of the standard atmosphere
    [(0.0, 1.2250), (1000.0, 1.1117), (1500.0, 1.0581), (5000.0, 0.73643), (11_000.0, 0.36392)],
)
def test_the_air_is_that_of_the_standard_atmosphere(altitude, density):
    # The table is of geometric altitudes up to 5000 m, 4 m more than geopotential ones there.
    assert thrower.air_at(altitude).density == pytest.approx(density, rel=1e-3)


def test_warm_air_is_thinner_by_the_gas_law():
    cold, warm = thrower.air_at(0.0, 0.0), thrower.air_at(0.0, 30.0, gravity=9.8)
    assert warm.density / cold.density == pytest.approx(273.15 / 303.15, rel=1e-12)
    assert warm.gravity == 9.8
