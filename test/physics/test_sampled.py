"""Flights from any state, sampled at any times: `fly_sampled`."""

import math

import numpy as np
import pytest

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import NO_CONTROL, NO_NOISE, Setup, fly
from disc_sim_ros.physics.kernels import sampling
from disc_sim_ros.physics.kernels.integrator import FLYING, LANDED, LOST
from disc_sim_ros.physics.kernels.jit import COMPILED
from disc_sim_ros.physics.kernels.rk4 import Inputs
from disc_sim_ros.physics.kernels.rows import AT, NAMES
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.sampled import default_row, fly_sampled, good_step

WOBBLING = Launch(
    speed=18.0, pitch=8.0, roll=5.0, spin=60.0, height=1.5, roll_rate=3.0, pitch_rate=-2.0
)
G = 9.81


def batch(n: int, setup: Setup, launch: Launch = WOBBLING) -> tuple[np.ndarray, np.ndarray]:
    """Return n different first states and constants."""
    generator = np.random.default_rng(5)
    states = np.tile(np.array(launch.state()), (n, 1))
    states[:, 3:6] += generator.normal(0.0, 0.5, (n, 3))
    rows = np.tile(default_row(setup), (n, 1))
    rows[:, AT['wind_x']] = generator.normal(0.0, 2.0, n)
    rows[:, AT['drag_offset']] = generator.uniform(0.0, 0.02, n)
    return states, rows


@pytest.mark.skipif(not COMPILED, reason='plain Python has no SIMD registers')
@pytest.mark.parametrize(
    'setup',
    [
        Setup(disc=load_disc('ultrastar')),
        Setup(disc=load_disc('frisbee'), model='precession', ground_contact='rim'),
        Setup(disc=load_disc('frisbee_roll_moment'), wind=Wind(roughness_length=0.01)),
    ],
    ids=['ultrastar', 'precession', 'profile'],
)
def test_lanes_have_the_bits_of_single_flights(setup):
    states, rows = batch(11, setup)  # one whole group of lanes, and a part
    times = np.sort(np.random.default_rng(1).uniform(0.0, 6.0, 50))
    in_lanes = fly_sampled(states, rows, setup, times, step=0.005, duration=20.0)
    single = sampling.Samples(
        np.empty((11, 50, 14)), np.empty(11, np.int64), np.empty(11), np.empty((11, 14))
    )
    inputs = Inputs(NO_CONTROL, setup.wind_data, NO_NOISE)
    grid = sampling.Grid(0.005, 20.0, times)
    space = sampling.sample_space(setup.plant)
    sampling.sample_rows(states, rows, setup.plant, inputs, grid, single, space)

    assert (in_lanes.status == LANDED).all()
    for name in sampling.Samples._fields:
        assert np.array_equal(getattr(single, name), getattr(in_lanes, name))


@pytest.mark.parametrize('disc', ['ultrastar', 'frisbee'])  # rim and centre
def test_the_landing_has_the_bits_of_a_flight(disc):
    setup = Setup(disc=load_disc(disc), step=0.005, wind=Wind(mean=(1.0, -2.0, 0.1)))
    flight = fly(WOBBLING, setup)
    states = np.array(WOBBLING.state())[np.newaxis]
    out = fly_sampled(
        states, default_row(setup)[np.newaxis], setup, np.empty(0), step=0.005, duration=20.0
    )
    assert out.time[0] == flight.time
    assert tuple(out.ends[0]) == tuple(flight.end)


# The errors are far below the noise of cameras (2 cm) and gyros (0.02 rad/s); the coarse
# step is for predictions in real time.
@pytest.mark.parametrize(
    ('margin', 'position', 'attitude', 'rate'), [(10.0, 2e-4, 5e-5, 0.005), (4.0, 5e-3, 1e-3, 0.2)]
)
def test_samples_follow_a_far_finer_flight(margin, position, attitude, rate):
    disc = load_disc('ultrastar')
    fine = fly(WOBBLING, Setup(disc=disc, step=0.0002), sample_rate=77.0)
    setup = Setup(disc=disc)
    step = good_step(setup, 60.0, 20.0, margin=margin)
    rows = default_row(setup)[np.newaxis]
    states = np.array(WOBBLING.state())[np.newaxis]
    out = fly_sampled(states, rows, setup, fine.trajectory.t, step=step, duration=20.0)
    error = np.abs(out.states[0] - fine.trajectory.rows[:, 1:15]).max(axis=0)
    assert error[:3].max() < position
    assert error[6:10].max() < attitude
    assert error[10:13].max() < rate


