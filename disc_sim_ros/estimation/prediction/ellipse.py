"""How uncertain a landing is: likely throws, drawn from the linear fit and flown to the ground.

The landing is not linear in the unknowns: tables of coefficients have corners, and with positions
only a wide range of winds and attitudes fits, across which landings lie on a curve. So throws are
drawn and flown; the linear covariance of the landing is too small. Weighting the draws by how well
they fit made it worse: of some ten unknowns a few draws get all the weight.

Another disc is not one offset away from the assumed one at every angle of attack. So the rest of a
flight may have further offsets, drawn anew (`ThrowPrior.shape`).
"""

from functools import cache
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.prediction.nutation import SPIN, SpinBelief
from disc_sim_ros.estimation.prediction.throw_fit import Estimate, Linear, Model, square_root

DRAWS = 64  # throws; a multiple of 16
HELD = 0.85  # share of the drawn landings that its ellipse holds
_LEAST_SHARE = 0.5  # of the draws that must land
_LEAST_VARIANCE = 1e-6  # m^2, of a landing that is shown
_SINGULAR = 1e-9  # share of the variances that keeps landings on a line solvable


@cache
def _draws(unknowns: int) -> FloatArray:
    """Return draws of normal numbers with mean 0 and covariance 1, shape (DRAWS, unknowns)."""
    half = np.random.default_rng(0).normal(size=(DRAWS // 2, unknowns))
    root = np.linalg.cholesky(half.T @ half / len(half))
    half = np.linalg.solve(root, half.T).T
    draws: FloatArray = np.concatenate([half, -half])
    draws.flags.writeable = False
    return draws


@cache
def _shares() -> FloatArray:
    """Return shares of a probability, evenly spaced, in an order that is drawn; shape (DRAWS,)."""
    shares = (np.random.default_rng(1).permutation(DRAWS) + 0.5) / DRAWS
    shares.flags.writeable = False
    return shares


def drawn_landings(
    model: Model,
    estimate: Estimate,
    linear: Linear,
    now: float,
    belief: SpinBelief | None = None,
) -> FloatArray:
    """Return landings of throws drawn from the linear fit.

    Args:
        model: The model.
        estimate: The estimate.
        linear: The fit close to it.
        now: Time of the newest measurement, since the reference [s].
        belief: Spins that are likely; None for those of the linear fit.

    Returns:
        X, Y [m] and time [s] of those that land, shape (n, 3); empty if too few do.
    """
    m = model.unknowns
    offsets = model.offsets
    draws = _draws(m + len(offsets))
    deltas = draws[:, :m] @ square_root(linear.covariance).T
    if belief is not None:
        off = belief.drawn(_shares()) - estimate.state[SPIN]
        deltas += np.outer(off - deltas[:, model.spin], linear.along(model.spin))
    throws = model.moved(estimate, deltas)
    tracker = model.tracker
    so_far = tracker.fly(throws.states, throws.rows, np.array([now]), 0.0)
    rows = throws.rows
    places = [model.columns[k] for k in offsets]
    rows[:, places] += model.prior.shape * draws[:, m:] * model.sigmas[offsets]
    rest = tracker.fly(so_far.last, rows, np.zeros(1), model.duration)
    landings = rest.landing + np.array([0.0, 0.0, now])
    landed = np.isfinite(landings).all(axis=1)
    return landings[landed] if landed.mean() >= _LEAST_SHARE else np.empty((0, 3))


def covariance_about(landing: FloatArray, landings: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the covariance of landings about one, so that its ellipses hold their shares.

    It is that of the mean squares, times the factor with which the ellipse of HELD holds that
    share of the landings. Where landings lie on curves, mean squares follow the few that are far
    away: the ellipse of 90 % then held up to 97 % of true landings, and that of 50 % up to 76 %.

    Args:
        landing: X, Y [m] and time [s], shape (3,).
        landings: The same of n throws, shape (n, 3).
        weights: How much each counts, shape (n,).

    Returns:
        Shape (3, 3); nan for fewer landings than half of DRAWS.
    """
    if len(landings) < _LEAST_SHARE * DRAWS:
        return np.full((3, 3), np.nan)
    weights = weights / weights.sum()
    off = landings - landing
    covariance: FloatArray = (weights * off.T) @ off
    flat = covariance[:2, :2] + _SINGULAR * (covariance.trace() + _SINGULAR) * np.eye(2)
    squares = np.einsum('ij,ij->i', off[:, :2], np.linalg.solve(flat, off[:, :2].T).T)
    order = np.argsort(squares)
    held = int(np.searchsorted(np.cumsum(weights[order]), HELD))
    return covariance * (float(squares[order[held]]) / chi_squared(HELD))


def chi_squared(share: float) -> float:
    """Return the quantile of chi-squared with two degrees of freedom."""
    return -2.0 * math.log1p(-share)


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
    squared = chi_squared(share)
    short, long = (math.sqrt(max(float(v), _LEAST_VARIANCE) * squared) for v in variances)
    return long, short, math.atan2(axes[1, 1], axes[0, 1])
