"""Flights with a solution in closed form, and conserved quantities."""

import dataclasses
import math

import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.physics import frames
from disc_sim_ros.physics.environment import Air
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.kernels.equations import DISC, DISC_AIR, DISC_BODY, Control
from disc_sim_ros.physics.launch import Launch
from sample_discs import FRISBEE, NO_GRAVITY, VACUUM, constant_moment, drag_only

WOBBLING = Launch(speed=12.0, pitch=20.0, roll=-15.0, spin=60.0, roll_rate=4.0, pitch_rate=-3.0)


def free(launch, setup, duration, rate=100.0, control=None):
    extra = {} if control is None else {'control': control}
    flight = fly(launch, setup, duration=duration, ground=False, sample_rate=rate, **extra)
    return flight.trajectory


def angular_momentum(t, disc):
    """In earth axes, shape (n, 3)."""
    body = t.rates * (disc.inertia_diametral, disc.inertia_diametral, disc.inertia_axial)
    return np.einsum('nij,nj->ni', frames.rotation_matrix(t.attitude), body)


@pytest.mark.parametrize('spin', [60.0, -60.0, 12.0])
@pytest.mark.parametrize('ratio', [0.5, 0.518, 0.8])
def test_torque_free_disc_nutates_at_the_analytic_rate(spin, ratio):
    """Symmetric top without moments: Goldstein, Classical Mechanics, 3rd ed., section 5.6.

    In despun axes p + i q turns at (I_z / I_x) r, clockwise from above with the spin.
    """
    disc = dataclasses.replace(FRISBEE, inertia_diametral=ratio * FRISBEE.inertia_axial)
    launch = dataclasses.replace(WOBBLING, spin=spin)
    t = free(launch, Setup(disc=disc, air=NO_GRAVITY), 1.0)
    phase = spin / ratio * t.t
    start = complex(launch.roll_rate, launch.pitch_rate)
    expected = start * np.exp(1j * phase)
    # The phase error of RK4 is (h w)^5 / 120 per step: 2e-7 at w = 120 rad/s and 1 ms, 2e-4 in
    # 1000 steps.
    assert_allclose(t.rates[:, 0] + 1j * t.rates[:, 1], expected, atol=2e-4 * abs(start) * 1.2)
    assert_allclose(t.spin, spin, rtol=0.0, atol=0.0)


@pytest.mark.parametrize('model', ['exact', 'constant_spin'])
def test_energy_and_angular_momentum_are_conserved_in_vacuum(model):
    t = free(WOBBLING, Setup(disc=FRISBEE, air=VACUUM, model=model), 2.0)
    H = angular_momentum(t, FRISBEE)
    # As above, the phase error of nutation tilts H by at most 4e-4 of its transverse part, 0.04.
    assert_allclose(H, np.broadcast_to(H[0], H.shape), atol=2e-5 * np.linalg.norm(H[0]))
    kinetic = 0.5 * FRISBEE.mass * np.sum(t.velocity**2, axis=1)
    height = -t.position[:, 2]
    energy = kinetic + FRISBEE.mass * 9.81 * height
    # The trajectory is a parabola, which RK4 integrates exactly: rounding only.
    assert_allclose(energy, energy[0], rtol=1e-12)
    # RK4 damps the rotation by (h w)^6 / 144 per step, at most 2e-8: 4e-5 of the wobble's energy.
    I_x, I_z = FRISBEE.inertia_diametral, FRISBEE.inertia_axial
    rotation = 0.5 * (t.rates**2) @ (I_x, I_x, I_z)
    assert_allclose(rotation, rotation[0], rtol=1e-6)


def test_a_flight_in_vacuum_is_a_parabola_in_every_rotation():
    t = free(WOBBLING, Setup(disc=FRISBEE, air=VACUUM), 2.0)
    expected = t.position[0] + t.t[:, None] * t.velocity[0]
    expected[:, 2] += 0.5 * 9.81 * t.t**2
    assert_allclose(t.position, expected, atol=1e-12)


