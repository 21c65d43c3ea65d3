"""Flights as a tracker sees them are those of `fly_sampled`."""

import numpy as np
import pytest

from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import SLOWING, Setup
from disc_sim_ros.physics.frames import rotation_matrix
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.sampled import default_row, fly_sampled
from disc_sim_ros.physics.tracked import Tracker

LAUNCH = Launch(speed=17.0, pitch=10.0, roll=5.0, spin=60.0, height=1.3)


def throws(n: int, setup: Setup) -> tuple[np.ndarray, np.ndarray]:
    states = np.tile(np.array(LAUNCH.state()), (n, 1))
    states[:, 3:6] += np.random.default_rng(0).normal(0.0, 0.5, (n, 3))
    return states, np.tile(default_row(setup), (n, 1))


@pytest.mark.parametrize('disc', ['ultrastar', 'frisbee'])
def test_tracks_are_those_of_sampled_flights(disc):
    """The same polynomials in another order of operations: equal but for rounding."""
    setup = Setup(disc=load_disc(disc), model=SLOWING)
    states, rows = throws(11, setup)
    times = np.arange(100) / 120.0
    tracks = Tracker(setup, 0.02).fly(states, rows, times, 15.0)
    whole = fly_sampled(states, rows, setup, times, step=0.02, duration=15.0)
    sights = np.moveaxis(tracks.sights, 3, 1).reshape(-1, len(times), 6)[:11]
    axes = [[rotation_matrix(s[6:10])[:, 2] for s in of] for of in whole.states]
    assert sights[:, :, :3] == pytest.approx(whole.states[:, :, :3], abs=1e-12)
    assert sights[:, :, 3:] == pytest.approx(np.array(axes), abs=1e-12)
    assert np.array_equal(tracks.last, whole.states[:, -1])
    assert np.array_equal(tracks.ends, whole.ends)
    assert np.array_equal(tracks.landing[:, 2], whole.time)


def test_without_a_duration_no_landing_is_looked_for():
    setup = Setup(disc=load_disc('ultrastar'), model=SLOWING)
    states, rows = throws(3, setup)
    tracks = Tracker(setup, 0.02).fly(states, rows, np.array([0.0, 0.5]), 0.0)
    assert np.isnan(tracks.landing).all()
    assert np.isfinite(tracks.last).all()


def test_spin_slows_down_as_in_the_exact_model():
    """The moment about the axis does not depend on the wobble to first order."""
    times = np.array([0.0, 2.0])
    spins = []
    for model in ('exact', SLOWING):
        setup = Setup(disc=load_disc('ultrastar'), model=model)
        states, rows = throws(1, setup)
        spins.append(fly_sampled(states, rows, setup, times, step=0.002, duration=0.0).states)
    exact, slowing = (s[0, -1, 12] for s in spins)
    assert slowing == pytest.approx(exact, rel=1e-3)
    assert slowing < 0.97 * LAUNCH.spin
