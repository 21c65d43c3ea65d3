"""One throw, estimated from all its measurements: a few Gauss-Newton steps for each new one.

A batch estimator, because a filter of this problem is overconfident (docs/predictor.md).
"""

from dataclasses import replace
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation import lift_coordinates, local
from disc_sim_ros.estimation.prediction import nutation
from disc_sim_ros.estimation.prediction.ellipse import drawn_landings
from disc_sim_ros.estimation.prediction.prior import Gaussian
from disc_sim_ros.estimation.prediction.throw_fit import (
    POSITION,
    Estimate,
    Fitted,
    Linear,
    Measurements,
    Model,
    best_on_line,
    linearised,
    square_root,
)
from disc_sim_ros.physics.kernels.tracking import SEEN

FIRST_STEPS = 6  # Gauss-Newton steps of the first update
# Gain in cost from which another step is made: that of a move of 0.2 standard deviations. One step
# lags behind the measurements, and more than four cost more time than they gain.
_FAR = 0.02
MOST_MORE = 3
# Derivatives are differences over one standard deviation, which sees beyond the corners of the
# table. Where a step along them gains nothing, this share of it shows the slope at the estimate,
# which may lie very near a corner.
_NARROW = 1e-3
_FIRST_VELOCITY = 1.0  # m/s, with which the first derivatives are taken
_FIRST_LIFT = 5.0  # m/s^2
_LOST = 4.0  # scale of the residuals from which the throw is fitted from the beginning
_SHORTEST_GAP = 0.3  # share of the longest time between two measurements of a velocity


class ThrowEstimator:
    """The estimate of one throw.

    Attributes:
        fitted: The estimate and its residuals; None before the first update.
        linear: The linear fit close to it.
    """

    def __init__(self, model: Model) -> None:
        """Begin without an estimate."""
        self._model = model
        self.fitted: Fitted | None = None
        self.linear: Linear | None = None
        self._scale = np.ones(SEEN)
        self._spread = _first_spread(model)
        self._data: Measurements | None = None
        self._left = 0  # of the first steps

    def update(
        self,
        data: Measurements,
        steps: int = 1,
        more: int = MOST_MORE,
        first: int = FIRST_STEPS,
    ) -> Fitted:
        """Fit all measurements of the throw.

        Args:
            data: All measurements so far, the first at time 0.
            steps: Gauss-Newton steps.
            more: Further steps, at most, while the last led far.
            first: Of the first FIRST_STEPS, how many this update makes at most.
        """
        model = self._model
        if self.fitted is None or (self.is_settled and self.is_lost):
            estimate, self._spread = first_estimate(model, data), _first_spread(model)
            self._left = FIRST_STEPS
        else:
            estimate = self.fitted.estimate
        if self._left:
            steps = min(self._left, first)
            more = more if steps == self._left else 0
            self._left -= steps
        narrow = False
        for k in range(1, steps + more + 1):
            duration = model.duration if k >= steps else 0.0
            spread = _NARROW * self._spread if narrow else self._spread
            self.linear, step, self._scale = linearised(model, estimate, spread, data)
            self.fitted = best_on_line(model, estimate, step, data, self._scale, duration)
            estimate = self.fitted.estimate
            self._spread = square_root(self.linear.covariance[POSITION:, POSITION:])
            narrow = (
                not self.fitted.gain > 0.0 and not narrow and _promise(self.linear, step) > _FAR
            )
            if k >= steps and not (narrow or self.fitted.gain > _FAR):
                break
        self._data = data
        assert self.fitted is not None  # noqa: S101 - for the type checker
        return self.fitted

    def landings(self, belief: nutation.SpinBelief | None = None) -> FloatArray:
        """Return likely landings, see `ellipse.drawn_landings`."""
        if self.fitted is None or self.linear is None or self._data is None:
            return np.empty((0, 3))
        now = float(self._data.time[-1])
        return drawn_landings(self._model, self.fitted.estimate, self.linear, now, belief)

    def spins(self) -> nutation.SpinBelief | None:
        """Weigh spins by the nutation in the axes; None while too little was measured of them."""
        fitted, linear, data, model = self.fitted, self.linear, self._data, self._model
        if fitted is None or linear is None or data is None or not data.has_axis:
            return None
        if data.time[-1] < nutation.LEAST_TIME:
            return None
        throws = model.moved(fitted.estimate, np.zeros((1, model.unknowns)))
        tracks = model.tracker.fly(throws.states, throws.rows, data.time, 0.0)
        state, axes = fitted.estimate.state, tracks.sights[0, :, POSITION:, 0]
        sigma = math.sqrt(linear.covariance[model.spin, model.spin])
        plain = Gaussian(float(state[nutation.SPIN]), sigma)
        scale = float(self._scale[POSITION])
        return nutation.weighed(model, state, tracks.last[0], plain, data, axes, scale)

    def with_spin(self, spin: Gaussian) -> 'ThrowEstimator':
        """Return an estimator that knows the spin [rad/s], to be updated from this estimate."""
        assert self.fitted is not None  # noqa: S101 - for the type checker
        assert self.linear is not None  # noqa: S101 - for the type checker
        model, estimate = self._model, self.fitted.estimate
        move = (spin.mean - estimate.state[nutation.SPIN]) * self.linear.along(model.spin)
        other = ThrowEstimator(model.knowing(spin))
        other.fitted = replace(self.fitted, estimate=model.moved(estimate, move[None])[0])
        other.linear, other._spread, other._scale = self.linear, self._spread, self._scale
        other._data = self._data
        return other

    @property
    def is_settled(self) -> bool:
        """Return True if the first steps are made."""
        return self.fitted is not None and not self._left

    @property
    def is_lost(self) -> bool:
        """Return True if the estimate is far from the measurements."""
        return self.fitted is None or not math.isfinite(self.fitted.cost) or self._scale[0] > _LOST

    @property
    def log_evidence(self) -> float:
        """Return the logarithm of the probability of the measurements, but for a constant.

        By Laplace's method, comparable between discs.
        """
        if self.fitted is None or self.linear is None or self._data is None:
            return -math.inf
        if not np.isfinite(self.linear.covariance).all():  # a spin about 0 has no precession
            return -math.inf
        _, volume = np.linalg.slogdet(self.linear.covariance)
        measured = np.count_nonzero(self._data.per_sigma, axis=0)
        scales = float(measured @ np.log(self._scale) + np.sum(np.log(self._model.sigmas)))
        return 0.5 * float(volume) - self.fitted.cost - scales


