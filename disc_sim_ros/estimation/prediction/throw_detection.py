"""Where a throw begins and ends in a stream of positions."""

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.prediction.throw_estimator import straight
from disc_sim_ros.physics.frames import flip

WINDOW = 0.2  # s, in which a beginning is recognised ...
LONGEST_WINDOW = 0.55  # ... or, with fewer measurements in it, in which the last few are
LEAST = 6  # measurements of a beginning ...
SHORTEST = 0.05  # ... and their time [s]
LEAST_SPEED = 4.0  # m/s
LEAST_HEIGHT = 0.2  # m, that the disc has or will reach; a bounce is lower
_MOST_OFF = 14.0  # squared residual up to which a point lies on the line
_SHARE = 0.7  # of the points that must lie on it
_GRAVITY = 9.81  # m/s^2
_AERODYNAMIC = 15.0  # m/s^2, usual acceleration of a flight
_MOST_ACCELERATION = 30.0  # m/s^2, of a flight; a hand has 100
_MOST_NOISE = 25.0  # m/s^2, of an acceleration that tells a flight from a hand ...
_LONG = 0.9  # ... in less than this share of WINDOW
YOUNG = 0.4  # s, in which measurements of the hand are taken out of a throw
AFTER_LANDING = 0.08  # s after the predicted landing until the throw has ended
ENDED_BY = 6  # measurements one after the other that the flight cannot explain
_FAR = 25.0  # their squared residual
_SLOW = 0.5  # share of the speed of the flight, below which the disc was stopped


def first_of_window(time: FloatArray) -> int:
    """Return the first of the measurements in which a beginning may be.

    Those of WINDOW; where they are fewer than LEAST, the last LEAST, if they are not too old.

    Args:
        time: Times [s], ascending, shape (k,).
    """
    rounding = 1e-9
    first = int(np.searchsorted(time, time[-1] - WINDOW - rounding))
    few = max(len(time) - LEAST, 0)
    oldest = int(np.searchsorted(time, time[-1] - LONGEST_WINDOW - rounding))
    return max(min(first, few), oldest)


def beginning(time: FloatArray, position: FloatArray, sigma: FloatArray) -> int | None:
    """Return the first of the newest points that are those of a flight; None if there are none.

    Args:
        time: Times [s], ascending, shape (k,).
        position: Paper's axes [m], shape (k, 3).
        sigma: Standard deviation of each coordinate [m], shape (k,).
    """
    for i in range(len(time) - LEAST + 1):
        if time[-1] - time[i] < SHORTEST:
            return None
        if _is_flight(time[i:] - time[i], position[i:], sigma[i:]):
            return i
    return None


def _is_flight(t: FloatArray, position: FloatArray, sigma: FloatArray) -> bool:
    """Return True if points lie on a line at constant velocity, but for gravity and air."""
    velocity, start = straight(t, position)
    climb = max(float(flip(velocity[2])), 0.0)
    height = float(flip(start[2])) + climb**2 / (2.0 * _GRAVITY)  # at the top, without air
    if float(np.linalg.norm(velocity)) < LEAST_SPEED or height < LEAST_HEIGHT:
        return False
    bend = _AERODYNAMIC * t[-1] ** 2 / 16.0  # of a parabola from its chord, half of it
    off = position - start - t[:, None] * velocity
    squared = np.sum(off**2, axis=1) / (sigma**2 + bend**2)
    fits = squared < _MOST_OFF
    if not fits[0] or float(np.mean(fits)) < _SHARE:
        return False
    noise = float(np.median(sigma)) * np.sqrt(720.0 / fits.sum()) / t[-1] ** 2
    if noise > _MOST_NOISE and t[-1] < _LONG * WINDOW:
        return False  # a hand could look like this
    acceleration = 2.0 * np.polynomial.polynomial.polyfit(t[fits], position[fits], 2)[2]
    return bool(np.linalg.norm(acceleration) < _MOST_ACCELERATION + noise)


def of_the_hand(time: FloatArray, squares: FloatArray) -> int:
    """Return how many of the first measurements of a young throw the flight cannot explain.

    Args:
        time: Times since the reference [s], shape (k,).
        squares: Squared residuals of the positions, shape (k,).
    """
    if time[-1] > YOUNG or float(np.median(squares)) > _MOST_OFF:
        return 0
    off = squares > _FAR
    count = int(np.argmin(off)) if not off.all() else 0
    return count if len(time) - count >= LEAST else 0


def is_lost(squares: FloatArray) -> bool:
    """Return True if the flight cannot explain the newest measurements.

    It is another object, or no flight any more, or the fit is in a wrong minimum.

    Args:
        squares: Squared residuals of all positions, shape (k,).
    """
    enough = len(squares) >= ENDED_BY + LEAST
    return enough and bool((squares[-ENDED_BY:] > _FAR).all())


def has_ended(
    now: float, landing_time: float, squares: FloatArray, speeds: tuple[float, float]
) -> bool:
    """Return True if a throw is over: it landed, or something stopped the disc.

    Args:
        now: Time of the newest measurement since the reference [s].
        landing_time: Predicted [s]; nan without a landing.
        squares: Squared residuals of all positions, shape (k,).
        speeds: Of the newest measurements, see `newest_speed`, and of the flight now [m/s].
    """
    if now > landing_time + AFTER_LANDING:
        return True
    measured, flown = speeds
    return is_lost(squares) and measured < _SLOW * flown


def newest_speed(time: FloatArray, position: FloatArray) -> float:
    """Return the speed from the first to the last of the newest measurements [m/s]; of few, inf.

    They are ENDED_BY, and those of SHORTEST at least: of a fast tracker fewer tell only its noise.
    Outliers are far from each other, which makes it high.

    Args:
        time: Times [s], ascending, shape (k,).
        position: The measurements [m], shape (k, 3).
    """
    first = min(len(time) - ENDED_BY, int(np.searchsorted(time, time[-1] - SHORTEST)))
    if first < 0:
        return float('inf')
    way = float(np.linalg.norm(position[-1] - position[first]))
    return way / float(time[-1] - time[first])
