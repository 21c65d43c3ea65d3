"""The predictor of landings: a stream of measurements in, predictions of each throw out."""

from dataclasses import dataclass, field, replace
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation import local, throw_detection
from disc_sim_ros.estimation.prior import ThrowPrior
from disc_sim_ros.estimation.throw_estimator import ThrowEstimator
from disc_sim_ros.estimation.throw_fit import Estimate, Fitted, Measurements, Model
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.frames import map_from_paper, paper_from_map
from disc_sim_ros.physics.kernels.rows import AT
from disc_sim_ros.physics.sampled import fly_sampled

MOST_MEASUREMENTS = 600  # of one throw; of more, every second of the older half is left out
STEP = 0.02  # s; without nutation within 26 mm, 0.2 mm in the median (docs/predictor.md)
MODEL = 'precession'  # nutation cannot be followed over a flight: its phase is lost
# Factor of the covariance of a landing where no attitude was measured. The profile finds too
# little of the curved range of winds and attitudes that fit. With this factor nine of ten landings
# of about 40 throws lay in the ellipse, without it 76 % (docs/predictor.md).
WITHOUT_ATTITUDE = 2.0
MORE = 4  # Gauss-Newton steps before a throw is taken to have ended
_ORDER = 1e-9  # s between two measurements
_BACK = 1.0  # s by which time is set back, not a late measurement


@dataclass(frozen=True, kw_only=True)
class PredictorConfig:
    """What a predictor is told.

    Attributes:
        setup: Disc, air, profile of the wind and ground contact. Its model and step are replaced.
        prior: Release, wind and uncertainty of the disc.
        position_sigma: Standard deviation of each coordinate of a position [m].
        attitude_sigma: Standard deviation of the disc's axis in each direction [rad].
        duration: Longest flight [s].
        ground_height: z of the ground in `map` [m].
    """

    setup: Setup
    prior: ThrowPrior = field(default_factory=ThrowPrior)
    position_sigma: float = 0.02
    attitude_sigma: float = math.radians(2.0)
    duration: float = 15.0
    ground_height: float = 0.0

    @property
    def model(self) -> Model:
        """Return the model of the throws."""
        return Model(replace(self.setup, model=MODEL), self.prior, STEP, self.duration)


@dataclass(frozen=True, slots=True)
class Measurement:
    """One measurement of a disc, in `map`.

    Attributes:
        time: By any clock [s].
        position: x, y, z of the centre [m].
        axis: Disc's axis, up through its top, of any length; None if it was not measured.
        position_sigma: Standard deviation of each coordinate [m]; None for the configured one.
    """

    time: float
    position: tuple[float, float, float]
    axis: tuple[float, float, float] | None = None
    position_sigma: float | None = None

    def __post_init__(self) -> None:
        for name, values in (('time', (self.time,)), ('position', self.position)):
            if not all(map(math.isfinite, values)):
                raise ConfigError(f'measured {name}', values, 'give finite numbers')
        if self.axis is not None and not (math.isfinite(n := math.hypot(*self.axis)) and n > 0.0):
            raise ConfigError('measured axis', self.axis, 'give a finite direction')
        sigma = self.position_sigma
        if sigma is not None and not (math.isfinite(sigma) and sigma > 0.0):
            raise ConfigError('measured position_sigma', sigma, 'give a number above 0')


@dataclass(frozen=True, kw_only=True, slots=True)
class Prediction:
    """Where a throw will land, in `map`; all of it belongs to the newest measurement.

    Attributes:
        throw: Number of the throw, from 1.
        time: Of the newest measurement [s].
        landing_time: By the clock of the measurements [s].
        landing: x, y of the landing [m], shape (2,).
        covariance: Of x, y [m] and time [s] of the landing, shape (3, 3); nan if it was not asked.
        state: State at `time`, paper's axes, shape (14,), its Z over the ground.
        state_covariance: Of its position and velocity, in `map`, shape (6, 6).
        wind: Estimated velocity of the air, x and y [m/s].
        wind_covariance: Of x and y, shape (2, 2).
        used: Share of the measurements with a weight of at least one half.
        flight: The throw from its first measurement on; see `Predictor.path`.
        reference_time: Time of its first measurement [s].
    """

    throw: int
    time: float
    landing_time: float
    landing: FloatArray
    covariance: FloatArray
    state: FloatArray
    state_covariance: FloatArray
    wind: FloatArray
    wind_covariance: FloatArray
    used: float
    flight: Estimate
    reference_time: float


