"""How uncertain a landing is: a profile of the fit along the direction that decides it.

Where the table of coefficients has corners the landing is not linear in the unknowns, and the
linear covariance is too small. One direction dominates the uncertainty of nearly every landing.
Along it the estimate is moved in fixed steps to both sides, the other unknowns are fitted anew,
and the landings of these throws are weighted by how likely the throws are.
"""

from dataclasses import dataclass
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.throw_fit import (
    POSITION,
    Estimate,
    Linear,
    Measurements,
    Model,
    costs,
    inverse,
    residuals,
    root_weights,
    square_root,
)

STEPS = (1.0, 2.0)  # standard deviations, to both sides
_SIDES = np.array([1.0, -1.0])
_DIFFERENCE = 0.3  # of the derivatives, standard deviations
_FRACTIONS = np.array([1.0, 0.5, 0.2, 0.0])  # of a Gauss-Newton step, tried at once
_GRID = np.linspace(-5.0, 5.0, 201)
_LEAST_VARIANCE = 1e-6  # m^2, of a landing that is shown


@dataclass(frozen=True, slots=True)
class _Side:
    """The fit on both sides of the estimate.

    Attributes:
        deltas: Unknowns less the estimate, shape (2, m).
        tangents: Directions in which to go on, shape (2, m).
        cost: Shape (2,).
        landing: X, Y and time, shape (2, 3).
    """

    deltas: FloatArray
    tangents: FloatArray
    cost: FloatArray
    landing: FloatArray


def half_axes(covariance: FloatArray, share: float) -> tuple[float, float, float]:
    """Return the ellipse that holds a share of normally distributed landings.

    Args:
        covariance: Of x and y [m], shape (2, 2).
        share: Between 0 and 1.

    Returns:
        Half of the long and of the short axis [m], at least 1 mm standard deviation each, and the
        direction of the long one from x towards y [rad].
    """
    variances, axes = np.linalg.eigh(covariance)
    squared = -2.0 * math.log1p(-share)  # quantile of chi-squared with two degrees of freedom
    short, long = (math.sqrt(max(float(v), _LEAST_VARIANCE) * squared) for v in variances)
    return long, short, math.atan2(axes[1, 1], axes[0, 1])


def linear_covariance(linear: Linear) -> FloatArray:
    """Return the covariance of X, Y and time of a landing by the linear fit, shape (3, 3)."""
    covariance: FloatArray = linear.landing @ linear.covariance @ linear.landing.T
    return covariance


def profiled_covariance(
    model: Model,
    estimate: Estimate,
    landing: FloatArray,
    linear: Linear,
    data: Measurements,
    scale: FloatArray,
) -> FloatArray:
    """Return the covariance of a landing about the estimate's, from a profile of the fit.

    Args:
        model: The model.
        estimate: The estimate.
        landing: X, Y and time of its landing, shape (3,).
        linear: The fit close to it.
        data: The measurements.
        scale: See `throw_fit.scale_of`.

    Returns:
        Of X, Y and time, shape (3, 3). It holds the skewness, too: squares are about `landing`,
        not about the mean.
    """
    whole = linear_covariance(linear)
    _, axes = np.linalg.eigh(whole[:2, :2])
    gradient = axes[:, 1] @ linear.landing[:2]
    toward = linear.covariance @ gradient
    sigma = math.sqrt(max(float(gradient @ toward), 1e-18))
    unit = toward / sigma
    places, rise, landings = _profile(model, estimate, linear, data, scale, unit, gradient / sigma)
    good = np.isfinite(rise) & np.isfinite(landings).all(axis=1)
    if not (good & (places > 0.0)).any() or not (good & (places < 0.0)).any():
        return whole
    places, rise, landings = places[good], rise[good], landings[good]
    place = int(np.searchsorted(places, 0.0))
    root = np.insert(np.sqrt(2.0 * rise) * np.sign(places), place, 0.0)
    points = np.insert(landings, place, landing, axis=0)
    places = np.insert(places, place, 0.0)
    likely = np.exp(-0.5 * _extended(_GRID, places, np.maximum.accumulate(root)) ** 2)
    likely /= likely.sum()
    off = np.stack([_extended(_GRID, places, x) for x in points.T], axis=1) - landing
    share = linear.landing @ unit
    covariance: FloatArray = off.T @ (off * likely[:, None]) + whole - np.outer(share, share)
    return covariance


