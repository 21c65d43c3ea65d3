"""The page of `predict --html`: throws, and what was predicted of them while they flew."""

from typing import TYPE_CHECKING

import numpy as np

from disc_sim_ros.estimation.prediction.ellipse import half_axes
from disc_sim_ros.estimation.prediction.predictor import Prediction, Predictor
from disc_sim_ros.estimation.prediction.replay import fitted_flight
from disc_sim_ros.physics.frames import map_from_paper
from disc_sim_ros.view.predicted import SHARE, ShownPredictions
from disc_sim_ros.view.shown import ShownFlight

if TYPE_CHECKING:
    from disc_sim_ros.arrays import FloatArray
    from disc_sim_ros.estimation.prediction.predictor import PredictorConfig
    from disc_sim_ros.estimation.prediction.replay import FollowedThrow
    from disc_sim_ros.units import System

RATE = 200.0  # Hz, samples of the fitted flight
_POINTS = 24  # of a predicted path, about


def shown_throw(
    throw: 'FollowedThrow', config: 'PredictorConfig', system: 'System'
) -> ShownFlight:
    """Return a throw as a page shows it: heights are over the ground of the predictor."""
    x, y, _ = throw.landing
    last = throw.predictions[-1]
    side = 'left' if y >= 0.0 else 'right'
    ends = 'lands' if throw.is_complete else 'measured in part, would land'
    result = (
        f'{ends} after {last.landing_time - last.reference_time:.2f} s at '
        f'x {system.text(x, "m")}, '
        f'{system.text(abs(y), "m")} to the {side}'
    )
    begin = last.reference_time
    ellipses = [half_axes(p.covariance[:2, :2], SHARE) for p in throw.predictions]
    predictor = Predictor(config)
    shown = ShownPredictions(
        measured_time=np.array([m.time - begin for m in throw.measurements]),
        measured=np.array([m.position for m in throw.measurements])
        - (0.0, 0.0, config.ground_height),
        time=throw.watched,
        landing=np.array([p.landing for p in throw.predictions]),
        ellipse=np.array(ellipses),
        miss=throw.misses,
        paths=[_path(predictor, p) for p in throw.predictions],
    )
    flight = fitted_flight(throw, config, RATE)
    return ShownFlight(throw.name, result, flight, predictions=shown)


def _path(predictor: Predictor, p: Prediction) -> 'FloatArray':
    """Return the predicted path to the landing in `map` [m], shape (any, 3)."""
    left = max(p.landing_time - p.time, 0.1)
    _, states = predictor.path(p, _POINTS / left)
    return map_from_paper(states[:, :3])
