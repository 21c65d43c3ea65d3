"""The integration: its order, its landing and its samples."""

import dataclasses

import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.errors import ConfigError, IntegrationError
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.kernels.equations import (
    Control,
    Moment,
    Velocity,
    derivative,
    precession_rates,
)
from disc_sim_ros.physics.launch import Launch
from sample_discs import AS_PRINTED, FRISBEE

WOBBLING = Launch(speed=14.0, pitch=20.0, spin=50.0, roll_rate=3.0, pitch_rate=1.0, height=2.0)
STILL = Velocity(0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ('model', 'coarsest'), [('exact', 1024), ('constant_spin', 1024), ('precession', 64)]
)
def test_order_four(model, coarsest):
    """Errors of halved steps against a far finer step, with smooth (linear) aerodynamics.

    Errors follow the order once the steps resolve the nutation, here at 100 rad/s. Without
    nutation the steps must be long, so that errors are above rounding.
    """
    setup = Setup(disc=FRISBEE, aero='linear', model=model, wind=Wind(mean=(1.0, 2.0, 0.0)))

    def end(steps):
        refined = dataclasses.replace(setup, step=1 / steps)
        return np.array(fly(WOBBLING, refined, duration=1.0, ground=False).end[:10])

    exact = end(16 * coarsest)
    errors = [np.linalg.norm(end(n * coarsest) - exact) for n in (1, 2, 4)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(4.0, abs=0.2)
    assert errors[-1] > 1e-13  # above rounding, where an order can be seen


def test_corners_of_the_table_reduce_the_order_but_not_the_accuracy():
    """A step of 10 ms is accurate to a tenth of a millimetre."""
    fine = fly(Launch(), Setup(disc=FRISBEE, step=1e-4)).position
    coarse = fly(Launch(), Setup(disc=FRISBEE, step=1e-2)).position
    assert_allclose(coarse, fine, atol=1e-4)


def derivative_of(launch, setup, control):
    return derivative(launch.state(), STILL, setup.plant, control)


@pytest.mark.parametrize('seed', range(5))
def test_quaternion_rate_is_the_rate_of_the_attitude(seed):
    """R(t + h) against R(t) exp(h omega~) with the matrix exponential of Rodrigues."""
    rng = np.random.default_rng(seed)
    roll, pitch, yaw = rng.uniform(-180, 180, 3)
    p, q = rng.uniform(-20, 20, 2)
    launch = Launch(pitch=pitch, roll=roll, yaw=yaw, roll_rate=p, pitch_rate=q)
    s = launch.state()
    rate = derivative_of(launch, Setup(disc=FRISBEE), Control())
    h = 1e-6
    e = np.array(s[6:10])
    e_dot = np.array(rate[6:10])
    numeric = (frames.rotation_matrix(e + h * e_dot) - frames.rotation_matrix(e - h * e_dot)) / (
        2 * h
    )
    omega = np.array([[0, 0, q], [0, 0, -p], [-q, p, 0]])  # eqn 13 with r = 0: despun axes
    # Central difference: (h w)^2 / 6 is 1e-10 relative, rounding 1e-16 / h = 1e-10 absolute.
    assert_allclose(numeric, frames.rotation_matrix(e) @ omega, atol=1e-7)
    # The length of the quaternion stays. Seven roundings of 1.1e-16 each, three of a component of
    # e_dot and four of the scalar product, in terms whose sizes add up to |e| |e_dot| at most.
    assert abs(e @ e_dot) < 7 * 1.2e-16 * np.linalg.norm(e_dot)


def test_gyroscopic_terms_do_no_work():
    """In vacuum I omega . omega' is 0: the paper's omega~ I omega is perpendicular to omega."""
    setup = Setup(disc=FRISBEE)
    launch = Launch(speed=0.0, spin=50.0, roll_rate=7.0, pitch_rate=-4.0)
    rate = derivative_of(launch, setup, Control())
    I_x = FRISBEE.inertia_diametral
    power = I_x * (7.0 * rate.p - 4.0 * rate.q) + FRISBEE.inertia_axial * 50.0 * rate.r
    assert abs(power) < 1e-15
    assert abs(rate.p) > 100.0  # the terms are not zero


def test_precession_rates_balance_the_moments():
    m = Moment(L=0.3, M=-0.2, N=0.0, D_xx=-0.05, D_xy=0.01, D_yy=-0.04)
    for r in (30.0, -30.0, 0.0):
        p, q = precession_rates(r, m, FRISBEE.inertia_axial)
        H = r * FRISBEE.inertia_axial
        assert_allclose(m.L + m.D_xx * p + m.D_xy * q, q * H, atol=1e-12)
        assert_allclose(m.M + m.D_xy * p + m.D_yy * q, -p * H, atol=1e-12)
    assert precession_rates(0.0, m._replace(D_xx=0.0, D_xy=0.0, D_yy=0.0), 1.0) == (0.0, 0.0)


@pytest.mark.parametrize('step', [1e-3, 7.3e-3, 0.02])
def test_landing_is_where_the_trajectory_crosses_the_ground(step):
    setup = Setup(disc=FRISBEE, step=step)
    landed = fly(WOBBLING, setup)
    assert landed.landed
    assert abs(landed.end.Z) < 1e-8  # at 10 m/s a nanosecond is 1e-8 m
    through = fly(WOBBLING, setup, duration=landed.time, ground=False)
    # The last step of both is the same shorter step.
    assert_allclose(through.end, landed.end, rtol=1e-12, atol=1e-12)


def test_a_release_on_the_ground_lands_only_if_it_sinks_or_comes_back():
    setup = Setup(disc=FRISBEE)
    up = fly(Launch(pitch=5.0), setup)
    assert up.time > 0.5
    down = fly(Launch(pitch=-5.0), setup)
    assert (down.landed, down.time, down.range, down.apex) == (True, 0.0, 0.0, 0.0)
    # A hop of less than one step is a flight too.
    hop = fly(Launch(speed=1e-3, pitch=90.0), setup)
    assert hop.time == pytest.approx(2 * 1e-3 / 9.81, rel=1e-3)


def test_samples_are_evenly_timed_and_do_not_change_the_flight():
    setup = Setup(disc=FRISBEE, wind=Wind(turbulence=10.0, seed=4))
    bare = fly(WOBBLING, setup)
    flight = fly(WOBBLING, setup, sample_rate=333.0)
    assert flight.end == bare.end
    assert flight.time == bare.time
    t = flight.trajectory
    assert np.array_equal(t.t, np.arange(len(t)) / 333.0)
    assert flight.time - t.t[-1] < 1 / 333.0
    # Samples are of one trajectory: those of another rate agree at equal times.
    other = fly(WOBBLING, setup, sample_rate=999.0).trajectory
    assert_allclose(t.rows, other.rows[::3][: len(t)], rtol=1e-9, atol=1e-9)


def test_velocity_is_the_derivative_of_position():
    t = fly(WOBBLING, Setup(disc=FRISBEE), sample_rate=1000.0).trajectory
    central = (t.position[2:] - t.position[:-2]) / 2e-3
    # h^2 / 6 of the jerk, below 600 m/s^3 in the wobble.
    assert_allclose(central, t.velocity[1:-1], atol=1e-4)


def test_the_apex_is_the_highest_point():
    flight = fly(WOBBLING, Setup(disc=FRISBEE), sample_rate=10000.0)
    heights = -flight.trajectory.position[:, 2]
    # Between samples of 0.1 ms it rises by g t^2 / 2 = 5e-8 m at most.
    assert flight.apex == pytest.approx(heights.max(), abs=1e-7)
    assert flight.apex >= heights.max()


def test_a_flight_ends_at_its_duration_to_the_bit():
    flight = fly(WOBBLING, Setup(disc=FRISBEE, step=3e-3), duration=1.0)
    assert not flight.landed
    assert flight.time == 1.0
    assert_allclose(
        flight.end[:3],
        fly(WOBBLING, Setup(disc=FRISBEE, step=1e-3), duration=1.0).end[:3],
        atol=1e-6,
    )


def test_a_step_too_long_for_the_spin_is_refused():
    setup = Setup(disc=FRISBEE, step=0.02)
    with pytest.raises(ConfigError, match=r'step.*0\.02.*at most 0\.0139 s'):
        fly(Launch(spin=100.0), setup)
    fly(Launch(spin=100.0), dataclasses.replace(setup, model='precession'))


def test_a_flight_beyond_finite_numbers_raises_an_error():
    """A drag beyond all bounds gives an error, not NaN."""
    endless = dataclasses.replace(FRISBEE.linear, CD_0=1e300)
    disc = dataclasses.replace(FRISBEE, linear=endless, aero='linear')
    with pytest.raises(IntegrationError, match='shorter step'):
        fly(Launch(speed=200.0, angle_of_attack=90.0), Setup(disc=disc), duration=1.0)


def test_every_disc_flies():
    for name in disc_file.disc_names():
        assert fly(Launch(height=1.0), Setup(disc=disc_file.load_disc(name))).landed


def test_a_step_too_long_for_the_speed_is_refused():
    """Even at a slow spin, as damping and pitch stiffness grow with speed."""
    fast = Launch(speed=60.0, pitch=5.0, spin=1.0)
    with pytest.raises(ConfigError, match=r'step.*60 m/s'):
        fly(fast, Setup(disc=AS_PRINTED, step=0.1))
    fine = fly(fast, Setup(disc=AS_PRINTED, step=1e-3), duration=1.0, ground=False)
    for step in (5e-3, 1e-2):  # allowed, and then accurate to 10 mm
        coarse = fly(fast, Setup(disc=AS_PRINTED, step=step), duration=1.0, ground=False)
        assert_allclose(coarse.end[:3], fine.end[:3], atol=1e-2)
