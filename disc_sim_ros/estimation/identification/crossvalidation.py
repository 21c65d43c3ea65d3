"""How well the disc of other throws predicts one: leave-one-throw-out."""

from dataclasses import dataclass, replace

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification.fitting import Progress, solve
from disc_sim_ros.estimation.identification.identify import Identification
from disc_sim_ros.estimation.identification.observations import FEWEST, Camera, Positions
from disc_sim_ros.estimation.identification.problem import Prior, Problem

_WATCHED = 0.3  # share of a throw from which its release is fitted
_KNOWN = 1e-3  # deviation of a wind that other throws told [m/s]


@dataclass(frozen=True)
class LeftOut:
    """How well the disc and the wind of the other throws predict the end of one.

    Attributes:
        from_path: Distance of its last point with a release that is fitted to the first 30 % of
            its samples [m]; None for a throw without positions.
        from_release: The same with the release as it was measured, and only the heading and the
            place of the path [m]; None without a measured release.
    """

    from_path: float | None = None
    from_release: float | None = None


def left_out_misses(result: Identification, progress: Progress | None = None) -> list[LeftOut]:
    """Return by how much each throw is missed by a fit of the others.

    Args:
        result: The identification with all throws.
        progress: Called with a stage of `stages`, a count and the cost.

    Returns:
        The misses of each throw; none for a throw that is alone.
    """
    problem = result.problem
    n = len(problem.throws)
    if n < 2:
        return [LeftOut()]
    return [_miss(problem, result.x, k, progress) for k in range(n)]


def stages(throws: int) -> dict[str, float]:
    """Return the stages of `left_out_misses` in their order, for a guess of the time left.

    Each with the time that it took in simulated sessions of five throws [s of CPU].
    """
    return {_stage(k, throws): 0.5 for k in range(throws if throws > 1 else 0)}


def _stage(k: int, throws: int) -> str:
    return f'throw {k + 1} of {throws} from the others'


def _miss(problem: Problem, x: FloatArray, k: int, progress: Progress | None) -> LeftOut:
    throw = problem.throws[k]
    path = next((o for o in throw.observations if isinstance(o, Positions | Camera)), None)
    if path is None or len(path.t) * _WATCHED < FEWEST:
        return LeftOut()
    rest = replace(problem, throws=tuple(t for i, t in enumerate(problem.throws) if i != k))
    stage = _stage(k, len(problem.throws))
    first = np.delete(x, np.r_[problem.own(k)])
    shared = solve(rest, first, progress=progress, stage=stage).x[: problem.shared]
    free = len(problem.free)
    held = problem.held.copy()
    held[list(problem.free)] = shared[:free]
    foot = tuple(float(v) for v in shared[free + 2 : free + 4]) or problem.prior.foot
    prior = Prior(
        problem.prior.coefficients,
        wind=(float(shared[free]), float(shared[free + 1])),
        wind_deviation=_KNOWN,
        foot=(foot[0], foot[1]),
        foot_deviation=_KNOWN,
    )
    end = float(path.t[-1]) * _WATCHED
    watched = throw.until(end)
    begun = replace(problem, throws=(watched,), free=(), held=held, prior=prior)
    fitted = solve(begun, np.concatenate([begun.means[: begun.shared], x[problem.own(k)]])).x
    whole = replace(begun, throws=(throw,))
    believed = np.concatenate([whole.means[: whole.shared], throw.believed])
    return LeftOut(
        _last_miss(whole, path, fitted),
        _last_miss(whole, path, believed) if throw.has_release else None,
    )


def _last_miss(problem: Problem, path: Positions | Camera, x: FloatArray) -> float:
    """Return the horizontal distance of the last point of a path [m]."""
    place = problem.throws[0].observations.index(path)
    residuals = problem.predictions(0, x[np.newaxis])[place]
    return float(np.linalg.norm(residuals[0, -1, :2]))
