"""A search that begins with measurements that count little, and lets them count more and more.

Where only the turning is measured, a few directions of the parameters move the measurements by
hundreds of standard deviations and others by one. Gauss-Newton steps with the whole weight follow
the first and go anywhere in the others: discs that no catalogue has, thrown at -30 degrees to the
air, whose errors cancel. Such places are local minima. If the noise is taken as a hundred times
too large, what is believed of a disc and of a throw holds these directions until the others fit;
the weights then grow step by step, and each minimum is a start for the next.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification.coefficients import NAMES
from disc_sim_ros.estimation.identification.fitting import (
    BETTER,
    Progress,
    promising,
    retry_releases,
    starts,
)
from disc_sim_ros.estimation.identification.normal_equations import (
    Block,
    costs_of_throw,
    each,
    linear_blocks,
    reduced,
)
from disc_sim_ros.estimation.identification.problem import FINE, ROUGH, Problem
from disc_sim_ros.estimation.identification.throws import RELEASE_SIZE
from disc_sim_ros.quantities import COEFFICIENTS

_FACTORS = (100.0, 30.0, 10.0, 5.0, 3.0, 2.0)  # on the noise, before the noise itself
_TRUSTED = 3.0  # factor down to which beliefs may be drawn, and steps rough
# How far drawn beliefs lie from those of the problem, in its standard deviations, and how many of
# the parameters of a release keep theirs, because the gyro measures them.
_COEFFICIENT_SPREAD, _RELEASE_SPREAD, _TURNING = 1.0, 0.5, 4
_ENOUGH = 0.1  # decrease of the cost that ends the search with one factor, in half squares
_ENOUGH_AT_LAST = 1e-2
_STEPS, _LAST_STEPS = 15, 40
_RETRIES = 3
_BEGINNING = 0.6  # s of each throw by which a release is chosen, before errors of a disc add up
# On the diagonal of the normal equations, times what was best in the step before. All are flown
# side by side, which takes about a third of the time of the derivatives.
_DAMPINGS = 10.0 ** np.arange(-3.0, 5.0)
_FIRST_DAMPING, _MOST_DAMPING = 1e-3, 1e6
_SINGULAR = 1e-13  # keeps an equation solvable whose parameters nothing tells apart


@dataclass(frozen=True, eq=False)
class End:
    """The end of a graduated search.

    Attributes:
        problem: With changes counted from the best first state of each throw.
        x: Its parameters, shape (p,).
        cost: Half the robust sum of squares.
    """

    problem: Problem
    x: FloatArray
    cost: float


def search(
    problem: Problem,
    shared: FloatArray,
    progress: Progress | None = None,
    stage: str = '',
    drawn: np.random.Generator | None = None,
) -> End:
    """Return what a graduated search finds from shared parameters and the best of many releases.

    The throws may still be in wrong minima of their releases: see `settled`.

    Args:
        problem: The problem; while the noise is large, it is solved in rough steps, and then in
            FINE ones: rough steps can misread a gyro by more than its noise, and then favour a
            wrong minimum.
        shared: First shared parameters, shape (shared,).
        progress: Called with the stage, a count and the cost.
        stage: For `progress`.
        drawn: Draws other beliefs, which the search heeds while the noise is large; None for
            those of the problem. From other shared parameters it comes to the same end.
    """
    first = problem.means.copy()
    first[: problem.shared] = np.clip(shared, *problem.bounds)
    beginnings = tuple(throw.until(_BEGINNING) for throw in problem.throws)
    early = replace(problem, throws=beginnings, margin=ROUGH)
    throws = []
    for k, throw in enumerate(problem.throws):
        (state,) = promising(early, k, problem.here(k, first), starts(throw), 1)
        throws.append(throw.starting_at(state))
    around = replace(problem, throws=tuple(throws), margin=FINE)
    first[problem.shared :] = 0.0
    rough = replace(around, margin=ROUGH)
    if drawn is not None:
        rough = _with_other_beliefs(rough, drawn)
    x, cost = first, np.inf
    for count, factor in enumerate((*_FACTORS, 1.0)):
        last = factor == 1.0
        x, cost = _joint(
            _with_noise(rough if factor > _TRUSTED else around, factor),
            x,
            _LAST_STEPS if last else _STEPS,
            _ENOUGH_AT_LAST if last else _ENOUGH,
        )
        if progress is not None:
            progress(stage, count + 1, cost)
    return End(around, x, cost)


def settled(end: End) -> End:
    """Return an end of which no throw fits better with a release from another attitude."""
    for _ in range(_RETRIES):
        again = _with_other_releases(end, range(len(end.problem.throws)))
        if again is None or again.cost > end.cost - BETTER:
            break
        end = again
    return end


def search_without(
    problem: Problem,
    shared: FloatArray,
    k: int,
    progress: Progress | None = None,
    stage: str = '',
) -> End:
    """Return what a graduated search finds that meets throw `k` only at its end.

    A throw whose release is in a wrong minimum bends the coefficients, and those keep it there.

    Args:
        problem: The problem.
        shared: First shared parameters, shape (shared,).
        k: Number of the throw.
        progress: Called with the stage, a count and the cost.
        stage: For `progress`.
    """
    others = [i for i in range(len(problem.throws)) if i != k]
    rest = replace(problem, throws=tuple(problem.throws[i] for i in others))
    result = search(rest, shared, progress, stage)
    throws = list(result.problem.throws)
    throws.insert(k, problem.throws[k])
    x = np.insert(
        result.x, np.full(RELEASE_SIZE, problem.own(k).start), problem.throws[k].believed
    )
    whole = End(replace(problem, throws=tuple(throws), margin=FINE), x, np.inf)
    return _with_other_releases(whole, (k,)) or whole


def _with_other_releases(end: End, which: Sequence[int]) -> End | None:
    """Return what is found with releases from all attitudes; None if none of them is better."""
    around, x, better = retry_releases(end.problem, end.x, which, thorough=True)
    if not better:
        return None
    return End(around, *_joint(around, x, _LAST_STEPS, _ENOUGH_AT_LAST))


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


def _joint(
    problem: Problem, x: FloatArray, most_steps: int, enough: float
) -> tuple[FloatArray, float]:
    """Minimise over all parameters at once, and return them with the cost.

    Levenberg-Marquardt steps. `fitting.solve` fits all releases anew for each set of shared
    parameters: that takes five times as long for a step, and pays where the valley is narrow.
    """
    cost = float(_costs(problem, x[np.newaxis])[0])
    damping = _FIRST_DAMPING
    for _ in range(most_steps):
        blocks = linear_blocks(problem, x)
        gain = 0.0
        while gain <= 0.0 and damping < _MOST_DAMPING:
            tried = np.stack([_moved(problem, x, blocks, d * damping) for d in _DAMPINGS])
            costs = _costs(problem, tried)
            i = int(np.argmin(costs))
            gain = cost - float(costs[i])
            damping *= float(_DAMPINGS[i]) if gain > 0.0 else float(_DAMPINGS[-1])
        if gain <= 0.0:
            break
        x, cost = tried[i], float(costs[i])
        if gain < enough:
            break
    return x, cost


def _moved(problem: Problem, x: FloatArray, blocks: list[Block], damping: float) -> FloatArray:
    """Return the parameters after one damped step."""
    equations = reduced(problem, x, blocks, damping)
    return equations.moved(equations.step(_SINGULAR))


def _costs(problem: Problem, several: FloatArray) -> FloatArray:
    """Return half the robust sums of squares of sets of parameters, shape (m,), from (m, p)."""
    n = problem.shared

    def of_throw(k: int) -> FloatArray:
        own = several[:, problem.own(k)]
        return costs_of_throw(problem, k, np.concatenate([several[:, :n], own], axis=1))

    priors = (several[:, :n] - problem.means[:n]) / problem.shared_deviations
    costs: FloatArray = 0.5 * (priors**2).sum(axis=1) + sum(each(problem, of_throw))
    return costs
