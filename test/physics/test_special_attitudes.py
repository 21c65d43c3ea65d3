"""The debugging flights that the paper names, and every corner of the envelope.

The paper names: release at rest, horizontal and vertical launch at zero angle of attack, and an
angle of attack of +-90 degrees. Predictions are from simple physics, without the equations of
motion.
"""

import dataclasses
import itertools
import math

import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.flight import MODELS, MOMENT_AXES, Setup, fly
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from sample_discs import AS_PRINTED, FRISBEE

pytestmark = pytest.mark.paper

G = 9.81
RHO = 1.225
WEIGHT = FRISBEE.mass * G


def drag_at(degrees):
    """C_Drag of the table at one of its rows."""
    row = np.argmin(np.abs(np.degrees(FRISBEE.table.alpha) - degrees))
    return FRISBEE.table.coefficients[row, 1]


def free(launch, duration=4.0, *, setup=None, rate=200.0):
    setup = setup or Setup(disc=FRISBEE, step=1e-3)
    return fly(launch, setup, duration=duration, ground=False, sample_rate=rate).trajectory


@pytest.mark.parametrize(('model', 'axes'), list(itertools.product(MODELS, MOMENT_AXES)))
@pytest.mark.parametrize('roll', [0.0, 180.0])
@pytest.mark.parametrize('spin', [0.0, 31.416, -31.416])
def test_release_at_rest_falls_flat_at_terminal_velocity(model, axes, roll, spin):
    """Flat fall: V = V_t tanh(g t / V_t) with the drag of +90 or, upside down, -90 degrees."""
    setup = Setup(disc=FRISBEE, model=model, moment_axes=axes, step=1e-3)
    t = free(Launch(speed=0.0, pitch=0.0, roll=roll, spin=spin), setup=setup)
    V_t = math.sqrt(2 * WEIGHT / (RHO * FRISBEE.area * drag_at(90.0 if roll == 0.0 else -90.0)))
    assert_allclose(t.velocity[:, 2], V_t * np.tanh(G * t.t / V_t), atol=1e-9)
    assert np.all(t.position[:, :2] == 0.0)  # no direction is preferred
    assert np.all(t.rates[:, :2] == 0.0)


@pytest.mark.parametrize('pitch', [20.0, 90.0])
def test_release_at_rest_from_a_tilt_slides_to_its_low_side(pitch):
    """The disc falls, and lift and drag push it towards its low side: backwards."""
    t = free(Launch(speed=0.0, pitch=pitch), 1.0)
    early = t.t < 0.02  # airspeed below 0.2 m/s: dynamic pressure 0.02 Pa, force 0.1 % of weight
    assert_allclose(t.position[early, 2], 0.5 * G * t.t[early] ** 2, rtol=2e-3, atol=1e-12)
    if pitch == 20.0:
        assert t.position[-1, 0] < -0.1


def test_horizontal_launch_at_zero_angle_of_attack():
    """At first: drag by C_Drag(0), a climb or sink by C_Lift(0) q S - m g, a roll to the right.

    C_M(0) < 0 is nose down; a gyroscope answers with roll, p = -M / (r I_z) > 0.
    """
    V = 19.0
    t = free(Launch(speed=V, pitch=0.0), 0.3, rate=1000.0)
    C_Lift, C_Drag, C_M = FRISBEE.table.coefficients[np.argmin(np.abs(FRISBEE.table.alpha))]
    qS = 0.5 * RHO * V**2 * FRISBEE.area
    start = (t.velocity[4] - t.velocity[0]) / t.t[4]
    # In 4 ms V falls by 0.2 % and alpha changes by 0.01 degrees: 0.5 % of the lift.
    assert_allclose(start[0], -C_Drag * qS / FRISBEE.mass, rtol=5e-3)
    assert_allclose(start[2], G - C_Lift * qS / FRISBEE.mass, atol=0.005 * G)
    assert C_M < 0.0
    assert np.all(t.euler[20:, 0] > 0.0)
    assert t.position[-1, 1] > 0.0


@pytest.mark.parametrize(('pitch', 'sign'), [(90.0, -1.0), (-90.0, 1.0)])
def test_vertical_launch_at_zero_angle_of_attack(pitch, sign):
    """Edge first straight up or down: m dV/dt = -C_Drag(0) q S -+ m g along the path.

    Lift by C_Lift(0) pushes the disc towards its top side: backward (up) or forward (down).
    """
    V = 15.0
    t = free(Launch(speed=V, pitch=pitch), 0.2, rate=1000.0)
    C_Lift, C_Drag, _ = FRISBEE.table.coefficients[np.argmin(np.abs(FRISBEE.table.alpha))]
    qS = 0.5 * RHO * V**2 * FRISBEE.area
    start = (t.velocity[4] - t.velocity[0]) / t.t[4]
    assert_allclose(start[2], G - sign * C_Drag * qS / FRISBEE.mass, rtol=5e-3)
    assert_allclose(start[0], sign * C_Lift * qS / FRISBEE.mass, rtol=0.03)
    assert_allclose(start[1], 0.0, atol=1e-3)