def test_a_body_without_air_falls_on_a_parabola_through_the_ground():
    setup = Setup(disc=load_disc('frisbee'))
    row = default_row(setup)
    row[AT['air_density']] = 1e-12
    launch = Launch(speed=10.0, pitch=30.0, spin=20.0, height=1.0)
    times = np.array([0.0, 0.1, 0.333, 1.0, 3.0])  # on the ground at 1.19 s
    out = fly_sampled(
        np.array(launch.state())[np.newaxis], row[np.newaxis], setup, times, step=0.01, duration=5
    )
    V_X, V_Z = 10.0 * math.cos(math.radians(30)), -10.0 * math.sin(math.radians(30))
    # 1e-9: density 1e-12 kg/m^3 leaves 1e-12 of the force; the rest is rounding.
    np.testing.assert_allclose(out.states[0, :, 0], V_X * times, atol=1e-9)
    np.testing.assert_allclose(
        out.states[0, :, 2], -1.0 + V_Z * times + 0.5 * G * times**2, atol=1e-9
    )
    landing = (-V_Z + math.sqrt(V_Z**2 + 2.0 * G)) / G
    assert out.status[0] == LANDED
    assert out.time[0] == pytest.approx(landing, abs=1e-9)  # the promise of a landing


def test_a_flight_that_steps_cannot_follow_is_lost_and_others_go_on():
    setup = Setup(disc=load_disc('frisbee'))
    states, rows = batch(3, setup)
    states[1, 12] = 2000.0  # rad/s
    times = np.array([0.0, 0.5])
    out = fly_sampled(states, rows, setup, times, step=0.01, duration=20.0)
    assert out.status.tolist() == [LANDED, LOST, LANDED]
    assert np.isnan(out.states[1]).all()
    assert np.isfinite(out.states[[0, 2]]).all()
    assert np.isfinite(out.ends).all()


def test_a_flight_may_outlast_its_duration():
    setup = Setup(disc=load_disc('frisbee'))
    states, rows = batch(2, setup)
    out = fly_sampled(states, rows, setup, np.array([0.0]), step=0.01, duration=0.5)
    assert out.status.tolist() == [FLYING, FLYING]
    np.testing.assert_allclose(out.time, 0.5)


def test_threads_do_not_change_the_samples():
    setup = Setup(disc=load_disc('frisbee'))
    states, rows = batch(200, setup)
    times = np.linspace(0.0, 1.0, 5)
    one, two = (
        fly_sampled(states, rows, setup, times, step=0.01, duration=20.0, threads=k)
        for k in (1, 2)
    )
    assert np.array_equal(one.states, two.states)
    assert np.array_equal(one.time, two.time)


def test_gusts_and_wrong_shapes_are_refused():
    gusty = Setup(disc=load_disc('frisbee'), wind=Wind(turbulence=1.0))
    setup = Setup(disc=load_disc('frisbee'))
    states, rows = batch(2, setup)
    times = np.array([0.0])
    with pytest.raises(ConfigError, match=r'turbulence.*no gusts'):
        fly_sampled(states, rows, gusty, times, step=0.01, duration=1.0)
    with pytest.raises(ConfigError, match=rf'rows.*\(2, {len(NAMES)}\)'):
        fly_sampled(states, rows[:1], setup, times, step=0.01, duration=1.0)
    with pytest.raises(ConfigError, match=r'times.*ascending'):
        fly_sampled(states, rows, setup, np.array([0.2, 0.1]), step=0.01, duration=1.0)
    with pytest.raises(ConfigError, match=r'states.*\(n, 14\)'):
        fly_sampled(states[0], rows, setup, times, step=0.01, duration=1.0)
