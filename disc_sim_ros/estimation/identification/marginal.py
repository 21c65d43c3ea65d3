"""How large the damping is, where only a wobble near the noise tells it.

The best fit has too little damping, and looks sure of it: with little damping a small wobble lasts
to the landing, and with the spin, the phase and the amplitude of each throw it can follow the
noise. Such a fit is good in a narrow range of releases only; with more damping the wobble is soon
over, and nearly any release fits. The likelihood integrated over all other parameters (Laplace's
method) counts that, and has too much damping: it counts one narrow range of many. In simulated
sessions the truth lay between the two, so both have half of the weight here.
"""

from dataclasses import dataclass, replace
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.identification import information
from disc_sim_ros.estimation.identification.coefficients import NAMES
from disc_sim_ros.estimation.identification.fitting import Progress, solve
from disc_sim_ros.estimation.identification.problem import ROUGH, Problem

STAGE = 'damping'
DAMPING = NAMES.index('damping')
_KNOWN = 0.1  # standard error over value below which the sum of squares is a parabola
_OFFSET, _SPACING = 0.2, 0.45  # of the dampings that are looked at: even in log(damping + offset)
_FINE = 200  # dampings between which the sums are interpolated
_NEGLIGIBLE = 6.0  # half squares above the best, from which on a damping counts as excluded
_STEPS = 5  # of the fit for each damping


@dataclass(frozen=True, eq=False)
class Marginal:
    """The damping, half by the best fits and half with the other parameters integrated out.

    Attributes:
        mean: Mean of the damping, a factor on that of the base disc.
        x: All parameters at that damping, fitted, shape (p,).
        between: Covariance of the parameters because the damping is not known, shape (p, p); that
            of the parameters for a known damping has to be added.
    """

    mean: float
    x: FloatArray
    between: FloatArray


@dataclass(frozen=True, eq=False)
class Point:
    """The best fit for one damping.

    Attributes:
        damping: Factor on that of the base disc.
        x: Parameters of the problem with the damping held.
        cost: Half squares.
        volume: Half the logarithm of the determinant of the information of `x`.
    """

    damping: float
    x: FloatArray
    cost: float
    volume: float


def holding(problem: Problem, damping: float) -> Problem:
    """Return the problem with the damping held."""
    held = problem.held.copy()
    held[DAMPING] = damping
    return replace(problem, free=tuple(i for i in problem.free if i != DAMPING), held=held)


def marginal(
    problem: Problem, x: FloatArray, known: information.Information, progress: Progress | None
) -> Marginal | None:
    """Return the damping with the weight of all dampings that fit.

    Args:
        problem: The problem.
        x: Its best parameters, shape (p,).
        known: The information there.
        progress: Called with `STAGE`, the number of the damping and the height.

    Returns:
        The result; None where the damping is held, or known well already.
    """
    if DAMPING not in problem.free:
        return None
    place = problem.free.index(DAMPING)
    error = math.sqrt(known.covariance()[place, place])
    if error < _KNOWN * x[place]:
        return None
    rough = replace(problem, margin=ROUGH)
    points = _points(rough, x, place, known.widening, progress)
    dampings, shares, every = posterior(points, place)
    mean = float(shares @ dampings)
    off = every - shares @ every
    between = off.T @ (shares[:, np.newaxis] * off)
    nearest = min(points, key=lambda point: abs(point.damping - mean))
    fitted = solve(holding(problem, mean), nearest.x).x
    return Marginal(mean, np.insert(fitted, place, mean), between)


def posterior(points: list[Point], place: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return dampings, the share of each, and the parameters there, shape (n, p)."""
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415 - not every session needs it

    u = np.log([point.damping + _OFFSET for point in points])
    cost = np.array([point.cost for point in points])
    fine = np.linspace(u[0], u[-1], _FINE)
    shares = np.zeros(_FINE)
    for height in (cost, cost + [point.volume for point in points]):
        density = np.exp(height.min() - PchipInterpolator(u, height)(fine) + fine)
        shares += 0.5 * density / density.sum()
    known = np.array([np.insert(point.x, place, point.damping) for point in points])
    every = np.stack([np.interp(fine, u, column) for column in known.T], axis=1)
    return np.exp(fine) - _OFFSET, shares, every


def _points(
    problem: Problem, x: FloatArray, place: int, widening: float, progress: Progress | None
) -> list[Point]:
    """Return the dampings that count, from the best fit on to both sides, ascending."""
    low, high = problem.bounds[0][place], problem.bounds[1][place]
    points = [_point(problem, float(x[place]), np.delete(x, place), widening)]
    for direction in (1.0, -1.0):
        last = points[0]
        while low < last.damping < high or last is points[0]:
            wanted = (last.damping + _OFFSET) * math.exp(direction * _SPACING) - _OFFSET
            damping = min(max(wanted, low), high)
            if damping == last.damping:
                break
            last = _point(problem, damping, last.x, widening)
            points.append(last)
            if progress is not None:
                progress(STAGE, len(points), last.cost)
            if _excluded(last, points):
                break
    return sorted(points, key=lambda point: point.damping)


def _excluded(point: Point, points: list[Point]) -> bool:
    """Return True if other dampings are far better, with and without the volume."""
    least = min(other.cost for other in points)
    whole = min(other.cost + other.volume for other in points)
    return point.cost > least + _NEGLIGIBLE and point.cost + point.volume > whole + _NEGLIGIBLE


def _point(problem: Problem, damping: float, x: FloatArray, widening: float) -> Point:
    """Return the best fit for a damping, its cost and the volume of the fits beside it."""
    held = holding(problem, damping)
    fitted = solve(held, x, most_steps=_STEPS)
    known = information.information(held, fitted.x)
    place = problem.free.index(DAMPING)
    off = (damping - problem.means[place]) / problem.shared_deviations[place]
    _, logarithm = np.linalg.slogdet(known.data / widening**2 + known.priors)
    cost = fitted.cost / widening**2 + 0.5 * off**2
    return Point(damping, fitted.x, float(cost), 0.5 * float(logarithm))