@pytest.mark.parametrize(('alpha', 'pitch'), [(90.0, 0.0), (-90.0, 0.0), (90.0, 90.0)])
def test_flat_side_first(alpha, pitch):
    """The disc only slows down, dV/dt = -k V^2, on a straight line."""
    launch = Launch(speed=15.0, pitch=pitch, angle_of_attack=alpha)
    setup = Setup(disc=FRISBEE, air=Air(gravity=0.0), step=1e-3)
    t = free(launch, 2.0, setup=setup)
    k = 0.5 * RHO * FRISBEE.area * drag_at(alpha) / FRISBEE.mass
    along = np.array(launch.state()[3:6]) / 15.0
    assert_allclose(t.velocity @ along, 15.0 / (1 + k * 15.0 * t.t), rtol=1e-9)
    across = t.position - np.outer(t.position @ along, along)
    # A level disc has no rounding across; on a tilted one, the force along rounding fades.
    assert_allclose(across, 0.0, atol=0.0 if pitch == 0.0 else 1e-9)


@pytest.mark.parametrize('disc', disc_file.disc_names())
@pytest.mark.parametrize('model', MODELS)
def test_every_corner_is_finite_and_bounded(disc, model):
    """Airspeed is bounded by the energy of the launch; the attitude remains a rotation."""
    setup = Setup(disc=disc_file.load_disc(disc), model=model, step=2e-3)
    of_axes = {axes: dataclasses.replace(setup, moment_axes=axes) for axes in MOMENT_AXES}
    flown = []
    for speed, pitch, roll, alpha, spin, axes in itertools.product(
        (0.0, 25.0), (-90.0, 0.0, 90.0), (0.0, 180.0), (-90.0, 0.0, 90.0, 180.0),
        (0.0, -40.0), MOMENT_AXES,
    ):  # fmt: skip
        launch = Launch(
            speed=speed, pitch=pitch, roll=roll, angle_of_attack=alpha, spin=spin, height=5.0
        )
        flown.append(free(launch, 1.5, setup=of_axes[axes], rate=20.0))
    assert np.all(np.isfinite([t.rows for t in flown]))
    position, velocity, attitude = (
        np.array([getattr(t, name) for t in flown])
        for name in ('position', 'velocity', 'attitude')
    )
    assert_allclose(np.linalg.norm(attitude, axis=2), 1.0, atol=1e-12)
    energy = 0.5 * np.sum(velocity**2, axis=2) + G * (-position[:, :, 2])
    # Still air only takes energy from the path; the spin returns none without a coefficient that
    # couples the two.
    assert np.all(np.diff(energy, axis=1) < 1e-9 * (1 + energy[:, :1]))


def test_a_disc_carried_by_the_wind_falls_freely():
    """At the speed of the wind there is no airspeed and no aerodynamic force."""
    setup = Setup(disc=FRISBEE, wind=Wind(mean=(5.0, 0.0, 0.0)))
    t = free(Launch(speed=5.0, pitch=0.0, angle_of_attack=0.0), 0.01, setup=setup, rate=1000.0)
    assert t.airspeed[0] == 0.0
    assert np.all(np.isfinite(t.rows))
    assert_allclose(t.velocity[-1], [5.0, 0.0, G * 0.01], atol=1e-4)


@pytest.mark.parametrize('alpha', [90.0, -90.0])
def test_damping_and_control_act_where_the_flow_has_no_direction(alpha):
    """Flat side first, damping acts on a wobble, and control about the disc's own x axis."""
    launch = Launch(speed=15.0, pitch=0.0, angle_of_attack=alpha, spin=40.0, roll_rate=2.0)
    t = free(launch, 0.3, setup=Setup(disc=AS_PRINTED, air=Air(gravity=0.0)))
    wobble = np.hypot(t.rates[:, 0], t.rates[:, 1])
    assert wobble[-1] < 0.3 * wobble[0]
    still = dataclasses.replace(launch, roll_rate=0.0, spin=0.0)
    setup = Setup(disc=AS_PRINTED, air=Air(gravity=0.0), step=1e-5)
    end = fly(still, setup, duration=2e-4, ground=False, control=Control(C_L=0.05)).end
    L = 0.05 * 0.5 * RHO * 15.0**2 * AS_PRINTED.area * AS_PRINTED.diameter
    # The disc rolls by 2e-6 rad, 2 % of the roll at which the flow has a direction again.
    assert end.p == pytest.approx(L / AS_PRINTED.inertia_diametral * 2e-4, rel=0.03)
    assert end.q == pytest.approx(0.0, abs=0.03 * end.p)
