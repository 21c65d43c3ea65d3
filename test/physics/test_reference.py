"""Landings against an independent integration of the same model (test/reference).

The reference has a formulation of its own (axes that spin, a rotation matrix, Dormand-Prince 8
from corner to corner of the table). It was written from the paper alone, without the package.
"""

import dataclasses

import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.frames import map_from_paper, paper_from_map
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from reference.cases import LAUNCHES
from reference.reference_flight import reference_flight
from sample_discs import FRISBEE

pytestmark = pytest.mark.xdist_group('figures')  # with other tests that compile the reference

STEP = 5e-4  # s


def ours(case, **options):
    """Fly a case of the reference with the package."""
    given, launch = dict(case['options']), dict(case['launch'])
    disc = dataclasses.replace(
        FRISBEE,
        mass=case['disc']['mass'],
        inertia_axial=case['disc']['I_axial'],
        inertia_diametral=case['disc']['I_diametral'],
        C_Lp=case['disc']['C_Lp'],
        C_Mq=case['disc']['C_Mq'],
        C_Nr=case['disc']['C_Nr'],
    )
    launch['angle_of_attack'] = launch.pop('alpha')
    setup = Setup(
        disc=disc,
        model=given['model'],
        aero=given['aero'],
        moment_axes=given['moment_axes'],
        wind=Wind(mean=tuple(paper_from_map(given['wind_map']).tolist())),
        step=STEP,
    )
    return fly(Launch(**launch), setup, control=Control(*given['control']), **options)


@pytest.mark.parametrize('case', LAUNCHES, ids=lambda case: case['name'])
def test_landing(case):
    """Within 2 mm and 0.2 ms at a step of 0.5 ms."""
    there = reference_flight(case['disc'], case['launch'], **case['options'])
    here = ours(case)
    assert here.landed
    assert there['landed']
    assert here.time == pytest.approx(there['flight_time_s'], abs=2e-4)
    assert np.linalg.norm(here.position - there['landing_position_m']) < 2e-3


@pytest.mark.parametrize('case', LAUNCHES[::5], ids=lambda case: case['name'])
def test_trajectory(case):
    """The whole flight agrees, not only its end: position, velocity, attitude and spin."""
    flight = ours(case, sample_rate=20.0)
    t = flight.trajectory
    there = reference_flight(case['disc'], case['launch'], **case['options'], t_eval=t.t)
    assert_allclose(map_from_paper(t.position), there['position_m'], atol=2e-3)
    assert_allclose(map_from_paper(t.velocity), there['velocity_m_s'], atol=1e-2)
    assert_allclose(t.normal, there['normal'], atol=1e-3)
    assert_allclose(t.spin, there['spin_rad_s'], atol=1e-3)
    assert_allclose(t.alpha, there['alpha_rad'], atol=1e-3)


def test_the_cases_cover_the_envelope():
    options = [case['options'] for case in LAUNCHES]
    launches = [case['launch'] for case in LAUNCHES]
    assert len(LAUNCHES) == 40
    assert {o['model'] for o in options} == {'exact', 'constant_spin', 'precession'}
    assert {o['moment_axes'] for o in options} == {'body', 'wind'}
    assert {o['aero'] for o in options} == {'table', 'linear'}
    assert any(any(o['wind_map']) for o in options)
    assert any(any(o['control']) for o in options)
    assert any(launch['roll_rate'] for launch in launches)
    spins = [launch['spin'] for launch in launches]
    assert min(spins) < 0.0 < max(spins)
    assert 0.0 in spins
