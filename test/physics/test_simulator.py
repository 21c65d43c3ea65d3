"""The stepwise simulator: the same flight as `fly` to the bit, with control on the way."""

import dataclasses
import itertools
import math

import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.errors import ConfigError, IntegrationError
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import MODELS, Setup, fly
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from sample_discs import FRISBEE, VACUUM

LAUNCH = Launch(roll_rate=2.0, height=1.0)
GUSTY = Wind(mean=(1.0, 2.0, 0.0), turbulence=10.0, seed=5)


@pytest.mark.parametrize(
    ('model', 'wind', 'chunk'), list(itertools.product(MODELS, (Wind(), GUSTY), (1, 7, 10_000)))
)
def test_any_number_of_steps_at_a_time_gives_the_same_flight(model, wind, chunk):
    setup = Setup(disc=FRISBEE, model=model, wind=wind, step=1e-3)
    control = Control(C_L=0.01)
    whole = fly(LAUNCH, setup, control=control, sample_rate=1000.0)
    sim = FlightSimulator(setup, LAUNCH.state())
    sim.control = control
    states = []
    while not sim.landed:
        sim.advance(chunk)
        states.append(sim.state)
    assert sim.touch_time == whole.time
    assert sim.touch == whole.end
    if chunk == 1:
        flown = np.array(states[:-1])
        assert np.array_equal(flown, whole.trajectory.rows[1:, 1:15])


@pytest.mark.parametrize(
    ('roll', 'pitch', 'yaw'), [(25, 30, 76), (36, 51, -31), (-34, 27, -16), (-28, 13, 16)]
)
def test_a_tilted_release_is_completed_once(roll, pitch, yaw):
    """A second normalisation would change the last bit of these quaternions."""
    launch = Launch(roll=roll, pitch=pitch, yaw=yaw, height=5.0)
    setup = Setup(disc=FRISBEE, step=1e-3)
    sim = FlightSimulator(setup, launch.state())
    while not sim.landed:
        sim.advance(50)
    assert sim.touch == fly(launch, setup).end


def test_a_landed_disc_lies_still():
    sim = FlightSimulator(Setup(disc=FRISBEE), LAUNCH.state())
    sim.advance(10_000)
    resting = sim.state
    assert sim.steps == 10_000
    assert (resting.Z, resting.VX, resting.VY, resting.VZ, resting.r) == (0.0,) * 5
    assert resting[6:10] == sim.touch[6:10]
    sim.advance(100)
    assert sim.state == resting
    assert sim.observe() == (0.0,) * 12


def test_control_inputs_act_from_the_next_step():
    sim = FlightSimulator(Setup(disc=FRISBEE, air=VACUUM), LAUNCH.state())
    sim.advance(100)
    spin = sim.state.r
    sim.control = Control(N=0.001)
    assert sim.state.r == spin
    sim.advance(50)
    sim.control = Control()
    sim.advance(50)
    # Linear in time, so that RK4 is exact.
    assert sim.state.r == pytest.approx(spin + 0.001 / FRISBEE.inertia_axial * 0.05, rel=1e-13)


def test_wind_changes_at_once_and_keeps_its_seed():
    sim = FlightSimulator(Setup(disc=FRISBEE), LAUNCH.state())
    sim.advance(10)
    sim.set_wind(Wind(mean=(0.0, 3.0, 0.0), seed=9))
    assert tuple(sim.wind) == (0.0, 3.0, 0.0)
    assert sim.setup.wind.seed == 0
    with pytest.raises(ConfigError, match='turbulence'):
        sim.set_wind(Wind(turbulence=5.0))


def test_observation_is_the_derivative_of_the_flight():
    sim = FlightSimulator(Setup(disc=FRISBEE, step=1e-4), LAUNCH.state())
    sim.control = Control(C_L=0.02, C_N=0.001)
    sim.advance(1000)
    before, observation = sim.state, sim.observe()
    sim.advance(1)
    after = np.subtract(sim.state, before) / 1e-4
    # One-sided over 0.1 ms: half of the second derivative, nutation at 60 rad/s of 100 rad/s^2.
    assert_allclose(observation[:3], after[3:6], atol=2e-2)
    assert_allclose(observation[3:6], after[10:13], atol=0.5)
    assert max(abs(x) for x in observation[3:6]) > 5.0


def test_loads_are_force_and_moment_of_the_motion():
    """m dV/dt - m g in body axes is the force; I domega/dt + gyroscopic terms is the moment."""
    from disc_sim_ros.physics import frames

    sim = FlightSimulator(Setup(disc=FRISBEE), LAUNCH.state())
    sim.advance(500)
    observation, s = sim.observe(), sim.state
    R = frames.rotation_matrix(s[6:10])
    force = FRISBEE.mass * (np.array(observation[:3]) - (0.0, 0.0, 9.81))
    assert_allclose(R.T @ force, observation[6:9], atol=1e-12)
    I_x, I_z = FRISBEE.inertia_diametral, FRISBEE.inertia_axial
    moment = (
        I_x * observation.p_dot + s.q * s.r * I_z,
        I_x * observation.q_dot - s.p * s.r * I_z,
        I_z * observation.r_dot,
    )
    assert_allclose(observation[9:12], moment, atol=1e-14)


def test_a_flight_beyond_finite_numbers_stops_at_its_last_finite_state():
    endless = dataclasses.replace(FRISBEE.linear, CD_0=1e300)
    disc = dataclasses.replace(FRISBEE, linear=endless, aero='linear')
    sim = FlightSimulator(Setup(disc=disc), Launch(speed=200.0, angle_of_attack=90.0).state())
    with pytest.raises(IntegrationError, match='shorter step'):
        sim.advance(10)
    assert all(math.isfinite(x) for x in sim.state)


def test_a_release_underground_is_refused():
    with pytest.raises(ConfigError, match='height'):
        FlightSimulator(Setup(disc=FRISBEE), Launch(height=-1.0).state())
    FlightSimulator(Setup(disc=FRISBEE), Launch(height=-1.0).state(), ground=False)


def test_long_flights_draw_more_gusts():
    setup = Setup(disc=FRISBEE, wind=GUSTY, step=0.01)
    sim = FlightSimulator(setup, Launch().state(), ground=False)
    for _ in range(30):
        sim.advance(100)
    whole = fly(Launch(), setup, duration=30.0, ground=False)
    assert sim.state == whole.end