def _profile(
    model: Model,
    estimate: Estimate,
    linear: Linear,
    data: Measurements,
    scale: FloatArray,
    unit: FloatArray,
    gradient: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return steps along `unit`, ascending, by how much the cost rises, and the landings."""
    spread = _DIFFERENCE * square_root(linear.covariance[POSITION:, POSITION:])
    start = model.moved(estimate, np.zeros((1, len(unit))))
    base = float(costs(residuals(model, *start, data), scale)[0])
    deltas, tangents, last = np.zeros((2, len(unit))), np.tile(unit, (2, 1)), 0.0
    steps: list[float] = []
    rises: list[float] = []
    landings: list[FloatArray] = []
    for step in STEPS:
        deltas = deltas + (step - last) * _SIDES[:, None] * tangents
        last = step
        side = _refit(model, estimate, data, scale, spread, deltas, gradient)
        deltas, tangents = side.deltas, side.tangents
        steps += [step, -step]
        rises += list(side.cost - base)
        landings += list(side.landing)
    order = np.argsort(steps)
    rise = np.array(rises)[order]
    return np.array(steps)[order], np.maximum(rise, 0.0), np.array(landings)[order]


def _refit(
    model: Model,
    estimate: Estimate,
    data: Measurements,
    scale: FloatArray,
    spread: FloatArray,
    deltas: FloatArray,
    gradient: FloatArray,
) -> _Side:
    """Return both throws after a Gauss-Newton step that keeps `gradient @ delta`."""
    m = deltas.shape[1]
    lanes = 1 + m - POSITION
    moves = np.repeat(deltas, lanes, axis=0)
    for side in (0, 1):
        moves[1 + side * lanes : (side + 1) * lanes, POSITION:] += spread.T
    r = residuals(model, *model.moved(estimate, moves), data)
    turn = np.eye(m)
    turn[POSITION:, POSITION:] = spread
    tangents, tries = np.empty_like(deltas), []
    for side in (0, 1):
        own = slice(side * lanes, (side + 1) * lanes)
        covariance, step = _step(r.measured[own], r.prior[own], turn, scale, data)
        toward = covariance @ gradient
        tangents[side] = toward / (gradient @ toward)
        step = step - tangents[side] * (gradient @ step)
        tries.append(deltas[side] + _FRACTIONS[:, None] * step)
    moves = np.concatenate(tries)
    r = residuals(model, *model.moved(estimate, moves), data)
    cost = costs(r, scale)
    best = np.argmin(cost.reshape(2, -1), axis=1) + np.array([0, len(_FRACTIONS)])
    return _Side(moves[best], tangents, cost[best], r.landing[best])


def _step(
    measured: FloatArray,
    prior: FloatArray,
    turn: FloatArray,
    scale: FloatArray,
    data: Measurements,
) -> tuple[FloatArray, FloatArray]:
    """Return covariance and Gauss-Newton step of a throw from one-sided differences."""
    m = len(turn)
    roots = root_weights(measured[0], scale)
    own = np.zeros((len(data.time), 6, m))
    for axis in range(POSITION):
        own[:, axis, axis] = 1.0 / data.sigma
    own[:, :, POSITION:] = np.moveaxis(np.nan_to_num(measured[1:] - measured[0]), 0, -1)
    slopes = (own * roots[:, :, None]).reshape(-1, m)
    of_prior = np.zeros((prior.shape[1], m))
    of_prior[:, POSITION:] = np.nan_to_num(prior[1:] - prior[0]).T
    inverted = inverse(slopes.T @ slopes + of_prior.T @ of_prior)
    downhill = slopes.T @ np.nan_to_num(measured[0] * roots).ravel() + of_prior.T @ prior[0]
    return turn @ inverted @ turn.T, -turn @ (inverted @ downhill)


def _extended(x: FloatArray, places: FloatArray, values: FloatArray) -> FloatArray:
    """Return values between places, linear also beyond both ends."""
    inside = np.interp(x, places, values)
    low = values[0] + (x - places[0]) * (values[1] - values[0]) / (places[1] - places[0])
    high = values[-1] + (x - places[-1]) * (values[-1] - values[-2]) / (places[-1] - places[-2])
    return np.where(x < places[0], low, np.where(x > places[-1], high, inside))
