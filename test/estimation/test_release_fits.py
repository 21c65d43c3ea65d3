"""Releases that are fitted side by side end where each ends alone."""

from dataclasses import replace

import numpy as np
import pytest

from disc_sim_ros.estimation.identification.fitting import starts
from disc_sim_ros.estimation.identification.observations import GYRO
from disc_sim_ros.estimation.identification.problem import Problem
from disc_sim_ros.estimation.identification.release_fits import fit_release, fit_releases
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from estimation.synthetic_sessions import drawn, problem_of


@pytest.fixture(scope='module')
def problems() -> list[Problem]:
    """One throw with a gyro, from some of its first states."""
    base = Setup(disc=load_disc('ultrastar'))
    _, _, ((throw, _),) = drawn(701, base, (GYRO,), count=1)
    problem = problem_of([throw.until(0.8)], base)
    return [
        replace(problem, throws=(problem.throws[0].starting_at(state),))
        for state in starts(throw)[::31]
    ]


def test_each_ends_where_it_ends_alone(problems):
    """Some end before others, and some steps need more damping than others."""
    first = [problem.means for problem in problems]
    together = fit_releases(problems, 0, first)
    alone = [fit_release(problem, 0, problem.means) for problem in problems]
    assert len({cost for _, cost in alone}) > 3
    for (here, cost), (here_alone, cost_alone) in zip(together, alone, strict=True):
        assert cost == cost_alone
        assert np.array_equal(here, here_alone)


def test_the_cost_is_that_of_where_it_ends(problems):
    problem = problems[0]
    here, cost = fit_release(problem, 0, problem.means)
    _, again = fit_release(problem, 0, here, 1)
    assert again <= cost < fit_release(problem, 0, problem.means, 1)[1]
    assert not np.array_equal(here, problem.means)
    assert np.array_equal(here[: problem.shared], problem.means[: problem.shared])