@pytest.mark.parametrize('height', [0.0, 0.5, 30.0])
def test_ballistic_landing_is_located_to_a_nanosecond(height):
    launch = Launch(speed=20.0, pitch=30.0, height=height)
    flight = fly(launch, Setup(disc=FRISBEE, air=VACUUM, step=0.0173))
    up = 20.0 * 0.5
    t = (up + math.sqrt(up**2 + 2 * 9.81 * height)) / 9.81
    assert flight.landed
    assert abs(flight.time - t) < 1e-9
    assert_allclose(flight.position, [20.0 * math.cos(math.pi / 6) * t, 0.0, 0.0], atol=2e-8)
    assert_allclose(flight.apex, height + up**2 / (2 * 9.81), atol=1e-9)


def test_a_falling_disc_reaches_its_terminal_velocity():
    """Flat fall with constant drag: V = V_t tanh(g t / V_t)."""
    disc = drag_only(FRISBEE, 1.2)
    V_t = math.sqrt(2 * disc.mass * 9.81 / (1.225 * disc.area * 1.2))
    t = free(Launch(speed=0.0, pitch=0.0), Setup(disc=disc), 3.0)
    # RK4 of a smooth equation with a time scale of 0.6 s in steps of 1 ms: 1e-12 relative.
    assert_allclose(t.velocity[:, 2], V_t * np.tanh(9.81 * t.t / V_t), atol=1e-10)
    assert_allclose(t.velocity[:, :2], 0.0, atol=0.0)


def test_drag_alone_slows_a_straight_flight_as_one_over_t():
    """Without gravity dV/dt = -k V^2: V = V_0 / (1 + k V_0 t), x = ln(1 + k V_0 t) / k."""
    disc = drag_only(FRISBEE, 0.5)
    air = Air(gravity=0.0)
    t = free(Launch(speed=20.0, pitch=0.0), Setup(disc=disc, air=air, step=1e-3), 4.0)
    k = 0.5 * 1.225 * disc.area * 0.5 / disc.mass
    assert_allclose(t.velocity[:, 0], 20.0 / (1 + k * 20.0 * t.t), rtol=1e-11)
    assert_allclose(t.position[:, 0], np.log1p(k * 20.0 * t.t) / k, atol=1e-9)


@pytest.mark.parametrize('damping', [0.0, -0.2, -1.4])
@pytest.mark.parametrize('spin', [80.0, -80.0])
def test_gyroscopic_precession(spin, damping):
    """A constant pitching moment M from p = q = 0, with damping D of both rates.

    z = p + i q obeys I_x dz/dt = (D + i r I_z) z + i M, so that z = z_1 (1 - exp(l t)) with
    l = (D + i r I_z) / I_x and z_1 = -i M / (D + i r I_z): undamped p = -M / (r I_z), half of the
    printed eqn 54 and of the other sign.
    """
    V = 15.0
    disc = constant_moment(FRISBEE, 0.01, damping)
    setup = Setup(disc=disc, air=Air(gravity=0.0), step=2e-4)
    t = free(Launch(speed=V, pitch=0.0, spin=spin), setup, 0.4)
    qSc = 0.5 * 1.225 * V**2 * disc.area * disc.diameter
    complex_D = qSc * damping * disc.diameter / (2 * V) + 1j * spin * disc.inertia_axial
    z_1 = -1j * 0.01 * qSc / complex_D
    expected = z_1 * (1 - np.exp(complex_D / disc.inertia_diametral * t.t))
    # In 0.4 s the disc rolls out of the flow by up to 0.05 rad, which turns the axes of the moment
    # by the square of that.
    assert_allclose(t.rates[:, 0] + 1j * t.rates[:, 1], expected, atol=2.5e-3 * abs(z_1))
    if damping == 0.0:
        assert z_1.real == pytest.approx(-0.01 * qSc / (spin * disc.inertia_axial), rel=1e-12)