class Predictor:
    """Finds throws in a stream of measurements and predicts their landings.

    `add` takes a measurement and is cheap; `update` computes. So a caller that is late adds all
    that has arrived and updates once. The same calls give the same bits.

    Attributes:
        throws: Number of throws found so far.
        late: Measurements that came too late to be used, so far.
    """

    def __init__(self, config: PredictorConfig) -> None:
        """Wait for a throw."""
        self._config = config
        self._model = config.model
        self._estimator: ThrowEstimator | None = None
        self._rows: list[FloatArray] = []  # time, position, sigma, axis; ascending
        self._new = False
        self.throws = 0
        self.late = 0

    @property
    def is_following(self) -> bool:
        """Return True during a throw."""
        return self._estimator is not None

    @property
    def newest(self) -> float:
        """Return the time of the newest measurement [s]; -inf before the first."""
        return float(self._rows[-1][0]) if self._rows else -math.inf

    def reset(self) -> None:
        """Forget the throw and its measurements."""
        self._estimator, self._rows, self._new = None, [], False

    def add(self, m: Measurement) -> bool:
        """Take a measurement, in any order; return False if it came too late or twice."""
        if self._rows and m.time < self._rows[-1][0] - _BACK:
            self.reset()  # the clock was set back
        place = len(self._rows)
        while place and self._rows[place - 1][0] > m.time:
            place -= 1
        twice = place and m.time - self._rows[place - 1][0] < _ORDER
        if twice or (place == 0 and self._estimator is not None):
            self.late += 1
            return False
        self._rows.insert(place, self._row(m))
        self._new = True
        if self._estimator is None:
            self._rows = self._rows[throw_detection.first_of_window(self._times()) :]
        elif len(self._rows) > MOST_MEASUREMENTS:
            half = len(self._rows) // 2
            self._rows = self._rows[:half:2] + self._rows[half:]
        return True

    def _times(self) -> FloatArray:
        """Return the times of the measurements that are kept [s]."""
        return np.array([row[0] for row in self._rows])

    def _row(self, m: Measurement) -> FloatArray:
        x, y, z = m.position
        at = paper_from_map([x, y, z - self._config.ground_height])
        sigma = m.position_sigma or self._config.position_sigma
        axis = np.full(3, np.nan)
        if m.axis is not None:
            axis = -paper_from_map(np.array(m.axis) / math.hypot(*m.axis))
        return np.array([m.time, *at, sigma, *axis])

    def update(self, *, profiled: bool = True) -> Prediction | None:
        """Return the prediction from all measurements so far.

        Args:
            profiled: With the covariance of the landing from a profile; else from the linear fit,
                which is too small with positions only, in a fraction of the time.

        Returns:
            The prediction; None while no throw is in the air, or without new measurements.
        """
        if not self._new:
            return None
        self._new = False
        data = self._measurements()
        if self._estimator is None:
            first = throw_detection.beginning(data.time, data.position, data.sigma)
            if first is None:
                return None
            self._estimator = ThrowEstimator(self._model)
            self.throws += 1
            self._rows = self._rows[first:]
            data = self._measurements()
        fitted = self._estimator.update(data)
        if _has_ended(fitted, data) and _has_ended(self._estimator.update(data, MORE), data):
            self.reset()
            return None
        if not np.isfinite(fitted.landing).all():
            return None
        return self._prediction(self._estimator, data, profiled=profiled)

    def _measurements(self) -> Measurements:
        rows = np.array(self._rows)
        return Measurements(
            time=rows[:, 0] - rows[0, 0],
            position=rows[:, 1:4],
            sigma=rows[:, 4],
            axis=rows[:, 5:8],
            axis_sigma=np.full(len(rows), self._config.attitude_sigma),
        )

    def _prediction(
        self, estimator: ThrowEstimator, data: Measurements, *, profiled: bool
    ) -> Prediction | None:
        fitted, linear = estimator.fitted, estimator.linear
        if fitted is None or linear is None:
            return None
        names = list(self._model.prior.constants)
        wind, spread = np.zeros(2), np.zeros((2, 2))
        first = len(self._model.coordinates)
        of_wind = {}
        for i, name in enumerate(('wind_x', 'wind_y')):
            wind[i] = self._model.row[AT[name]]
            if name in names:
                of_wind[i] = first + names.index(name)
                wind[i] = fitted.estimate.constants[names.index(name)]
        for i, a in of_wind.items():
            for j, b in of_wind.items():
                spread[i, j] = linear.covariance[a, b]
        turn = np.diag([*map_from_paper(np.ones(3))[:2], 1.0])  # X, Y, time to x, y, time
        covariance = turn @ estimator.landing_covariance(profiled=profiled) @ turn
        if not data.has_axis:
            covariance = WITHOUT_ATTITUDE * covariance
        squared = np.sum(fitted.measured[:, :3] ** 2, axis=1)
        start = float(self._rows[0][0])
        return Prediction(
            throw=self.throws,
            time=start + float(data.time[-1]),
            landing_time=start + float(fitted.landing[2]),
            landing=map_from_paper([fitted.landing[0], fitted.landing[1], 0.0])[:2] + 0.0,
            covariance=covariance,
            state=fitted.states[-1],
            state_covariance=_TO_MAP @ linear.now @ linear.covariance @ linear.now.T @ _TO_MAP,
            wind=wind,
            wind_covariance=spread,
            used=float(np.mean(squared < _FULL)),
            flight=fitted.estimate,
            reference_time=start,
        )

    def path(self, prediction: Prediction, rate: float) -> tuple[FloatArray, FloatArray]:
        """Return the rest of a flight up to the landing.

        Args:
            prediction: From `update`.
            rate: Points a second [Hz].

        Returns:
            Times by the clock of the measurements [s], shape (k,), and states in the paper's axes
            over the ground, shape (k, 14). The last is at the landing.
        """
        begin = prediction.time - prediction.reference_time
        end = prediction.landing_time - prediction.reference_time
        times = np.arange(begin, end, 1.0 / rate)
        times = np.append(times[times < end], end)  # arange may go a rounding error too far
        flight = prediction.flight
        flown = fly_sampled(
            flight.state[None],
            self._model.rows(flight.constants[None]),
            self._model.setup,
            times,
            step=self._model.step,
            duration=0.0,
        )
        return prediction.reference_time + times, flown.states[0]


_TO_MAP = np.diag(np.tile(map_from_paper(np.ones(3)), 2))


def _has_ended(fitted: Fitted, data: Measurements) -> bool:
    now, landing = float(data.time[-1]), float(fitted.landing[2])
    return throw_detection.has_ended(now, landing, fitted.measured, data.position)


_FULL = 20.0  # squared residual at which a weight is one half


def up_axis(states: FloatArray) -> FloatArray:
    """Return the disc's axis, up through its top, in `map`, shape (..., 3)."""
    axes: FloatArray = -map_from_paper(local.disc_axis(states))
    return axes
