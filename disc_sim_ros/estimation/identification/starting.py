"""Where an identification begins: the best of several starts, with their releases."""

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification import graduated, information
from disc_sim_ros.estimation.identification.fitting import (
    ALIKE,
    Alone,
    Best,
    Progress,
    Solution,
    fitted_alone,
    retry_releases,
    solve,
)
from disc_sim_ros.estimation.identification.problem import Problem
from disc_sim_ros.threads import Threads

_SPREAD = 0.5  # of the prior: how far other starts lie
_STEPS = 12
# While residuals are not white, so many rounds of graduated searches with drawn beliefs follow, of
# each of which one is finished.
ROUNDS, DRAWN = 4, 3
_NEAR = 60.0  # half squares above the best end: what two releases in wrong minima may cost
_RELEASES = 'releases'
_BEST, _FURTHER, _FURTHER_BEST = 'best search', 'further search', 'best further search'


@dataclass(frozen=True)
class Search:
    """How to search from several sets of coefficients.

    Attributes:
        starts: Number of sets.
        seed: Of all but the first.
        progress: Called with a stage, a count and the cost.
    """

    starts: int
    seed: int
    progress: Progress | None = None

    def coefficients(self, problem: Problem, first: FloatArray) -> list[FloatArray]:
        """Return the sets, each of shape (free,): the first, and some about the base disc."""
        generator = np.random.default_rng(self.seed)
        n = len(problem.free)
        step = _SPREAD * problem.shared_deviations[:n]
        others = range(1, self.starts)
        return [first, *(problem.means[:n] + step * generator.standard_normal(n) for _ in others)]


def stages(starts: int, *, turning: bool) -> dict[str, float]:
    """Return the stages of a beginning in their order, for a guess of the time left.

    Args:
        starts: Number of sets of coefficients.
        turning: Whether no more than the turning was measured.

    Returns:
        Each with the time that it took in simulated sessions of five throws [s of CPU].
    """
    if turning:
        searches = dict.fromkeys(_searches(starts), 2.0)
        return {**searches, _BEST: 18.0, _stage(0, starts): 0.3}
    return {_RELEASES: 4.0, **{_stage(number, starts): 1.0 for number in range(starts)}}


def _stage(number: int, starts: int) -> str:
    return f'start {number + 1} of {starts}'


def _searches(count: int, kind: str = 'search') -> list[str]:
    return [f'{kind} {number} of {count}' for number in range(1, count + 1)]


def started(problem: Problem, search: Search) -> Iterator[tuple[Problem, FloatArray]]:
    """Yield the problem around the best start of each throw, and first parameters.

    Each pair is better than the one before, so that Ctrl-C loses only what was not better. Its
    steps are as fine as those of the search.
    """
    if problem.turns_only:
        yield from ((end.problem, end.x) for end in _graduated(problem, search))
    else:
        yield fitted_apart(problem, search)


def fitted_apart(problem: Problem, search: Search) -> tuple[Problem, FloatArray]:
    """Return the best start of throws that are fitted one by one first, as `started` yields it."""
    done = 0

    def start(k: int) -> Alone:
        nonlocal done
        result = fitted_alone(problem, k)
        done += 1
        if search.progress is not None:
            search.progress(_RELEASES, done, float('nan'))
        return result

    with closing(Threads(most=len(problem.throws))) as pool:
        fitted = pool.run((partial(start, k) for k in range(len(problem.throws))), leave=True)
    problem = replace(problem, throws=tuple(alone.throw for alone in fitted))
    x = problem.means.copy()
    x[: problem.shared] = np.median([alone.shared for alone in fitted], axis=0)
    least = min(alone.loss for alone in fitted)
    good = [alone for alone in fitted if alone.loss < ALIKE * least]
    problem = replace(problem, margin=problem.roughest)
    return (problem, x) if len(good) == len(fitted) else _agreeing(problem, x, good)


def _agreeing(
    problem: Problem, x: FloatArray, good: Sequence[Alone]
) -> tuple[Problem, FloatArray]:
    """Return the problem and parameters of the throw that explains the others best.

    Some throws alone end in a wrong local minimum: attitudes that nothing measured have many. With
    the coefficients of a throw that fits, the releases of the others are found.
    """
    n = problem.shared
    ends: list[tuple[Solution, Problem]] = []
    for shared in (x[:n], *(alone.shared for alone in good)):
        tried = problem.means.copy()
        tried[:n] = shared
        around, tried, _ = retry_releases(problem, tried, range(len(problem.throws)))
        solution = solve(around, tried, most_steps=_STEPS)
        ends.append((solution, around))
    best, around = min(ends, key=lambda end: end[0].cost)
    return around, best.x


def _graduated(problem: Problem, search: Search) -> Iterator[graduated.End]:
    """Yield the best end of graduated searches so far, see `graduated`.

    In a wrong minimum residuals are usually correlated. Then more searches follow.
    """
    generator = np.random.default_rng(search.seed)

    def report(stage: str) -> graduated.Report | None:
        return None if search.progress is None else partial(search.progress, stage)

    def best(
        sources: Sequence[np.random.Generator | None], names: Sequence[str], name_of_best: str
    ) -> graduated.End:
        begun = [
            graduated.begun(problem, source, report(name))
            for source, name in zip(sources, names, strict=True)
        ]
        return graduated.finished(min(begun, key=lambda each: each.cost), report(name_of_best))

    first = best([None] + [generator] * (search.starts - 1), _searches(search.starts), _BEST)
    end = graduated.settled(first)
    yield end
    further = _searches(ROUNDS * DRAWN, _FURTHER)
    for k in range(0, len(further), DRAWN):
        if information.correlation(end.problem, end.x).is_chance:
            break
        other = best([generator] * DRAWN, further[k : k + DRAWN], _FURTHER_BEST)
        if other.cost < end.cost + _NEAR:
            other = graduated.settled(other)
        if other.cost < end.cost:
            end = other
            yield end


def from_starts(problem: Problem, x: FloatArray, search: Search, best: Best) -> Solution:
    """Return the best solution from several sets of coefficients.

    Args:
        problem: The problem.
        x: The first set with its releases, shape (p,).
        search: The other sets; a graduated search has been there already.
        best: Updated with each better point.
    """
    n = len(problem.free)
    solutions = []
    for number, free in enumerate(search.coefficients(problem, x[:n])):
        if number and problem.turns_only:
            break
        start = np.concatenate([free, x[n:]])
        stage = _stage(number, search.starts)
        solutions.append(
            solve(
                problem,
                start,
                most_steps=_STEPS,
                best=best,
                progress=search.progress,
                stage=stage,
            )
        )
    return min(solutions, key=lambda solution: solution.cost)
