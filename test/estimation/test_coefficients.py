"""Coefficients that throws determine, and discs with other values of them."""

import numpy as np
import pytest

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.identification import coefficients
from disc_sim_ros.estimation.identification.coefficients import NAMES, base_of, disc_with
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.sampled import default_row, fly_sampled

LAUNCH = Launch(speed=18.0, pitch=10.0, roll=5.0, spin=60.0, height=1.3, roll_rate=2.0)


def changed(base: coefficients.Base) -> np.ndarray:
    return base.values * np.array([1.1, 0.9, 1.05, 1.2, 0.8, 1.3, 1.5, 0.7, 0.99])


@pytest.mark.parametrize('name', ['ultrastar', 'wraith', 'frisbee_linear'])
def test_a_disc_with_the_values_of_the_base_is_the_base(name):
    setup = Setup(disc=load_disc(name))
    base = base_of(setup)
    same = disc_with(base, base.values, 'same', '')
    one, other = fly(LAUNCH, setup), fly(LAUNCH, Setup(disc=same))
    assert other.time == pytest.approx(one.time, abs=1e-9)


@pytest.mark.parametrize('name', ['ultrastar', 'frisbee_linear'])
def test_the_coefficients_of_a_changed_disc_are_those_asked_for(name):
    base = base_of(Setup(disc=load_disc(name)))
    values = changed(base)
    disc = disc_with(base, values, 'changed', '')
    again = base_of(Setup(disc=disc)).values
    # Rise and damping are factors on the disc that is the base.
    kept = [i for i, key in enumerate(NAMES) if key not in {'C_D_rise', 'damping'}]
    np.testing.assert_allclose(again[kept], values[kept], rtol=1e-12)
    assert disc.C_Mq == pytest.approx(1.5 * base.disc.C_Mq)


@pytest.mark.parametrize('name', ['ultrastar', 'frisbee_linear'])
def test_rows_fly_as_the_disc_with_the_same_coefficients(name):
    setup = Setup(disc=load_disc(name), step=0.005)
    base = base_of(setup)
    values = changed(base)
    rows = default_row(setup)[np.newaxis]
    coefficients.write_rows(base, values[np.newaxis], rows)
    state = np.array(LAUNCH.state())[np.newaxis]
    out = fly_sampled(state, rows, setup, np.empty(0), step=0.005, duration=20.0)
    flight = fly(LAUNCH, Setup(disc=disc_with(base, values, 'changed', ''), step=0.005))
    assert out.time[0] == pytest.approx(flight.time, abs=1e-9)


def test_negative_drag_and_unknown_names_are_refused():
    base = base_of(Setup(disc=load_disc('ultrastar')))
    values = base.values.copy()
    values[NAMES.index('C_D0')] = -0.1
    with pytest.raises(ConfigError, match=r'C_D0.*least drag'):
        disc_with(base, values, 'bad', '')
    with pytest.raises(ConfigError, match=r'free.*C_X'):
        coefficients.chosen(['C_X'])
    with pytest.raises(ConfigError, match='once'):
        coefficients.chosen(['C_D0', 'C_D0'])
