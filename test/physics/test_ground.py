"""Where a disc touches the ground: with its centre, or with its rim."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.environment import Air
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.kernels import rk4
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator

DISC = disc_file.load_disc('ultrastar')
RADIUS = DISC.diameter / 2
VACUUM = Air(density=0.0)


def rim_heights(state, radius):
    """Return the heights of points on the rim, by another library [m]."""
    turn = Rotation.from_quat((state.e1, state.e2, state.e3, state.e0))
    angle = np.linspace(0.0, 2 * np.pi, 7201)
    points = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    return -(state.Z + turn.apply(points)[:, 2])


@pytest.mark.parametrize('tilt', [0.0, 10.0, 45.0, 90.0, 135.0, 180.0])
def test_a_tilted_disc_falls_in_a_vacuum_until_its_rim_touches(tilt):
    """z = h - g t^2 / 2 with a constant attitude: the rim touches at h = R |sin tilt|."""
    launch = Launch(speed=0.0, pitch=0.0, roll=tilt, height=1.0)
    flight = fly(launch, Setup(disc=DISC, air=VACUUM))
    height = RADIUS * math.sin(math.radians(tilt))
    assert flight.landed
    assert flight.position[2] == pytest.approx(height, abs=1e-9)
    assert flight.time == pytest.approx(math.sqrt(2 * (1.0 - height) / 9.81), abs=1e-9)


@pytest.mark.parametrize('launch', [
    Launch(height=1.0),
    Launch(height=1.5, roll=25.0, pitch=5.0, roll_rate=8.0, pitch_rate=-3.0),
    Launch(height=0.5, pitch=60.0, speed=8.0),
], ids=['straight', 'wobble', 'steep'])  # fmt: skip
def test_the_lowest_point_of_the_rim_is_at_the_ground(launch):
    flight = fly(launch, Setup(disc=DISC), sample_rate=200.0)
    # The lowest of 7201 points is at most R (pi / 7200)^2 / 2 above the lowest of all, 1.3e-8 m.
    assert rim_heights(flight.end, RADIUS).min() == pytest.approx(0.0, abs=2e-8)
    t = flight.trajectory
    last = State(*t.rows[-1, 1:15])
    assert rim_heights(last, RADIUS).min() > 0.0  # and not earlier
    centre = fly(launch, Setup(disc=DISC, ground_contact='centre'))
    assert 0.0 < centre.time - flight.time < 0.1
    assert centre.position[2] == 0.0


def test_the_rate_of_the_depth_is_its_finite_difference():
    setup = Setup(disc=DISC)
    sim = FlightSimulator(setup, Launch(height=5.0, roll=30.0, roll_rate=6.0).state())
    before, dt = None, setup.fixed_step
    for _ in range(200):
        sim.advance(1)
        after = sim.state
        if before is not None:
            slope = (rk4.depth(after, RADIUS) - rk4.depth(before, RADIUS)) / dt
            mean = (rk4.sinking(after, RADIUS) + rk4.sinking(before, RADIUS)) / 2
            # The error of the trapezoidal rule: dt^2 / 12 by the third derivative, R w^3 at the
            # nutation of about 65 rad/s with a tilt rate of 6 rad/s.
            assert slope == pytest.approx(mean, abs=dt**2 / 12 * RADIUS * 65**3)
        before = after


@pytest.mark.parametrize('height', [0.0, 0.02])
def test_a_disc_released_with_its_rim_below_the_ground_flies_out(height):
    flight = fly(Launch(height=height, pitch=15.0), Setup(disc=DISC))
    assert flight.landed
    assert flight.time > 1.0
    assert rim_heights(flight.end, RADIUS).min() == pytest.approx(0.0, abs=2e-8)


def test_a_disc_that_never_clears_the_ground_lands_on_its_centre():
    launch = Launch(speed=0.0, pitch=0.0, roll=90.0, height=0.05)
    flight = fly(launch, Setup(disc=DISC, air=VACUUM))
    assert flight.time == pytest.approx(math.sqrt(2 * 0.05 / 9.81), abs=1e-9)
    assert flight.position[2] == pytest.approx(0.0, abs=1e-9)


def test_simulator_and_ensemble_land_as_the_flight():
    rolls = np.linspace(-40.0, 40.0, 19)
    setup = Setup(disc=DISC, step=1e-3)
    ends = fly_many({'roll': rolls, 'height': 1.0}, setup)
    for i, roll in enumerate(rolls):
        launch = Launch(roll=float(roll), height=1.0)
        flight = fly(launch, setup, sample_rate=0.0)
        assert ends.states[i].tolist() == list(flight.end)
        assert ends.z[i] == flight.position[2] > 0.0
        sim = FlightSimulator(setup, launch.state())
        while not sim.landed:
            sim.advance(1)
        assert sim.touch == flight.end
        assert sim.touch_time == flight.time
        assert flight.end.Z == sim.state.Z  # it stays where it touched


def test_the_disc_says_what_touches_unless_the_setup_does():
    for name in disc_file.disc_names():
        disc = disc_file.load_disc(name)
        of_the_paper = name.startswith(('frisbee', 'flat_plate'))
        assert disc.ground_contact == ('centre' if of_the_paper else 'rim'), name
    assert disc_file.load_disc('11/5/-1/3').ground_contact == 'rim'
    assert Setup(disc=DISC).plant.rim == RADIUS
    assert Setup(disc=DISC, ground_contact='centre').plant.rim == 0.0
    again = disc_file.disc_from_document('again', disc_file.disc_document(DISC))
    assert again.ground_contact == 'rim'
    with pytest.raises(ConfigError, match='ground'):
        dataclasses.replace(DISC, ground_contact='edge')
    with pytest.raises(ConfigError, match='ground_contact'):
        Setup(disc=DISC, ground_contact='edge')
