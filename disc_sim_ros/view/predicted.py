"""What a predictor knew of a throw while it flew, as a page shows it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.units import System
from disc_sim_ros.view.rounding import plain

# A page holds fewer of them than samples of the flight, because each takes more space.
_SAMPLES_A_MEASUREMENT = 4
_SAMPLES_A_PREDICTION = 15
SHARE = 0.9  # of the landings in the ellipse


@dataclass(frozen=True, eq=False)
class ShownPredictions:
    """The measurements of a throw and what was predicted from them, in `map` over the ground.

    Times are since the first measurement [s] and ascend.

    Attributes:
        measured_time: Shape (k,).
        measured: Measured positions [m], shape (k, 3).
        time: Of the newest measurement of each prediction, shape (m,), at least one.
        landing: x, y of the predicted landings [m], shape (m, 2).
        ellipse: Ellipse that holds `SHARE` of the landings: half of its long and of its short
            axis [m], and the direction of the long one from x towards y [rad], shape (m, 3).
        miss: Distance of the predicted landings from the landing [m], shape (m,).
        paths: Predicted path of each prediction up to its landing [m], each of shape (any, 3).
    """

    measured_time: FloatArray
    measured: FloatArray
    time: FloatArray
    landing: FloatArray
    ellipse: FloatArray
    miss: FloatArray
    paths: Sequence[FloatArray]


def curve_labels(system: System) -> list[tuple[str, str, str]]:
    """Return name, unit and the meaning of the dotted line of the curve of `curves`."""
    return [('miss of the landing', system.length, 'dotted: 90 % ellipse, half its length')]


def curves(shown: ShownPredictions, t: FloatArray, system: System) -> list[list[float | None]]:
    """Return the miss and half the length of the ellipse at some times; null without prediction.

    Args:
        shown: The predictions.
        t: Since the first measurement [s], shape (n,).
        system: Units of the values.
    """
    which = np.searchsorted(shown.time, t + 1e-9, side='right') - 1
    # The end of the flight may be a little after the last measurement, but not long after it.
    known = (which >= 0) & (t < shown.time[-1] + 0.1)
    return [
        plain(np.where(known, system.number(values[which], 'm'), np.nan), 4)
        for values in (shown.miss, shown.ellipse[:, 0])
    ]


def document(shown: ShownPredictions, most: int) -> dict[str, Any]:
    """Return predictions as values that JSON knows, in m and rad.

    Args:
        shown: The predictions.
        most: Largest number of samples of the flight; measurements and predictions are thinned to
            a share of it.
    """
    m = _chosen(len(shown.measured_time), most // _SAMPLES_A_MEASUREMENT)
    p = _chosen(len(shown.time), most // _SAMPLES_A_PREDICTION)
    return {
        'measuredTime': plain(shown.measured_time[m], 4),
        'measured': plain(shown.measured[m], 3),
        't': plain(shown.time[p], 4),
        'landing': plain(shown.landing[p], 3),
        'ellipse': plain(shown.ellipse[p], 4),
        'paths': [plain(shown.paths[i], 2) for i in p],
    }


def _chosen(n: int, most: int) -> list[int]:
    """Return the places of at most `most` of n values, evenly spread, with the first and last."""
    chosen: list[int] = np.unique(
        np.linspace(0, n - 1, min(n, max(2, most))).round().astype(int)
    ).tolist()
    return chosen
