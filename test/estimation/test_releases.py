"""A measured release: its state and its covariance."""

from dataclasses import replace

import numpy as np
import pytest

from disc_sim_ros.estimation import local
from disc_sim_ros.estimation.identification.releases import (
    ReleaseErrors,
    release_covariance,
    release_state,
)
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.thrower import Release

DISC = load_disc('wraith')
RELEASE = Release(speed=24.0, spin=130.0, launch_angle=10.0, nose=3.0, hyzer=15.0)
ERRORS = ReleaseErrors(speed=0.6, launch_angle=2.0, nose=1.0, hyzer=5.0, spin=2.0)
PLACE = np.array([3.0, -2.0, -1.5])


def test_the_heading_and_the_place_are_those_of_the_path():
    release, state = release_state(RELEASE, DISC, PLACE, np.array([10.0, 10.0, -3.0]))
    assert release.heading == pytest.approx(45.0)
    np.testing.assert_allclose(state[:3], PLACE)
    climb = np.radians(RELEASE.launch_angle)
    forward = np.array([*[np.cos(climb) / np.sqrt(2.0)] * 2, -np.sin(climb)])
    np.testing.assert_allclose(state[3:6], RELEASE.speed * forward, rtol=1e-12)
    assert state[12] == RELEASE.spin


def test_the_covariance_is_that_of_drawn_releases():
    """5000 releases with normal errors: standard deviations to 1 %, 5 times that allowed; what is
    curved over 5 degrees moves second moments by (0.09 rad)^2.
    """
    generator = np.random.default_rng(2)
    known = replace(RELEASE, heading=0.0)
    _, centre = release_state(known, DISC, PLACE, np.array([1.0, 0.0, 0.0]))
    drawn = []
    for speed, launch, nose, hyzer, spin in generator.standard_normal((5000, 5)):
        release = Release(
            speed=RELEASE.speed + ERRORS.speed * speed,
            spin=RELEASE.spin + ERRORS.spin * spin,
            launch_angle=RELEASE.launch_angle + ERRORS.launch_angle * launch,
            nose=RELEASE.nose + ERRORS.nose * nose,
            hyzer=RELEASE.hyzer + ERRORS.hyzer * hyzer,
        )
        _, state = release_state(release, DISC, PLACE, np.array([1.0, 0.0, 0.0]))
        drawn.append(local.difference(centre, state)[0])
    stated = release_covariance(known, DISC, ERRORS, np.full(3, 1e-6))
    # The covariance holds 20 degrees of heading besides; speed, climb, tilt and spin do not.
    names = ['VX', 'VZ', 'r']
    places = [local.NAMES.index(name) for name in names]
    deviations = np.std(drawn, axis=0)[places]
    np.testing.assert_allclose(np.sqrt(np.diag(stated))[places], deviations, rtol=0.05)


def test_a_heading_that_is_hardly_known_turns_velocity_and_attitude_together():
    """A turn about the vertical by an angle small beside 1 changes the velocity by its length
    across, and tilts the disc by the angle times the sine of its slope.
    """
    none = ReleaseErrors(**dict.fromkeys(vars(ERRORS), 1e-9))
    stated = release_covariance(replace(RELEASE, heading=0.0), DISC, none, np.full(3, 1e-9))
    across = np.sqrt(stated[4, 4])
    level = RELEASE.speed * np.cos(np.radians(RELEASE.launch_angle))
    assert across == pytest.approx(np.radians(20.0) * level, rel=1e-4)
    tilt = np.sqrt(stated[6, 6] + stated[7, 7])
    slope = local.disc_axis(release_state(RELEASE, DISC, PLACE, np.array([1.0, 0, 0]))[1])
    assert tilt == pytest.approx(np.radians(20.0) * np.hypot(slope[0], slope[1]), rel=1e-3)
