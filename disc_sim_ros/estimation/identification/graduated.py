"""A search that begins with measurements that count little, and lets them count more and more.

Where only the turning is measured, a few directions of the parameters move the measurements by
hundreds of standard deviations and others by one. Gauss-Newton steps with the whole weight follow
the first and go anywhere in the others: discs that no catalogue has, thrown at -30 degrees to the
air, whose errors cancel. Such places are local minima. If the noise is taken as a thousand times
too large, what is believed of a disc and of a throw holds these directions until the others fit;
the weights then grow step by step, and each minimum is a start for the next.

Which minimum a search ends in is decided while the noise is between a hundred and ten times too
large. At ten times wrong minima already fit visibly worse, and are few: that is where searches
are compared, and where releases are tried again.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification.coefficients import NAMES
from disc_sim_ros.estimation.identification.fitting import (
    BETTER,
    promising,
    retry_releases,
    starts,
)
from disc_sim_ros.estimation.identification.joint import minimised
from disc_sim_ros.estimation.identification.problem import FINE, ROUGH, Problem
from disc_sim_ros.estimation.identification.throws import RELEASE_SIZE
from disc_sim_ros.quantities import COEFFICIENTS

HALFWAY = 10.0  # factor on the noise at which searches are compared
_FACTORS = (1000.0, 300.0, 100.0, 60.0, 30.0, 20.0, HALFWAY)
_LAST_FACTORS = (7.0, 5.0, 4.0, 3.0, 2.0, 1.0)
_TRUSTED = 30.0  # factor down to which beliefs may be drawn
# How far drawn beliefs lie from those of the problem, in its standard deviations, and how many of
# the parameters of a release keep theirs, because the gyro measures them.
_COEFFICIENT_SPREAD, _RELEASE_SPREAD, _TURNING = 1.0, 0.5, 4
_RETRIES = 3
# Decrease of the cost for which a release is exchanged while the noise is that of HALFWAY: costs
# are a hundredth of those at the end, and a wrong release may cost a few tenths.
_BETTER_HALFWAY = 0.1
_BEGINNING = 0.6  # s of each throw by which a release is chosen, before errors of a disc add up


@dataclass(frozen=True, eq=False)
class End:
    """The end of a graduated search, or where it is halfway.

    Attributes:
        problem: With changes counted from the best first state of each throw.
        x: Its parameters, shape (p,).
        cost: Half the robust sum of squares.
        factor: On the noise of the problem, with which `x` is best.
    """

    problem: Problem
    x: FloatArray
    cost: float
    factor: float


Report = Callable[[int, float], None]  # called with the number of a step and the cost


def begun(
    problem: Problem, drawn: np.random.Generator | None = None, report: Report | None = None
) -> End:
    """Return what a search finds while the noise comes down to HALFWAY times its value.

    All steps are FINE: rough ones can misread a gyro by more than its noise, and then favour a
    wrong minimum.

    Args:
        problem: The problem.
        drawn: Draws other beliefs, which the search heeds while the noise is very large; None for
            those of the problem.
        report: Called after each step of the noise.

    Returns:
        The end. Its throws may still be in wrong minima of their releases.
    """
    around = _with_first_releases(problem)
    other = around if drawn is None else _with_other_beliefs(around, drawn)
    x, cost = around.means.copy(), np.inf
    for number, factor in enumerate(_FACTORS, 1):
        x, cost = minimised(_with_noise(other if factor > _TRUSTED else around, factor), x)
        if report is not None:
            report(number, cost)
    return End(around, x, cost, HALFWAY)


def finished(halfway: End, report: Report | None = None) -> End:
    """Return the end of a search that has begun, with the noise of the problem.

    Releases are tried again first: see `settled`. `report` is called after each step of the noise.
    """
    end = settled(halfway)
    for number, factor in enumerate(_LAST_FACTORS, 1):
        x, cost = minimised(_with_noise(end.problem, factor), end.x)
        end = End(end.problem, x, cost, factor)
        if report is not None:
            report(number, cost)
    return end


def settled(end: End) -> End:
    """Return an end of which no throw fits better with a release from another attitude.

    A throw in a wrong minimum bends the coefficients, and those keep it there.
    """
    every = range(len(end.problem.throws))
    enough = BETTER if end.factor == 1.0 else _BETTER_HALFWAY
    for _ in range(_RETRIES):
        noisy = _with_noise(end.problem, end.factor)
        noisy, x, better = retry_releases(noisy, end.x, every, thorough=True, better=enough)
        if not better:
            break
        x, cost = minimised(noisy, x)
        if cost > end.cost - enough:
            break
        end = End(replace(end.problem, throws=noisy.throws), x, cost, end.factor)
    return end


def _with_first_releases(problem: Problem) -> Problem:
    """Return the problem with changes counted from the start of each throw that fits best."""
    first = problem.means
    beginnings = tuple(throw.until(_BEGINNING) for throw in problem.throws)
    early = replace(problem, throws=beginnings, margin=ROUGH)
    throws = []
    for k, throw in enumerate(problem.throws):
        (state,) = promising(early, k, problem.here(k, first), starts(throw), 1)
        throws.append(throw.starting_at(state))
    return replace(problem, throws=tuple(throws), margin=FINE)


def _with_other_beliefs(problem: Problem, generator: np.random.Generator) -> Problem:
    """Return the problem with means of coefficients and releases that are drawn."""
    values = problem.base.values
    bounds = np.array([(COEFFICIENTS[n].lowest, COEFFICIENTS[n].highest) for n in NAMES]).T
    step = problem.prior.coefficients * generator.standard_normal(len(values))
    moved = np.clip(values + _COEFFICIENT_SPREAD * step, *bounds) - values
    throws = []
    for throw in problem.throws:
        away = np.linalg.solve(throw.information, generator.standard_normal(RELEASE_SIZE))
        away[-_TURNING:] = 0.0
        throws.append(replace(throw, believed=throw.believed + _RELEASE_SPREAD * away))
    prior = replace(problem.prior, moved=moved)
    return replace(problem, throws=tuple(throws), prior=prior)


def _with_noise(problem: Problem, factor: float) -> Problem:
    return replace(problem, noise={kind: factor * n for kind, n in problem.noise.items()})