@pytest.mark.parametrize(
    ('moment', 'pitch', 'roll'),
    [(Control(M=0.01), 0.0, -1.0), (Control(L=0.01), 1.0, 0.0), (Control(M=-0.01), 0.0, 1.0)],
)
def test_a_moment_precesses_the_mean_attitude(moment, pitch, roll):
    """In vacuum the wobble is not damped; its mean over whole nutations is the precession.

    From p = q = 0 the tip of the axis draws a cycloid: its mean rate is M / (r I_z), with no mean
    in the other direction.
    """
    spin = 100.0
    launch = Launch(speed=0.0, pitch=0.0, spin=spin)
    nutations = 20
    duration = nutations * 2 * math.pi / (2 * spin)
    setup = Setup(disc=FRISBEE, air=NO_GRAVITY, step=1e-4)
    flight = fly(launch, setup, duration=duration, ground=False, control=moment)
    phi, theta, _ = frames.euler_from_quaternion([flight.end[6:10]])[0]
    rate = 0.01 / (spin * FRISBEE.inertia_axial)
    angle = rate * duration
    # The axis turns by 0.03 rad: angles add up to terms of third order, 1e-5.
    assert_allclose([theta, phi], [pitch * angle, roll * angle], atol=2e-5)


@pytest.mark.parametrize('axes_of_moment', [DISC, DISC_AIR])
def test_axial_moment_spins_the_disc_up(axes_of_moment):
    control = Control(N=0.01, axes=axes_of_moment)
    setup = Setup(disc=FRISBEE, air=NO_GRAVITY)
    t = free(Launch(speed=10.0, pitch=0.0, spin=10.0), setup, 1.0, control=control)
    assert_allclose(t.spin, 10.0 + 0.01 / FRISBEE.inertia_axial * t.t, rtol=1e-13)
    angle = 10.0 * t.t + 0.5 * 0.01 / FRISBEE.inertia_axial * t.t**2
    assert_allclose(t.spin_angle, angle, rtol=1e-12, atol=1e-12)


def test_a_moment_fixed_in_the_plastic_turns_with_the_spin():
    """p + i q in despun axes: I_x d(p + i q)/dt = i I_z r (p + i q) + L exp(i r t)."""
    spin, L = 40.0, 0.005
    launch = Launch(speed=0.0, pitch=0.0, spin=spin)
    setup = Setup(disc=FRISBEE, air=NO_GRAVITY, step=2e-4)
    t = free(launch, setup, 1.0, control=Control(L=L, axes=DISC_BODY))
    nutation = spin * FRISBEE.inertia_axial / FRISBEE.inertia_diametral
    forced = L / FRISBEE.inertia_diametral / (1j * (spin - nutation))
    expected = forced * (np.exp(1j * spin * t.t) - np.exp(1j * nutation * t.t))
    # Relative phase error (h w)^4 / 120 per step, h w = 0.016: 3e-8 over 5000 steps of 0.016 rad.
    assert_allclose(t.rates[:, 0] + 1j * t.rates[:, 1], expected, atol=1e-6 * abs(forced))


def test_moment_in_air_axes_is_a_moment_in_disc_axes_while_the_flow_is_along_x():
    launch = Launch(speed=10.0, pitch=0.0, spin=30.0)
    setup = Setup(disc=drag_only(FRISBEE, 0.0), air=Air(gravity=0.0))
    ends = [
        fly(launch, setup, duration=0.05, ground=False, control=Control(L=0.001, axes=a)).end
        for a in (DISC, DISC_AIR)
    ]
    assert_allclose(ends[0], ends[1], atol=2e-4)
    turned = dataclasses.replace(launch, sideslip=90.0)
    end = fly(
        turned, setup, duration=0.05, ground=False, control=Control(L=0.001, axes=DISC_AIR)
    ).end
    # With sideslip 90 degrees x3 is the disc's y: the same moment now pitches.
    assert_allclose([end.p, end.q], [-ends[1].q, ends[1].p], rtol=1e-3)
