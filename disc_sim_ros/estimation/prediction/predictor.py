"""The predictor of landings: a stream of measurements in, predictions of each throw out."""

from dataclasses import dataclass, field, replace
import math

import numpy as np

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation import local
from disc_sim_ros.estimation.prediction import lanes, throw_detection
from disc_sim_ros.estimation.prediction.disc_choice import DiscChoice
from disc_sim_ros.estimation.prediction.prior import ThrowPrior
from disc_sim_ros.estimation.prediction.throw_fit import (
    Estimate,
    Fitted,
    Linear,
    Measurements,
    Model,
)
from disc_sim_ros.physics.flight import SLOWING, Setup
from disc_sim_ros.physics.frames import map_from_paper, paper_from_map
from disc_sim_ros.physics.kernels.jit import note_before
from disc_sim_ros.physics.kernels.rows import AT
from disc_sim_ros.physics.kernels.sampling import sample_simd
from disc_sim_ros.physics.kernels.tracking import track_simd
from disc_sim_ros.physics.sampled import fly_sampled
from disc_sim_ros.quantities import POSITION, PREDICTION

MOST_MEASUREMENTS = 600  # of one throw; of more, the one with the nearest neighbours is left out
STEP = 0.02  # s; without nutation within 26 mm, 0.2 mm in the median (docs/predictor.md)
# Before a throw is taken to have ended: Gauss-Newton steps, and the shortest time after which it
# is fitted from the beginning again [s].
MORE, _ANEW_PERIOD = 4, 0.2
_MOST_WAITING = 3  # updates in a row without the opposite spin
_ORDER = 1e-9  # s between two measurements
_BACK = 1.0  # s by which time is set back, not a late measurement


@dataclass(frozen=True, kw_only=True)
class PredictorConfig:
    """What a predictor is told.

    Attributes:
        setup: Disc, air, profile of the wind and ground contact. Its model and step are replaced.
        prior: Release, wind and uncertainty of the disc.
        others: Setups and priors with other discs that may have been thrown.
        opposite_spin: Probability of a throw that spins the other way round: a forehand spins a
            disc as a left-handed backhand does. 0: it is not tried.
        position_sigma: Standard deviation of each coordinate of a position [m].
        attitude_sigma: Standard deviation of the disc's axis in each direction [rad].
        duration: Longest flight [s]; a later measurement is of another throw.
        ground_height: z of the ground in `map` [m].
    """

    setup: Setup
    prior: ThrowPrior = field(default_factory=ThrowPrior)
    others: tuple[tuple[Setup, ThrowPrior], ...] = ()
    opposite_spin: float = 0.02
    position_sigma: float = 0.02
    attitude_sigma: float = math.radians(2.0)
    duration: float = 15.0
    ground_height: float = 0.0

    @property
    def models(self) -> tuple[Model, ...]:
        """Return the model of the throws of each disc."""
        return tuple(
            Model(replace(setup, model=SLOWING), prior, STEP, self.duration)
            for setup, prior in ((self.setup, self.prior), *self.others)
        )

    @property
    def models_of_opposite_spin(self) -> tuple[Model, ...]:
        """Return the same with the opposite spin; none if it is not tried."""
        if self.opposite_spin <= 0.0:
            return ()
        return tuple(replace(m, prior=m.prior.with_opposite_spin()) for m in self.models)

    @property
    def setups(self) -> tuple[Setup, ...]:
        """Return the setup with each disc."""
        return self.setup, *(setup for setup, _ in self.others)

    @property
    def discs(self) -> tuple[str, ...]:
        """Return the names of the discs."""
        return tuple(setup.disc.name for setup in self.setups)


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
        if not math.isfinite(self.time):
            raise ConfigError('measured time', self.time, 'give a finite number')
        validation.vector('measured position', self.position)
        for name, value in zip('xyz', self.position, strict=True):
            POSITION.check(value, f'measured {name}')
        if self.axis is not None:
            validation.vector('measured axis', self.axis)
        if self.axis is not None and not (math.isfinite(n := math.hypot(*self.axis)) and n > 0.0):
            raise ConfigError('measured axis', self.axis, 'give a finite direction')
        if self.position_sigma is not None:
            PREDICTION['position_sigma'].check(self.position_sigma, 'measured position_sigma')


