"""From measured throws to the coefficients of a disc with standard errors: `identify`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.identification import (
    coefficients,
    errors,
    information,
    marginal,
    profile,
    starting,
)
from disc_sim_ros.estimation.identification.coefficients import NAMES, Base, base_of
from disc_sim_ros.estimation.identification.fitting import (
    BETTER,
    Best,
    Progress,
    Solution,
    retry_releases,
    solve,
)
from disc_sim_ros.estimation.identification.information import Unidentifiable
from disc_sim_ros.estimation.identification.noise import HOPELESS, estimated_noise, refuse_misfit
from disc_sim_ros.estimation.identification.observations import GYRO, NOISE
from disc_sim_ros.estimation.identification.problem import FINE, FINEST, Prior, Problem
from disc_sim_ros.estimation.identification.release_fits import fit_release
from disc_sim_ros.estimation.identification.throws import Throw
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.frames import paper_from_map
from disc_sim_ros.physics.sampled import fly_sampled
from disc_sim_ros.physics.trajectory import COLUMNS, Trajectory
from disc_sim_ros.quantities import COEFFICIENT_SPREAD, IDENTIFICATION

_SAME_NOISE = 0.1  # relative change of an estimated noise below which it is not refined
_STEPS_WITHOUT = 12  # of a fit without one of the throws
_ROUNDS = 2  # of estimating the noise and fitting with it


@dataclass(frozen=True, eq=False)
class Identification:
    """The result of `identify`.

    Attributes:
        problem: The least-squares problem that was solved last.
        x: Its parameters, shape (p,).
        covariance: Of the parameters, shape (p, p).
        widening: Factor that the standard errors contain because residuals are correlated in time.
        stretches: Factors that the standard errors of the free coefficients contain because the
            sum of squares is no parabola, see `profile.Profile`.
        left_out: Coefficients that kept the value of the base disc, with the reasons.
        interrupted: Whether Ctrl-C ended the search: the best parameters so far.
        seed: Of the starts.
    """

    problem: Problem
    x: FloatArray
    covariance: FloatArray
    widening: float
    stretches: FloatArray
    left_out: tuple[Unidentifiable, ...]
    interrupted: bool
    seed: int

    @property
    def base(self) -> Base:
        """Return the base disc."""
        return self.problem.base

    @property
    def values(self) -> FloatArray:
        """Return all coefficients in the order of `coefficients.NAMES`, shape (9,)."""
        values = self.problem.held.copy()
        values[list(self.problem.free)] = self.x[: len(self.problem.free)]
        return values

    @property
    def errors(self) -> FloatArray:
        """Return the standard errors of all coefficients, nan where held, shape (9,)."""
        errors = np.full(len(NAMES), np.nan)
        n = len(self.problem.free)
        errors[list(self.problem.free)] = np.sqrt(np.diag(self.covariance))[:n]
        return errors

    @property
    def shared_errors(self) -> FloatArray:
        """Return the standard errors of the shared parameters, in the order of `problem.names`."""
        errors: FloatArray = np.sqrt(np.diag(self.covariance))[: self.problem.shared]
        return errors

    @property
    def correlation(self) -> FloatArray:
        """Return the correlations of the shared parameters, shape (k, k)."""
        n = self.problem.shared
        errors = self.shared_errors
        correlation: FloatArray = self.covariance[:n, :n] / np.outer(errors, errors)
        return correlation

    @property
    def wind(self) -> FloatArray:
        """Return the wind of the session, x and y in `map` [m/s], shape (2,)."""
        n = len(self.problem.free)
        return self.x[n : n + 2]

    def parameters_of(self, k: int) -> FloatArray:
        """Return the shared parameters and the release of throw `k`, shape (1, shared + 12)."""
        return self.problem.here(k, self.x)[np.newaxis]

    def flight(self, k: int, rate: float) -> Trajectory:
        """Return the fitted flight of throw `k`, from its first to its last measurement.

        Args:
            k: Number of the throw.
            rate: Samples a second [Hz].
        """
        problem = self.problem
        states, rows, _ = problem.states_and_rows(k, self.parameters_of(k))
        times = np.arange(0.0, float(problem.throws[k].times[-1]), 1.0 / rate)
        flown = fly_sampled(states, rows, problem.setup, times, step=problem.step, duration=0.0)
        sampled = np.empty((len(times), COLUMNS))
        sampled[:, 0] = times
        sampled[:, 1:-3] = flown.states[0]
        sampled[:, -3:] = paper_from_map(np.array([*self.wind, 0.0]))
        return Trajectory(sampled, problem.setup.disc.diameter)

    def residuals(self, k: int) -> dict[str, FloatArray]:
        """Return predictions minus measurements of throw `k` by instrument, each (n, d)."""
        parts = self.problem.predictions(k, self.parameters_of(k))
        throw = self.problem.throws[k]
        return {o.kind: r[0] for o, r in zip(throw.observations, parts, strict=True)}

    def rms(self, kind: str) -> float:
        """Return the root mean square of the residuals of an instrument over all throws."""
        every = [self.residuals(k).get(kind) for k in range(len(self.problem.throws))]
        flat = np.concatenate([r.ravel() for r in every if r is not None])
        return float(np.sqrt((flat**2).mean()))


def identify(
    throws: Sequence[Throw],
    setup: Setup,
    *,
    free: Sequence[str] | None = None,
    prior: Prior | None = None,
    noise: Mapping[str, float] | None = None,
    anyway: bool = False,
    starts: int = 2,
    seed: int = 0,
    progress: Progress | None = None,
) -> Identification:
    """Fit the coefficients of a disc to measured throws.

    Output-error least squares: the equations of motion fly each throw from a fitted release, and
    all measurements of all throws are compared at once, with a robust loss. Releases and the wind,
    which all throws share, are fitted too.

    Args:
        throws: The throws, of one disc and one session.
        setup: The base disc, the model and the air; its wind is not used.
        free: Names of the coefficients to fit, of `coefficients.NAMES`; None for all that the
            throws determine.
        prior: What is believed beforehand; None for the spread of discs of one kind.
        noise: Standard deviations of the instruments, by kind; others are estimated.
        anyway: Also fit coefficients that the throws do not determine; their priors decide.
        starts: Number of sets of coefficients to start from.
        seed: Of those starts; the same seed gives the same answer.
        progress: Called with a stage, a count and the cost.

    Raises:
        ConfigError: A name is unknown, a noise is out of range, the throws do not determine a
            coefficient of `free`, or no disc like the base disc flies so. Where they determine
            none at all, releases and wind are fitted with the coefficients of the base disc.
    """
    if not throws:
        raise ConfigError('throws', 0, 'give at least one throw')
    for kind, deviation in (noise or {}).items():
        validation.choice('noise', kind, NOISE)
        IDENTIFICATION['noise'].check(deviation, f'noise of {kind}')
    base = base_of(setup)
    spread = np.array([COEFFICIENT_SPREAD[name] for name in NAMES])
    chosen = range(len(NAMES)) if free is None else coefficients.chosen(free)
    problem = Problem(
        setup=setup,
        base=base,
        free=tuple(chosen),
        throws=tuple(throws),
        prior=prior or Prior(spread),
        noise=NOISE | dict(noise or {}),
        held=base.values,
    )
    best = Best()
    given = set(noise or {})
    interrupted = False
    left_out: list[Unidentifiable] = []
    try:
        search = starting.Search(starts, seed, progress)
        for better, first in starting.started(problem, search):
            problem, x, best = better, first, Best(first)
        x = starting.from_starts(problem, x, search, best).x
        refuse_misfit(problem, estimated_noise(problem, x, given), given, HOPELESS)
        problem = replace(problem, margin=FINE)
        problem, x, left_out = _identifiable(problem, x, refuse=free is not None, anyway=anyway)
        best = Best(x)
        solution = solve(problem, x, best=best, progress=progress, stage='fit')
        x = solution.x
        if not problem.turns_only:  # a graduated search has left out each throw already
            problem, x = _without_each(problem, solution, progress)
        best = Best(x)
        for number in range(_ROUNDS):
            estimated = estimated_noise(problem, x, given)
            changed = max(abs(estimated[kind] / problem.noise[kind] - 1.0) for kind in estimated)
            refuse_misfit(problem, estimated, given)
            if number > 0 and changed < _SAME_NOISE:
                break
            noises = {**problem.noise, **estimated}
            problem = replace(problem, margin=FINEST, noise=noises)
            best = Best(x)
            x = solve(problem, x, best=best, progress=progress, stage='noise').x
        best = Best(x)
        result = errors.errors(problem, x, best, progress)
    except KeyboardInterrupt:
        if not best.x.size or best.x.size != problem.size:
            raise
        interrupted = True
        estimated = estimated_noise(problem, best.x, given)
        problem = replace(problem, noise={**problem.noise, **estimated})
        result = errors.by_curvature(problem, best.x)
    return Identification(
        problem,
        result.x,
        result.covariance,
        result.widening,
        result.stretches,
        tuple(left_out),
        interrupted,
        seed,
    )


def stages(throws: Sequence[Throw], starts: int) -> dict[str, float]:
    """Return the stages of an identification in their order, for a guess of the time left.

    Each with the time that it took in simulated sessions of five throws [s of CPU].
    """
    turning = all(throw.turns_only for throw in throws)
    apart = len(throws) if len(throws) > 1 and not turning else 0
    gyro = any(throw.has(GYRO) for throw in throws)
    return {
        **starting.stages(starts, turning=turning),
        'fit': 0.3,
        **{_without_stage(k, apart): 0.3 for k in range(apart)},
        'noise': 1.0,
        marginal.STAGE: 0.5 if gyro else 5.0,
        profile.STAGE: 5.0,
    }


def _without_stage(k: int, throws: int) -> str:
    """Return the name of the stage that fits without throw `k`."""
    return f'without throw {k + 1} of {throws}'


def _without_each(
    problem: Problem, solution: Solution, progress: Progress | None
) -> tuple[Problem, FloatArray]:
    """Look for a better minimum: fit without each throw in turn, then its release anew.

    A throw whose release is fitted in a wrong local minimum bends the coefficients, and those keep
    it there. Without it the coefficients are right, and the release is found.
    """
    n = len(problem.throws)
    x, cost = solution.x, solution.cost
    for k in range(n if n > 1 else 0):
        rest = replace(problem, throws=tuple(t for i, t in enumerate(problem.throws) if i != k))
        stage = _without_stage(k, n)
        shared = solve(
            replace(rest, margin=rest.roughest),
            np.delete(x, np.r_[problem.own(k)]),
            most_steps=_STEPS_WITHOUT,
            progress=progress,
            stage=stage,
        ).x[: problem.shared]
        tried = x.copy()
        tried[: problem.shared] = shared
        tried[problem.own(k)] = fit_release(problem, k, problem.here(k, tried))[0][len(shared) :]
        other, tried, better = retry_releases(problem, tried, (k,))
        if not better:
            continue
        again = solve(other, tried, most_steps=_STEPS_WITHOUT, progress=progress, stage=stage)
        if again.cost < cost - BETTER:
            problem, x, cost = other, again.x, again.cost
    return problem, x


def _identifiable(
    problem: Problem, x: FloatArray, *, refuse: bool, anyway: bool
) -> tuple[Problem, FloatArray, list[Unidentifiable]]:
    """Leave out, one by one, the coefficients that the throws do not determine, or refuse them.

    Raises:
        ConfigError: `refuse`, and there is such a coefficient.
    """
    left_out: list[Unidentifiable] = []
    while not anyway and problem.free:
        open_ones = information.unidentifiable(problem, information.information(problem, x))
        if not open_ones:
            break
        worst = open_ones[0]
        if refuse:
            raise ConfigError(
                'free', worst.name, f'{worst.reason}: leave it out, or give --anyway', 'free'
            )
        left_out.append(worst)
        place = [NAMES[i] for i in problem.free].index(worst.name)
        problem = replace(problem, free=information.without(problem, [worst.name]))
        x = np.delete(x, place)
    return problem, x, left_out
