"""Symmetries of a flight: heading, mirror image, moving air, and the mark on the rim."""

import dataclasses
import itertools

import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import MODELS, MOMENT_AXES, Setup, fly
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from sample_discs import FRISBEE

# A controlled flight with a wobble: everything that could break a symmetry is switched on.
LAUNCH = Launch(
    speed=17.0, pitch=12.0, roll=8.0, angle_of_attack=3.0, sideslip=5.0, spin=45.0,
    roll_rate=3.0, pitch_rate=-2.0, height=1.5,
)  # fmt: skip
CONTROL = Control(C_L=0.01, C_M=-0.02, C_N=0.001)
WIND = (1.5, -2.0, 0.5)  # the paper's axes
ROUNDING = 1e-9  # m after 4 s: 4000 steps of 1e-16 relative, grown by an instability of 1/s


def sampled(launch, setup, control=CONTROL):
    return fly(
        launch, setup, control=control, duration=3.0, ground=False, sample_rate=50
    ).trajectory


def turned(vectors, degrees):
    """Vectors in earth axes, turned right about Z (down)."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y, z = np.moveaxis(np.asarray(vectors, dtype=float), -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


@pytest.mark.parametrize(('model', 'axes'), list(itertools.product(MODELS, MOMENT_AXES)))
@pytest.mark.parametrize('disc', ['frisbee', 'frisbee_linear', 'frisbee_roll_moment'])
def test_negated_spin_and_roll_mirror_the_path(disc, model, axes):
    setup = Setup(
        disc=disc_file.load_disc(disc), model=model, moment_axes=axes, wind=Wind(mean=WIND)
    )
    there = sampled(LAUNCH, setup)
    mirrored = dataclasses.replace(
        LAUNCH, roll=-LAUNCH.roll, sideslip=-LAUNCH.sideslip, spin=-LAUNCH.spin,
        roll_rate=-LAUNCH.roll_rate,
    )  # fmt: skip
    wind = Wind(mean=(WIND[0], -WIND[1], WIND[2]))
    control = CONTROL._replace(C_L=-CONTROL.C_L, C_N=-CONTROL.C_N)
    back = sampled(mirrored, dataclasses.replace(setup, wind=wind), control)
    # Every product only changes its sign, so the mirror image is exact to the last bit.
    assert np.array_equal(back.position, there.position * (1, -1, 1))
    assert np.array_equal(back.spin, -there.spin)
    assert np.array_equal(back.alpha, there.alpha)
    assert abs(there.position[-1, 1]) > 0.1  # the flight does turn


@pytest.mark.parametrize('yaw', [30.0, 90.0, -135.0, 360.0])
def test_the_heading_turns_the_path_and_changes_nothing_else(yaw):
    setup = Setup(disc=FRISBEE, wind=Wind(mean=WIND))
    ahead = sampled(LAUNCH, setup)
    wind = Wind(mean=tuple(turned(WIND, yaw).tolist()))
    aside = sampled(dataclasses.replace(LAUNCH, yaw=yaw), dataclasses.replace(setup, wind=wind))
    assert_allclose(aside.position, turned(ahead.position, yaw), atol=ROUNDING)
    assert_allclose(aside.alpha, ahead.alpha, atol=ROUNDING)


@pytest.mark.parametrize('model', MODELS)
def test_a_flight_in_wind_is_the_still_air_flight_in_moving_axes(model):
    """Galilean invariance: only the velocity relative to the air matters."""
    still = Setup(disc=FRISBEE, model=model)
    moving = dataclasses.replace(still, wind=Wind(mean=WIND))
    rest = sampled(LAUNCH, still)
    # A launch has the velocity over the ground, so that the same airspeed needs another state.
    launch = _Shifted(**dataclasses.asdict(LAUNCH))
    carried = sampled(launch, moving)
    shift = rest.t[:, None] * np.array(WIND)
    assert_allclose(carried.position, rest.position + shift, atol=ROUNDING)
    assert_allclose(carried.attitude, rest.attitude, atol=ROUNDING)
    assert_allclose(carried.airspeed, rest.airspeed, atol=ROUNDING)


class _Shifted(Launch):
    """A launch with the velocity of the wind added."""

    __slots__ = ()

    def state(self):
        s = Launch.state(self)
        return s._replace(VX=s.VX + WIND[0], VY=s.VY + WIND[1], VZ=s.VZ + WIND[2])


def test_the_spin_angle_at_release_does_not_matter():
    """A disc is the same after any turn about its axis.

    Of a level disc, a yaw of -90 degrees with a sideslip of 90 degrees is the same throw as zero
    of both, with the rates turned. The steps are fine, because the error of a step depends on the
    axes: within it the quaternion has not quite unit length.
    """
    setup = Setup(disc=FRISBEE, step=1e-3)
    launch = dataclasses.replace(LAUNCH, pitch=0.0, roll=0.0, sideslip=0.0)
    marked = dataclasses.replace(
        launch, yaw=-90.0, sideslip=90.0, roll_rate=-LAUNCH.pitch_rate, pitch_rate=LAUNCH.roll_rate
    )
    a, b = sampled(launch, setup), sampled(marked, setup)
    assert_allclose(b.position, a.position, atol=ROUNDING)
    assert_allclose(b.normal, a.normal, atol=ROUNDING)