def _promise(linear: Linear, step: FloatArray) -> float:
    """Return the gain in cost that a Gauss-Newton step would have if all were linear."""
    return 0.5 * float(step @ np.linalg.solve(linear.covariance, step))


def _first_spread(model: Model) -> FloatArray:
    """Return the standard deviations with which the first derivatives are taken."""
    prior, v = model.prior, _FIRST_VELOCITY
    rates = (prior.rate.sigma, prior.rate.sigma, prior.spin.sigma)
    every = np.array([0.0, 0.0, 0.0, v, v, v, _FIRST_LIFT, prior.bank.sigma, *rates])
    return np.diag([*every[model.coordinates][POSITION:], *model.sigmas])


def first_estimate(model: Model, data: Measurements) -> Estimate:
    """Return a throw through the first measurements.

    Its attitude is the median of those measured, else that of the prior.
    """
    velocity, position = straight(data.time, data.position)
    measured = data.axis[np.isfinite(data.axis).all(axis=1)]
    if len(measured):
        down = np.median(measured, axis=0)
    else:
        nose, bank = model.prior.nose.mean, model.prior.bank.mean
        down = lift_coordinates.axis_in_flow(velocity, nose, bank)
    rate = model.prior.rate.mean
    state = [*position, *velocity, *local.attitude(down), rate, rate, model.prior.spin.mean, 0.0]
    return Estimate(np.array(state), model.means.copy())


def straight(time: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return velocity and position at time 0 of the line through points.

    They are medians, so that a minority of outliers has little effect.

    Args:
        time: Times, not all equal [s], shape (k,).
        position: Points [m], shape (k, 3).
    """
    few = slice(None, None, max(1, len(time) // 24))
    t, x = time[few], position[few]
    i, j = np.triu_indices(len(t), 1)
    gap = t[j] - t[i]
    keep = gap >= _SHORTEST_GAP * gap.max()
    velocity = np.median((x[j] - x[i])[keep] / gap[keep, None], axis=0)
    return velocity, np.median(x - t[:, None] * velocity, axis=0)