@dataclass(frozen=True, kw_only=True, slots=True)
class Prediction:
    """Where a throw will land, in `map`; all of it belongs to the newest measurement.

    Attributes:
        throw: Number of the throw, from 1.
        disc: Place of the most likely disc in `PredictorConfig.discs`; what follows is of it.
        weights: Probability of each disc, shape (discs,).
        time: Of the newest measurement [s].
        landing_time: By the clock of the measurements [s].
        landing: x, y of the landing [m], shape (2,).
        covariance: Of x, y [m] and time [s] of the landing about this one, of all discs, shape
            (3, 3); nan if it was not asked, or too few likely throws land.
        state: State at `time`, paper's axes, shape (14,), its Z over the ground.
        state_covariance: Of its position and velocity, in `map`, shape (6, 6).
        wind: Estimated velocity of the air, x and y [m/s].
        wind_covariance: Of x and y, shape (2, 2).
        used: Share of the measurements with a weight of at least one half.
        flight: The throw from its first measurement on; see `Predictor.path`.
        reference_time: Time of its first measurement [s].
    """

    throw: int
    disc: int
    weights: FloatArray
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
        self._models = config.models
        self._opposite = config.models_of_opposite_spin
        self._estimator: DiscChoice | None = None
        self._rows = _NO_ROWS  # time, position, sigma, axis; ascending
        self._new = False
        self._anew = -math.inf  # s since the first measurement, when it was last fitted anew
        self._waiting = 0  # updates with an ellipse since the opposite spin was tried
        self.throws = 0
        self.late = 0

    def warm_up(self) -> None:
        """Load or compile all that an update needs, so that no measurement waits for it."""
        time = np.linspace(0.0, 0.1, 8)
        made_up = Measurements(
            time=time,
            position=np.outer(time, [15.0, 0.0, 0.0]) + np.array([0.0, 0.0, -1.0]),
            sigma=np.full(8, 0.02),
            axis=np.tile([0.0, 0.0, 1.0], (8, 1)),
            axis_sigma=np.full(8, 0.1),
        )
        of_each = self._choice()
        of_each.update(made_up)
        of_each.landing_covariance()
        prediction = self._prediction(of_each, made_up, start=0.0, ellipse=False)
        self.path(prediction, 10.0)

    @property
    def is_following(self) -> bool:
        """Return True during a throw."""
        return self._estimator is not None

    @property
    def newest(self) -> float:
        """Return the time of the newest measurement [s]; -inf before the first."""
        return float(self._rows[-1, 0]) if len(self._rows) else -math.inf

    def reset(self) -> None:
        """Forget the throw and its measurements."""
        self._estimator, self._rows, self._new = None, _NO_ROWS, False
        self._anew = -math.inf

    def add(self, m: Measurement) -> bool:
        """Take a measurement, in any order; return False if it came too late or twice."""
        if m.time < self.newest - _BACK:
            self.reset()  # the clock was set back
        if self._estimator is not None and m.time - self._rows[0, 0] > self._config.duration:
            self.reset()  # it has landed long ago, or the clock was set forward
        times = self._rows[:, 0]
        place = int(np.searchsorted(times, m.time, side='right'))
        twice = place and m.time - times[place - 1] < _ORDER
        if twice or (place == 0 and self._estimator is not None):
            self.late += 1
            return False
        rows = np.concatenate([self._rows[:place], self._row(m)[None], self._rows[place:]])
        self._new = True
        if self._estimator is None:
            rows = rows[throw_detection.first_of_window(rows[:, 0]) :]
        elif len(rows) > MOST_MEASUREMENTS:
            between = rows[2:, 0] - rows[:-2, 0]
            rows = np.delete(rows, 1 + int(np.argmin(between)), axis=0)
        self._rows = rows
        return True

    def _row(self, m: Measurement) -> FloatArray:
        x, y, z = m.position
        at = paper_from_map([x, y, z - self._config.ground_height])
        sigma = m.position_sigma or self._config.position_sigma
        axis = np.full(3, np.nan)
        if m.axis is not None:
            axis = -paper_from_map(np.array(m.axis) / math.hypot(*m.axis))
        return np.array([m.time, *at, sigma, *axis])

    def update(self, *, ellipse: bool = True) -> Prediction | None:
        """Return the prediction from all measurements so far.

        Args:
            ellipse: With the covariance of the landing, which takes longer than all else.

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
            self._estimator = self._choice()
            self.throws += 1
            self._rows = self._rows[first:]
            data = self._measurements()
        # The opposite spin in turn with the ellipse: either takes about as long as all else.
        self._waiting = 0 if not ellipse or self._waiting >= _MOST_WAITING else self._waiting + 1
        fitted = self._estimator.update(data, unlikely=self._waiting == 0)
        if early := throw_detection.of_the_hand(data.time, fitted.squares[:, 0]):
            self._estimator, self._rows = self._choice(), self._rows[early:]
            data = self._measurements()
            fitted = self._estimator.update(data)
        if _has_ended(fitted, data) or _is_lost(fitted):
            self._estimator, fitted = self._fitted_again(self._estimator, data)
            if _has_ended(fitted, data):
                self.reset()
                return None
        if not np.isfinite(fitted.landing).all():
            return None
        start = float(self._rows[0, 0])
        return self._prediction(self._estimator, data, start, ellipse=ellipse)

    def _fitted_again(
        self, estimator: DiscChoice, data: Measurements
    ) -> tuple[DiscChoice, Fitted]:
        """Return an estimator after more steps, or one that has begun anew, and its fit.

        A fit in a wrong minimum looks like the end of a throw.
        """
        fitted = estimator.update(data, MORE)
        doubtful = _has_ended(fitted, data) or _is_lost(fitted)
        if not doubtful or data.time[-1] < self._anew + _ANEW_PERIOD:
            return estimator, fitted
        self._anew = float(data.time[-1])
        anew = self._choice()
        other = anew.update(data, MORE)
        if _has_ended(other, data) or _is_lost(other):
            return estimator, fitted
        return anew, other

    def _choice(self) -> DiscChoice:
        return DiscChoice(self._models, self._opposite, self._config.opposite_spin)

    def _measurements(self) -> Measurements:
        rows = self._rows
        return Measurements(
            time=rows[:, 0] - rows[0, 0],
            position=rows[:, 1:4],
            sigma=rows[:, 4],
            axis=rows[:, 5:8],
            axis_sigma=np.full(len(rows), self._config.attitude_sigma),
        )

    def _prediction(
        self, estimator: DiscChoice, data: Measurements, start: float, *, ellipse: bool
    ) -> Prediction:
        discs = len(self._models)
        disc = estimator.best % discs
        fitted, linear, model = estimator.fitted, estimator.linear, self._models[disc]
        wind, spread = _wind(model, fitted.estimate, linear)
        covariance = np.full((3, 3), np.nan)
        if ellipse:
            covariance = _TURN @ estimator.landing_covariance() @ _TURN
        return Prediction(
            throw=self.throws,
            disc=disc,
            weights=estimator.weights.reshape(-1, discs).sum(axis=0),
            time=start + float(data.time[-1]),
            landing_time=start + float(fitted.landing[2]),
            landing=map_from_paper([fitted.landing[0], fitted.landing[1], 0.0])[:2] + 0.0,
            covariance=covariance,
            state=fitted.last,
            state_covariance=_TO_MAP @ linear.now @ linear.covariance @ linear.now.T @ _TO_MAP,
            wind=wind,
            wind_covariance=spread,
            used=float(np.mean(fitted.squares[:, 0] < _FULL)),
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
        flight, model = prediction.flight, self._models[prediction.disc]
        flown = fly_sampled(
            flight.state[None],
            model.rows(flight.constants[None]),
            model.setup,
            times,
            step=model.step,
            duration=0.0,
        )
        return prediction.reference_time + times, flown.states[0]


_TO_MAP = np.diag(np.tile(map_from_paper(np.ones(3)), 2))
_TURN = np.diag([*map_from_paper(np.ones(3))[:2], 1.0])  # X, Y, time to x, y, time
_NO_ROWS = np.empty((0, 8))


def _wind(model: Model, estimate: Estimate, linear: Linear) -> tuple[FloatArray, FloatArray]:
    """Return the velocity of the air in `map`, x and y [m/s], and its covariance."""
    wind, spread = np.zeros(2), np.zeros((2, 2))
    names, first = list(model.prior.constants), len(model.coordinates)
    unknown = {}
    for i, name in enumerate(('wind_x', 'wind_y')):
        wind[i] = model.row[AT[name]]
        if name in names:
            unknown[i] = first + names.index(name)
            wind[i] = estimate.constants[names.index(name)]
    for i, a in unknown.items():
        for j, b in unknown.items():
            spread[i, j] = linear.covariance[a, b]
    return wind, spread


def _has_ended(fitted: Fitted, data: Measurements) -> bool:
    measured = throw_detection.newest_speed(data.time, data.position)
    speeds = measured, float(np.linalg.norm(fitted.last[3:6]))
    now, landing = float(data.time[-1]), float(fitted.landing[2])
    return throw_detection.has_ended(now, landing, fitted.squares[:, 0], speeds)


def _is_lost(fitted: Fitted) -> bool:
    return throw_detection.is_lost(fitted.squares[:, 0])


_FULL = 20.0  # squared residual at which a weight is one half


def first_call_note() -> str:
    """Return one line for users on why the first update takes long; '' if it does not."""
    return note_before(track_simd, sample_simd, lanes.normal_equations, seconds=15)


def up_axis(states: FloatArray) -> FloatArray:
    """Return the disc's axis, up through its top, in `map`, shape (..., 3)."""
    axes: FloatArray = -map_from_paper(local.disc_axis(states))
    return axes
