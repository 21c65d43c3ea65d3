"""Solve the least-squares problem: starts, steps, and the best parameters so far."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
import itertools
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation import local
from disc_sim_ros.estimation.identification.normal_equations import (
    cost_of_throw,
    each,
    linear_blocks,
    reduced,
    robust_loss,
)
from disc_sim_ros.estimation.identification.observations import ATTITUDE, GYRO
from disc_sim_ros.estimation.identification.problem import ROUGH, Problem
from disc_sim_ros.estimation.identification.release_fits import (
    MOST_TRIES,
    SMALL,
    fit_release,
    fit_releases,
)
from disc_sim_ros.estimation.identification.throws import RELEASE_SIZE, Throw
from disc_sim_ros.estimation.lift_coordinates import axis_in_flow

_HOPELESS = 1e-3  # the same as a share of a cost that is far above that of noise alone
KEPT = 3  # starts that are fitted, of those that are tried
_MORE_KEPT = 12  # for a throw that fits worse than others
ALIKE = 2.0  # ratio of the mean losses of two throws above which one is in a wrong minimum
_FIRST_STEPS = 8
_GOING_ON, _MORE_STEPS = 6, 15  # fits of a thorough search that go on, and by how many steps
# Attitudes about the path to start from: angle of attack and roll [degrees].
_ATTACKS, _ROLLS = (-5.0, 5.0, 15.0), (-40.0, -20.0, 0.0, 20.0, 40.0)
_SPIN_ANGLES = 12
_SPINS, _SPIN_STEP = (
    10,
    0.4,
)  # neighbours of a fitted spin rate, each way, and their distance [rad/s]
BETTER = 0.5  # decrease of the cost for which a release is exchanged

Progress = Callable[[str, int, float], None]


@dataclass
class Best:
    """The best parameters so far, kept while a search goes on, so that Ctrl-C loses nothing."""

    x: FloatArray = field(default_factory=lambda: np.empty(0))
    cost: float = math.inf

    def offer(self, x: FloatArray, cost: float) -> None:
        """Keep parameters if they are better."""
        if cost < self.cost:
            self.x, self.cost = x.copy(), cost


@dataclass(frozen=True, eq=False)
class Solution:
    """The end of a search.

    Attributes:
        x: The parameters, shape (p,).
        cost: Half the robust sum of squares.
    """

    x: FloatArray
    cost: float


def solve(
    problem: Problem,
    x0: FloatArray,
    *,
    most_steps: int = 40,
    best: Best | None = None,
    progress: Progress | None = None,
    stage: str = '',
) -> Solution:
    """Minimise the robust sum of squares from `x0`.

    Gauss-Newton with damping on the shared parameters alone: for each set of them that is tried,
    all releases are fitted anew (variable projection). A search over all parameters at once has to
    follow a narrow curved valley; scipy's trust region had not come to its end after 60
    evaluations there, in three of four sessions.

    Args:
        problem: The problem.
        x0: First parameters, shape (p,).
        most_steps: After which the search ends.
        best: Updated with each better point.
        progress: Called with the stage, the step and the cost.
        stage: For `progress`.
    """
    keeper = Best() if best is None else best
    n = problem.shared
    low, high = problem.bounds
    x = x0.copy()
    x[:n] = np.clip(x[:n], low, high)
    x, cost = _released(problem, x)
    damping = 1e-3
    measured = sum(
        len(problem.residuals(k, problem.here(k, x))) for k in range(len(problem.throws))
    )
    for count in range(1, most_steps + 1):
        keeper.offer(x, cost)
        if progress is not None:
            progress(stage, count, cost)
        equations = reduced(problem, x, linear_blocks(problem, x))
        before = cost
        enough = SMALL + _HOPELESS * max(cost - 2.0 * measured, 0.0)
        whole = equations.step(0.0)
        if -float(whole @ equations.gradient) / 2.0 < enough:
            break
        for _ in range(MOST_TRIES):
            tried, tried_cost = _released(problem, equations.moved(equations.step(damping)))
            if tried_cost < cost:
                x, cost, damping = tried, tried_cost, damping * 0.1
                break
            damping = max(damping * 10.0, 1e-6)
        if before - cost < enough:
            break
    keeper.offer(x, cost)
    return Solution(x, cost)


def _released(problem: Problem, x: FloatArray) -> tuple[FloatArray, float]:
    """Return the parameters with all releases fitted, and the cost."""
    n = problem.shared
    fitted = each(problem, lambda k: fit_release(problem, k, problem.here(k, x)))
    x = x.copy()
    for k, (here, _) in enumerate(fitted):
        x[problem.own(k)] = here[n:]
    prior = problem.shared_priors(x[:n])
    return x, float(sum(cost for _, cost in fitted) + 0.5 * (prior**2).sum())


@dataclass(frozen=True, eq=False)
class Alone:
    """A throw that is fitted alone.

    Attributes:
        throw: With changes counted from the best first state.
        shared: The shared parameters, shape (s,).
        loss: Mean loss of a residual.
    """

    throw: Throw
    shared: FloatArray
    loss: float


def fitted_alone(problem: Problem, k: int) -> Alone:
    """Fit throw `k` alone from many starts."""
    throw = problem.throws[k]
    alone = replace(problem, throws=(throw,), margin=ROUGH)
    fitted: list[tuple[float, int, Problem, FloatArray]] = []
    for state in promising(alone, 0, alone.means, starts(throw)):
        around = replace(alone, throws=(throw.starting_at(state),))
        solution = solve(around, around.means, most_steps=_FIRST_STEPS)
        fitted.append((solution.cost, len(fitted), around, solution.x))
    _, _, around, x = min(fitted, key=lambda entry: entry[:2])
    states, _, _ = around.states_and_rows(0, x[np.newaxis])
    loss = float(robust_loss(around.residuals(0, x)).mean())
    return Alone(throw.starting_at(states[0]), x[: problem.shared], loss)


def retry_releases(
    problem: Problem,
    x: FloatArray,
    which: Sequence[int],
    *,
    thorough: bool = False,
    better: float = BETTER,
) -> tuple[Problem, FloatArray, bool]:
    """Fit releases again from many starts, with the shared parameters known better by now.

    A release has many local minima: the spin rate determines how often the disc wobbles until its
    landing, and each more or less of those is one.

    Args:
        problem: The problem.
        x: Its parameters, shape (p,).
        which: Numbers of the throws.
        thorough: Whether to fit from one start of each attitude in place of the few starts that
            fit best as they are, which are often in one minimum, and to go on with the best.
        better: Decrease of the cost of a throw for which its release is exchanged.

    Returns:
        The problem with changes counted from the best first states, the parameters there, and
        whether one of them is better than before.
    """
    kept = [] if thorough else _kept(problem, x)

    def retried(k: int) -> tuple[Throw, FloatArray, bool]:
        here = problem.here(k, x)
        if k in which:
            fits = (
                _fits_of_each_attitude(problem, k, here)
                if thorough
                else _fits_near(problem, k, here, kept[k])
            )
            least = min(fits, key=lambda fit: fit.cost)
            if least.cost < cost_of_throw(problem, k, here) - better:
                return least.problem.throws[0], least.here, True
        return problem.throws[k], here, False

    results = each(problem, retried)
    problem = replace(problem, throws=tuple(throw for throw, _, _ in results))
    x = x.copy()
    for k, (_, here, _) in enumerate(results):
        x[problem.own(k)] = here[problem.shared :]
    return problem, x, any(exchanged for _, _, exchanged in results)


@dataclass(frozen=True, eq=False)
class _Fit:
    """A fitted release of one throw.

    Attributes:
        problem: Of this throw alone, with changes counted from where the fit began.
        here: The shared parameters and the release, shape (shared + 12,).
        cost: Of the throw.
    """

    problem: Problem
    here: FloatArray
    cost: float


def _fits_from(
    problem: Problem, k: int, here: FloatArray, states: Sequence[FloatArray]
) -> list[_Fit]:
    """Return the release of throw `k` fitted from each of several first states."""
    alone = [replace(problem, throws=(problem.throws[k].starting_at(s),)) for s in states]
    first = np.concatenate([here[: problem.shared], np.zeros(RELEASE_SIZE)])
    fitted = fit_releases(alone, 0, [first] * len(alone))
    return [_Fit(p, *ends) for p, ends in zip(alone, fitted, strict=True)]


def _going_on(fits: Sequence[_Fit]) -> list[_Fit]:
    """Return fits after more steps."""
    problems = [fit.problem for fit in fits]
    fitted = fit_releases(problems, 0, [fit.here for fit in fits], _MORE_STEPS)
    return [_Fit(p, *ends) for p, ends in zip(problems, fitted, strict=True)]


def _kept(problem: Problem, x: FloatArray) -> list[int]:
    """Return how many starts of each throw to fit: more if it fits worse than others."""
    losses = [
        float(robust_loss(problem.residuals(k, problem.here(k, x))).mean())
        for k in range(len(problem.throws))
    ]
    return [_MORE_KEPT if loss > ALIKE * min(losses) else KEPT for loss in losses]


def _fits_near(problem: Problem, k: int, here: FloatArray, kept: int) -> list[_Fit]:
    """Return fits of throw `k` from the starts that fit best as they are."""
    states, _, _ = problem.states_and_rows(k, here[np.newaxis])
    candidates = starts(problem.throws[k]) + _neighbours(states[0])
    best = promising(problem, k, here, candidates, kept)
    return _fits_from(problem, k, here, best)


def _fits_of_each_attitude(problem: Problem, k: int, here: FloatArray) -> list[_Fit]:
    """Return the best fits of throw `k` from one start of each attitude, after more steps."""
    first = _of_each_attitude(problem, k, here)
    fits = _fits_from(problem, k, here, first)
    return _going_on(sorted(fits, key=lambda fit: fit.cost)[:_GOING_ON])


def promising(
    problem: Problem,
    k: int,
    here: FloatArray,
    candidates: Sequence[FloatArray],
    kept: int = KEPT,
) -> list[FloatArray]:
    """Return the first states of throw `k` that fit best as they are, the best first."""
    tried = np.tile(here, (len(candidates), 1))
    for row, state in zip(tried, candidates, strict=True):
        delta, turn = local.difference(problem.throws[k].start, state)
        row[problem.shared :] = [*delta, turn]
    losses = robust_loss(problem.whitened(k, tried)).sum(axis=1)
    return [candidates[i] for i in np.argsort(losses, kind='stable')[:kept]]


def _of_each_attitude(problem: Problem, k: int, here: FloatArray) -> list[FloatArray]:
    """Return for each attitude of `starts` the first state that fits best as it is."""
    every = starts(problem.throws[k])
    best_last = reversed(promising(problem, k, here, every, len(every)))
    return list({tuple(state[6:10]): state for state in best_last}.values())


def _neighbours(state: FloatArray) -> list[FloatArray]:
    """Return states with other spin rates, without wobble and with what there is of it."""
    results = []
    for number in range(-_SPINS, _SPINS + 1):
        for share in (0.0, 1.0):
            other = state.copy()
            other[12] += _SPIN_STEP * number
            other[10:12] *= share
            results.append(other)
    return results


def starts(throw: Throw) -> list[FloatArray]:
    """Return first states to start from: attitudes, senses of the spin and spin angles."""
    first = throw.guess
    attitudes = [first[6:10]]
    if not throw.has(ATTITUDE):
        velocity = first[3:6]
        attitudes += [
            local.attitude(axis_in_flow(velocity, math.radians(attack), math.radians(roll)))
            for attack, roll in itertools.product(_ATTACKS, _ROLLS)
        ]
    signs = (1.0,) if throw.spin_known else (1.0, -1.0)
    angles = np.arange(_SPIN_ANGLES) * 2.0 * math.pi / _SPIN_ANGLES if throw.has(GYRO) else [0.0]
    result = []
    for attitude, sign, angle in itertools.product(attitudes, signs, angles):
        state = first.copy()
        state[6:10] = attitude
        state[12] *= sign
        c, s = math.cos(angle), math.sin(angle)
        p, q = state[10], state[11]
        state[10], state[11], state[13] = c * p - s * q, s * p + c * q, angle
        result.append(state)
    return result
