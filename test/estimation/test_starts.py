"""Releases in wrong local minima: a throw that fits alone shows where the others belong."""

from functools import cache

import pytest

from disc_sim_ros.estimation.identification import starting
from disc_sim_ros.estimation.identification.fitting import ALIKE, fitted_alone
from disc_sim_ros.estimation.identification.normal_equations import cost_of_throw
from disc_sim_ros.estimation.identification.observations import GYRO
from disc_sim_ros.estimation.identification.starting import Search
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from estimation.synthetic_sessions import drawn, problem_of

BASE = Setup(disc=load_disc('ultrastar'))
# Session 303 of `benchmarks/identification.py --kinds gyro`, whose first throw alone ends at a
# climb of 60 degrees, with 15 times the loss of the fifth.
SEED = 303


@pytest.mark.slow
def test_a_throw_in_a_wrong_minimum_is_found_with_the_coefficients_of_one_that_fits(monkeypatch):
    _, _, throws = drawn(SEED, BASE, (GYRO,), count=5)
    problem = problem_of((throws[0][0], throws[4][0]), BASE)
    once = cache(fitted_alone)  # the same fits begin what is tested, and take a third of it
    first, second = (once(problem, k).loss for k in range(2))
    assert first > 5.0 * ALIKE * second  # or this session no longer shows it

    monkeypatch.setattr(starting, 'fitted_alone', once)
    problem, x = starting.fitted_apart(problem, Search(1, 0))
    for k in range(2):
        here = problem.here(k, x)
        # Half a square for each residual of noise alone.
        assert cost_of_throw(problem, k, here) < 0.6 * len(problem.residuals(k, here))
