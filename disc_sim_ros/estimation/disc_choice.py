"""One throw, estimated with each of several discs: which it is, and where it lands."""

from collections.abc import Sequence

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.ellipse import covariance_about
from disc_sim_ros.estimation.throw_estimator import ThrowEstimator
from disc_sim_ros.estimation.throw_fit import Fitted, Linear, Measurements, Model

LEAST_WEIGHT = 1e-6  # a disc below it is left out for the rest of the throw


class DiscChoice:
    """The estimates of one throw, and how likely each disc is.

    Attributes:
        weights: Probability of each disc, shape (n,); equal before the first update.
        best: The place of the most likely one.
    """

    def __init__(self, models: Sequence[Model]) -> None:
        """Begin with every disc equally likely."""
        self._estimators = [ThrowEstimator(model) for model in models]
        self.weights = np.full(len(models), 1.0 / len(models))
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

    def update(self, data: Measurements, steps: int = 1) -> Fitted:
        """Fit all measurements of the throw with each disc; return the fit of the most likely.

        Args:
            data: All measurements so far, the first at time 0.
            steps: Gauss-Newton steps; the first update makes more.
        """
        kept = self._kept
        for i in kept:
            self._estimators[i].update(data, steps)
        if len(kept) > 1:
            evidence = np.array([self._estimators[i].log_evidence for i in kept])
            if np.isfinite(evidence).any():
                likely = np.exp(evidence - evidence[np.isfinite(evidence)].max())
                self.weights[:] = 0.0
                self.weights[kept] = likely / likely.sum()
                self.best = int(np.argmax(self.weights))
        return self.fitted

    @property
    def _kept(self) -> list[int]:
        return [int(i) for i in np.flatnonzero(self.weights >= LEAST_WEIGHT)]

    def landing_covariance(self) -> FloatArray:
        """Return the mean squares of X, Y [m] and time [s] about the landing, shape (3, 3).

        Over all discs: a disc that lands elsewhere widens it by its weight. nan if too few of the
        drawn throws land.
        """
        about, total, weight = self.fitted.landing, np.zeros((3, 3)), 0.0
        for i in self._kept:
            covariance = covariance_about(self._estimators[i].landings(), about)
            if np.isfinite(covariance).all():
                total += self.weights[i] * covariance
                weight += self.weights[i]
        return total / weight if weight > 0.0 else np.full((3, 3), np.nan)
