"""Recorded measurements through the predictor, as if they came in now."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
import itertools

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation import throw_csv
from disc_sim_ros.estimation.prediction.predictor import (
    Measurement,
    Prediction,
    Predictor,
    PredictorConfig,
)
from disc_sim_ros.physics.frames import flip, paper_from_map, paper_quaternion, rotation_matrix
from disc_sim_ros.physics.trajectory import COLUMNS, Trajectory
from disc_sim_ros.quantities import POSITION

ELLIPSE_PERIOD = 0.05  # s of measurements between two ellipses
# The same between two updates at least: about the time that one takes. A measurement may come a
# tenth of it early.
UPDATE_PERIOD, _EARLY = 1.0 / 240.0, 0.1
_SHORTEST_QUATERNION = 1e-6


@dataclass(frozen=True, slots=True)
class FollowedThrow:
    """The predictions of one throw.

    Attributes:
        number: From 1.
        recording: Name of its recording.
        name: For people: that of its recording, where there are several, or `throw 1`.
        predictions: In the order of the measurements. Each has the covariance of the last
            ellipse, as `predictor_node` publishes it.
        measurements: Those from the beginning of the throw to the last prediction.
    """

    number: int
    recording: str
    name: str
    predictions: tuple[Prediction, ...]
    measurements: tuple[Measurement, ...]

    @property
    def landing(self) -> FloatArray:
        """Return x, y [m] and time [s] of the landing of the last prediction, shape (3,)."""
        last = self.predictions[-1]
        return np.array([*last.landing, last.landing_time])

    @property
    def is_complete(self) -> bool:
        """Return True if at most a tenth of a second is left after the last measurement."""
        last = self.predictions[-1]
        return last.landing_time - last.time < 0.1

    @property
    def watched(self) -> FloatArray:
        """Return for how long the throw had been measured at each prediction [s]."""
        return np.array([p.time - p.reference_time for p in self.predictions])

    @property
    def misses(self) -> FloatArray:
        """Return how far each prediction is from the landing [m]."""
        return np.array(
            [np.hypot(*(p.landing - self.landing[:2])) for p in self.predictions], dtype=float
        )

    def at(self, watched: float) -> Prediction | None:
        """Return the last prediction up to a time of watching [s]; None if there is none."""
        known = np.flatnonzero(self.watched <= watched + 1e-9)
        return self.predictions[known[-1]] if len(known) else None


def replay(
    recordings: Mapping[str, Iterable[Measurement]],
    config: PredictorConfig,
    progress: Callable[[int], object] = lambda _: None,
) -> list[FollowedThrow]:
    """Return the predictions of every throw in recordings, each with a clock of its own.

    As in `predictor_node`, which takes all that has arrived and predicts once, measurements that
    come faster than 240 times a second share an update.

    Args:
        recordings: Measurements in their order, by the name of the recording.
        config: What is known beforehand.
        progress: Called after each measurement with the number of those so far.
    """
    throws: list[FollowedThrow] = []
    counted = itertools.count(1)
    for recording, series in recordings.items():
        replayed = _replayed(series, config, lambda: progress(next(counted)))
        for k, (predictions, measured) in enumerate(replayed, 1):
            number = len(throws) + 1
            name = f'throw {number}'
            if len(recordings) > 1:
                name = recording if len(replayed) == 1 else f'{recording}, {k}'
            throws.append(FollowedThrow(number, recording, name, predictions, measured))
    return throws


def _replayed(
    measurements: Iterable[Measurement], config: PredictorConfig, taken: Callable[[], object]
) -> list[tuple[tuple[Prediction, ...], tuple[Measurement, ...]]]:
    """Return predictions and measurements of each throw in one series of measurements."""
    predictor = Predictor(config)
    throws: dict[int, list[Prediction]] = {}
    every: list[Measurement] = []
    updated, last, covariance = -np.inf, -np.inf, np.full((3, 3), np.nan)
    shortest = (1.0 - _EARLY) * UPDATE_PERIOD
    for m, following in itertools.pairwise(itertools.chain(measurements, [None])):
        assert m is not None  # noqa: S101 - for the type checker
        every.append(m)
        predictor.add(m)
        if following is None or not updated <= m.time < updated + shortest:
            updated = m.time
            prediction = predictor.update(ellipse=not last <= m.time < last + ELLIPSE_PERIOD)
            if prediction is not None:
                if np.isfinite(prediction.covariance).all():
                    last, covariance = m.time, prediction.covariance
                prediction = replace(prediction, covariance=covariance)
                throws.setdefault(prediction.throw, []).append(prediction)
        taken()
    return [
        (tuple(of), tuple(m for m in every if of[0].reference_time <= m.time <= of[-1].time))
        for of in throws.values()
    ]


def fitted_flight(throw: FollowedThrow, config: PredictorConfig, rate: float) -> Trajectory:
    """Return the flight that fits all measurements of a throw, up to its landing.

    Args:
        throw: A throw of `replay`.
        config: The configuration of that `replay`.
        rate: Samples a second [Hz].

    Returns:
        The flight by the model of the predictor, which has no nutation, over the ground. Time 0 is
        the first measurement; the wind is the estimated one.
    """
    last = throw.predictions[-1]
    setup = config.setups[last.disc]
    whole = replace(last, time=last.reference_time)
    times, states = Predictor(config).path(whole, rate)
    rows = np.empty((len(times), COLUMNS))
    rows[:, 0] = times - last.reference_time
    rows[:, 1:-3] = states
    rows[:, -3:] = paper_from_map(np.array([*last.wind, flip(setup.wind.mean[2])]))
    return Trajectory(rows, setup.disc.diameter)


def measurements(
    time: FloatArray, position: FloatArray, quaternion: FloatArray | None = None
) -> list[Measurement]:
    """Return measurements from columns, in `map`.

    Rows that are not finite, or beyond the range of `quantities.POSITION`, are left out.

    Args:
        time: By any clock [s], shape (n,).
        position: x, y, z [m], shape (n, 3).
        quaternion: x, y, z, w of `disc` in `map`, shape (n, 4); those of length 0 are no attitude.
    """
    axes: Sequence[tuple[float, float, float] | None] = [None] * len(time)
    if quaternion is not None:
        axes = [_axis(q) for q in quaternion]
    return [
        Measurement(float(t), (float(x), float(y), float(z)), axis)
        for t, (x, y, z), axis in zip(time, position, axes, strict=True)
        if np.isfinite(t) and (np.abs([x, y, z]) <= POSITION.highest).all()
    ]


def _axis(quaternion: FloatArray) -> tuple[float, float, float] | None:
    """Return the direction of z of `disc`, up, in `map`; None without an attitude."""
    norm = float(np.linalg.norm(quaternion))
    if not _SHORTEST_QUATERNION < norm < 1.0 / _SHORTEST_QUATERNION:
        return None
    down = rotation_matrix(paper_quaternion(quaternion / norm))[:, 2]
    return -float(down[0]), float(down[1]), float(down[2])


def measurements_of(name: str, columns: throw_csv.Columns) -> list[Measurement]:
    """Return measurements at the times of the positions, with the attitudes of those times.

    Args:
        name: Of the throw, for errors.
        columns: What `throw_csv.read` returns of it.

    Raises:
        ConfigError: There is no position, or one too far away for any field.
    """
    if 'position' not in columns:
        needed = ', '.join((throw_csv.TIME, *throw_csv.GROUPS['position']))
        raise ConfigError('FILE', f'{name}: {", ".join(columns) or "nothing"}', f'give {needed}')
    time, position = columns['position']
    far = float(np.abs(position).max())
    if far > POSITION.highest:
        allowed = f'{POSITION.allowed}; are the positions in m?'
        raise ConfigError('FILE', f'{name}: {far:g}', allowed)
    quaternion = None
    if 'attitude' in columns:
        quaternion = np.zeros((len(time), 4))
        at, attitudes = columns['attitude']
        _, places, rows = np.intersect1d(time, at, return_indices=True)
        quaternion[places] = attitudes[rows]
    return measurements(time, position, quaternion)
