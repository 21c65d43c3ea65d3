"""One throw, estimated with each of several models: which it is, and where it lands.

Models differ in the disc, or in the way in which it spins.
"""

from collections.abc import Sequence
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.prediction.ellipse import covariance_about
from disc_sim_ros.estimation.prediction.nutation import SPIN, SpinBelief
from disc_sim_ros.estimation.prediction.throw_estimator import MOST_MORE, ThrowEstimator
from disc_sim_ros.estimation.prediction.throw_fit import Fitted, Linear, Measurements, Model

LEAST_WEIGHT = 1e-6  # a model below it is left out for the rest of the throw
_WEIGHING_PERIOD = 0.1  # s
_NEARING_PERIOD = 0.03  # s, with which the plain estimate follows
_CERTAIN = 0.99  # probability of a model from which spins are weighed
_SAME_SPIN = 2.0  # rad/s within which an estimate with another spin goes on
_FIRST_STEPS = 3  # of an unlikely model in one update
_TOLD_STEPS = 2  # with a spin that the nutation tells
_WORSE = 30.0  # half squares by which a throw with a known spin may fit worse, and no more


class DiscChoice:
    """The estimates of one throw, and how likely each model is.

    Attributes:
        weights: Probability of each model, shape (n,); before the first update as expected.
        best: The place of the most likely one.
    """

    def __init__(
        self, models: Sequence[Model], unlikely: Sequence[Model] = (), share: float = 0.0
    ) -> None:
        """Begin with the probabilities that are expected.

        Args:
            models: The models, equally likely.
            unlikely: Models that are less likely, equally; their numbers follow those of `models`.
            share: Probability of all of `unlikely`.
        """
        self._estimators = [ThrowEstimator(model) for model in (*models, *unlikely)]
        self._likely = len(models)
        self.weights = np.full(len(self._estimators), (1.0 - share) / len(models))
        self.weights[len(models) :] = share / max(len(unlikely), 1)
        self._expected = np.log(np.maximum(self.weights, LEAST_WEIGHT))
        self.best = 0
        self._by_nutation: ThrowEstimator | None = None  # follows the spin that it tells
        self._belief: SpinBelief | None = None
        self._weighed = -math.inf  # s since the first measurement, when spins were weighed
        self._neared = -math.inf  # s, when the plain estimate was updated beside the leading one
        self._prepared = False  # the models are fitted from which spins will be weighed

    @property
    def _leading(self) -> ThrowEstimator:
        return self._by_nutation or self._estimators[self.best]

    @property
    def fitted(self) -> Fitted:
        """Return the fit of the most likely disc, after an update."""
        fitted = self._leading.fitted
        assert fitted is not None  # noqa: S101 - for the type checker
        return fitted

    @property
    def linear(self) -> Linear:
        """Return the linear fit of the most likely disc, after an update."""
        linear = self._leading.linear
        assert linear is not None  # noqa: S101 - for the type checker
        return linear

    def update(self, data: Measurements, steps: int = 1, *, unlikely: bool = True) -> Fitted:
        """Fit all measurements of the throw; return the fit of the most likely model.

        Args:
            data: All measurements so far, the first at time 0.
            steps: Gauss-Newton steps; the first update makes more.
            unlikely: Update the unlikely models, too, and the probabilities; or weigh spins.
        """
        now = float(data.time[-1])
        due = unlikely and now >= self._weighed + _WEIGHING_PERIOD
        if due and self._prepared:
            self._weigh(data, steps)
            return self.fitted
        near = due or (unlikely and now >= self._neared + _NEARING_PERIOD)
        if self._by_nutation is not None:
            most = MOST_MORE if unlikely else 1  # an ellipse takes as long as two steps
            self._by_nutation.update(data, steps, 0 if near else most)
        if self._by_nutation is None or due:
            self._update_models(data, steps, unlikely=unlikely)
        elif near:
            self._estimators[self.best].update(data, steps, 1)
        self._neared = now if near else self._neared
        self._prepared = due or (self._prepared and self._by_nutation is not None)
        return self.fitted

    def _update_models(self, data: Measurements, steps: int, *, unlikely: bool) -> None:
        """Fit all measurements with each model, and weigh them."""
        kept = self._kept
        for i in kept:
            if i == self.best and self._by_nutation is None:
                self._estimators[i].update(data, steps)
            elif i < self._likely or i == self.best:
                self._estimators[i].update(data, steps, 1 if self._by_nutation else MOST_MORE)
            elif unlikely:  # it comes near in several updates
                self._estimators[i].update(data, steps, 1, _FIRST_STEPS)
        settled = all(self._estimators[i].is_settled for i in kept)
        if len(kept) > 1 and settled and (unlikely or kept[-1] < self._likely):
            evidence = np.array([self._estimators[i].log_evidence for i in kept])
            evidence += self._expected[kept]
            if np.isfinite(evidence).any():
                probable = np.exp(evidence - evidence[np.isfinite(evidence)].max())
                self.weights[:] = 0.0
                self.weights[kept] = probable / probable.sum()
                best, self.best = self.best, int(np.argmax(self.weights))
                if self.best != best:
                    self._by_nutation = None

    def _weigh(self, data: Measurements, steps: int) -> None:
        """Weigh spins by the models as the update before has left them: both would take long."""
        self._weighed, self._prepared = float(data.time[-1]), False
        self._by_nutation = self._with_told_spin(data, steps)
        if self._by_nutation is None:
            self._update_models(data, steps, unlikely=False)

    def _with_told_spin(self, data: Measurements, steps: int) -> ThrowEstimator | None:
        """Return an estimate with the spin that the nutation tells, beside the plain one.

        None where it tells nothing, or another model may be right.
        """
        plain, other = self._estimators[self.best], self._by_nutation
        certain = self.weights[self.best] > _CERTAIN and not plain.is_lost
        self._belief = plain.spins() if certain else None
        if self._belief is None or plain.fitted is None:
            return None
        spin = self._belief.estimate
        if other is not None and other.fitted is not None:
            off = abs(float(other.fitted.estimate.state[SPIN]) - spin.mean)
            other = (
                None if off > _SAME_SPIN else other if off < spin.sigma else other.with_spin(spin)
            )
        if other is None:
            other, steps = plain.with_spin(spin), _TOLD_STEPS
        fitted = other.update(data, steps, 0)
        as_good = plain.fitted.cost * len(data.time) / len(plain.fitted.squares)
        return None if other.is_lost or fitted.cost - as_good > _WORSE else other

    @property
    def _kept(self) -> list[int]:
        return [int(i) for i in np.flatnonzero(self.weights >= LEAST_WEIGHT)]

    def landing_covariance(self) -> FloatArray:
        """Return the covariance of X, Y [m] and time [s] about the landing, shape (3, 3).

        Over all models: one that lands elsewhere counts by its weight. Of an unlikely one only
        the landing counts, not its spread, which would take as long again. nan if too few of the
        drawn throws land.
        """
        landings, weights = [], []
        for i in self._kept:
            if i == self.best:
                of_one = self._leading.landings(self._belief if self._by_nutation else None)
            elif i < self._likely:
                of_one = self._estimators[i].landings()
            else:
                of_one = self._landing_of(i)
            of_one = of_one[np.isfinite(of_one).all(axis=1)]
            landings.append(of_one)
            weights.append(np.full(len(of_one), self.weights[i] / max(len(of_one), 1)))
        return covariance_about(
            self.fitted.landing, np.concatenate(landings), np.concatenate(weights)
        )

    def _landing_of(self, i: int) -> FloatArray:
        fitted = self._estimators[i].fitted
        return np.empty((0, 3)) if fitted is None else fitted.landing[None]
