"""One flight of each figure against two other integrations.

The first is test/reference, written from the paper alone: axes that spin, a rotation matrix, steps
from corner to corner of the table. The second is `paper.crosscheck`, which every run of
`paper_figures` repeats.
"""

import dataclasses

import numpy as np
import pytest

from disc_sim_ros.paper import conditions, crosscheck
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.frames import map_from_paper
from disc_sim_ros.physics.launch import Launch
from paper.computed_figures import FIGURES, example, second_distance
from reference.reference_flight import reference_flight

pytestmark = pytest.mark.xdist_group('figures')  # computed once

CLOSE = 0.01  # m, what the figures promise
STEP = 1e-3  # s; five times the default of the reference, with an error of 5e-6 m (docstring)


def by_reference(flight):
    """Return a flight as test/reference integrates it, in map axes."""
    disc, launch, setup = flight.setup.disc, flight.launch, flight.setup
    described = {
        'mass': disc.mass,
        'diameter': disc.diameter,
        'area': disc.area,
        'I_axial': disc.inertia_axial,
        'I_diametral': disc.inertia_diametral,
        'C_Lp': disc.C_Lp,
        'C_Mq': disc.C_Mq,
        'C_Nr': disc.C_Nr,
        'linear': {
            'CL0': disc.linear.CL_0,
            'CLa': disc.linear.CL_alpha,
            'CD0': disc.linear.CD_0,
            'CDa': disc.linear.CD_alpha,
            'alpha0': disc.linear.alpha_0,
            'CM0': disc.linear.CM_0,
            'CMa': disc.linear.CM_alpha,
        },
    }
    if disc.table is not None:
        columns = disc.table.coefficients.T.tolist()
        described['table'] = {'alpha_deg': disc.table.alpha_deg.tolist()}
        described['table'] |= dict(zip(('CL', 'CD', 'CM'), columns, strict=True))
    thrown = dataclasses.asdict(launch)
    thrown['alpha'] = thrown.pop('angle_of_attack')
    return reference_flight(
        described,
        thrown,
        model=setup.model,
        aero=setup.aero or disc.aero,
        moment_axes=setup.moment_axes,
        control=(flight.control.C_L, flight.control.C_M, flight.control.C_N),
        air_density=setup.air.density,
        gravity=setup.air.gravity,
        ground=flight.landed,
        duration=flight.time + 1.0,
        t_eval=flight.trajectory.t,
        max_step=STEP,
    )


@pytest.mark.paper
@pytest.mark.parametrize('key', FIGURES)
def test_a_flight_of_each_figure_agrees_with_both(key):
    flight = example(key)
    there = by_reference(flight)
    apart = np.linalg.norm(
        map_from_paper(flight.trajectory.position) - there['position_m'], axis=1
    )
    assert len(apart) == len(flight.trajectory) > 10
    assert apart.max() < CLOSE
    assert there['landed'] == flight.landed
    if flight.landed:
        assert there['flight_time_s'] == pytest.approx(flight.time, abs=1e-3)
    assert second_distance(key) < CLOSE


@pytest.mark.parametrize(
    'changes',
    [{'inertia_diametral': 1.3e-3}, {'C_Lp': -0.5}, {'C_Nr': -5e-3}, {'area': 0.0595}],
    ids=str,
)
def test_the_second_integration_notices_another_disc(changes):
    """The check must be able to fail: fly one disc, integrate another."""
    launch = Launch(roll_rate=8.0)
    flown = fly(
        launch, Setup(disc=conditions.frisbee()), duration=3.0, ground=False, sample_rate=50.0
    )
    other = Setup(disc=dataclasses.replace(conditions.frisbee(), **changes))
    assert crosscheck.largest_distance(flown) < 1e-3
    assert crosscheck.largest_distance(dataclasses.replace(flown, setup=other)) > CLOSE


@pytest.mark.parametrize('options', [{'model': 'precession'}, {'moment_axes': 'wind'}], ids=str)
def test_the_second_integration_refuses_other_models_and_axes(options):
    flight = fly(Launch(), Setup(disc=conditions.frisbee(), **options), sample_rate=10.0)
    with pytest.raises(ValueError, match='axes 3'):
        crosscheck.largest_distance(flight)
