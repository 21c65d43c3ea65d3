"""One throw, estimated with each of several models: which it is, and where it lands.

Models differ in the disc, or in the way in which it spins.
"""

from collections.abc import Sequence

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.prediction.ellipse import covariance_about
from disc_sim_ros.estimation.prediction.throw_estimator import ThrowEstimator
from disc_sim_ros.estimation.prediction.throw_fit import Fitted, Linear, Measurements, Model

LEAST_WEIGHT = 1e-6  # a model below it is left out for the rest of the throw


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

    @property
    def fitted(self) -> Fitted:
        """Return the fit of the most likely disc, after an update."""
        fitted = self._estimators[self.best].fitted
        assert fitted is not None  # noqa: S101 - for the type checker
        return fitted

    @property
    def linear(self) -> Linear:
        """Return the linear fit of the most likely disc, after an update."""
        linear = self._estimators[self.best].linear
        assert linear is not None  # noqa: S101 - for the type checker
        return linear

    def update(self, data: Measurements, steps: int = 1, *, unlikely: bool = True) -> Fitted:
        """Fit all measurements of the throw with each model; return the fit of the most likely.

        Args:
            data: All measurements so far, the first at time 0.
            steps: Gauss-Newton steps; the first update makes more.
            unlikely: Update the unlikely models, too, and the probabilities.
        """
        kept = self._kept
        for i in kept:
            if unlikely or i < self._likely or i == self.best:
                self._estimators[i].update(data, steps)
        if len(kept) > 1 and (unlikely or kept[-1] < self._likely):
            evidence = np.array([self._estimators[i].log_evidence for i in kept])
            evidence += self._expected[kept]
            if np.isfinite(evidence).any():
                probable = np.exp(evidence - evidence[np.isfinite(evidence)].max())
                self.weights[:] = 0.0
                self.weights[kept] = probable / probable.sum()
                self.best = int(np.argmax(self.weights))
        return self.fitted

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
            if i < self._likely or i == self.best:
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
