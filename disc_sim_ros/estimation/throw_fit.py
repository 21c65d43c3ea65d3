"""A throw fitted to its measurements: residuals, their derivatives, and one Gauss-Newton step.

The unknowns are the state at the first measurement (`lift_coordinates`) and the uncertain
constants of the flight (wind, offsets of coefficients). Derivatives are differences
between flights one standard deviation to both sides of the estimate, along the axes of its
covariance: where a table of coefficients has a corner, they are the mean slopes of what is likely.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation import lift_coordinates, local
from disc_sim_ros.estimation.prior import ThrowPrior
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.kernels.integrator import LANDED
from disc_sim_ros.physics.kernels.rows import AT
from disc_sim_ros.physics.sampled import Sampled, default_row, fly_sampled

POSITION = 3  # the first unknowns: position, in which flights are linear
FRACTIONS = np.array([1.0, 0.7, 0.5, 0.3, 0.2, 0.1, 0.03, 0.0])  # of a step, tried at once
_LANDING = 3  # X, Y and time of a landing
_GATE = 14.0  # squared residual of a position from which it counts less; 1 in 350 is beyond
_USUAL = 2.37  # median of chi-squared with 3 degrees of freedom
_NO_COST = np.inf


@dataclass(frozen=True)
class Measurements:
    """Measurements of one throw, in the order of their times; paper's axes.

    Attributes:
        time: Since the reference [s], shape (k,).
        position: Of the centre [m], shape (k, 3).
        sigma: Standard deviation of each coordinate [m], shape (k,).
        axis: Disc's axis, through its underside; nan where it was not measured, shape (k, 3).
        axis_sigma: Its standard deviation in each direction [rad], shape (k,).
    """

    time: FloatArray
    position: FloatArray
    sigma: FloatArray
    axis: FloatArray
    axis_sigma: FloatArray

    @cached_property
    def has_axis(self) -> bool:
        """Return True if any measurement has an attitude."""
        return bool(np.isfinite(self.axis).any())


@dataclass(frozen=True)
class Model:
    """How a throw flies and what is known of it beforehand.

    Attributes:
        setup: Disc, air, mean wind profile and ground contact.
        prior: Of the release and of the constants.
        step: Integration step [s].
        duration: Longest flight [s].
    """

    setup: Setup
    prior: ThrowPrior
    step: float
    duration: float

    @cached_property
    def row(self) -> FloatArray:
        """Return the constants of a flight at the means of the prior."""
        row = default_row(self.setup)
        for name, g in self.prior.every_constant.items():
            row[AT[name]] = g.mean
        return row

    @cached_property
    def columns(self) -> list[int]:
        """Return the places of the uncertain constants in a row."""
        return [AT[name] for name in self.prior.constants]

    @cached_property
    def means(self) -> FloatArray:
        """Return the means of the uncertain constants, shape (c,)."""
        return np.array([g.mean for g in self.prior.constants.values()])

    @cached_property
    def sigmas(self) -> FloatArray:
        """Return the standard deviations of the uncertain constants, shape (c,)."""
        return np.array([g.sigma for g in self.prior.constants.values()])

    @property
    def unknowns(self) -> int:
        """Return the number of unknowns."""
        return len(self.coordinates) + len(self.columns)

    @cached_property
    def coordinates(self) -> list[int]:
        """Return the places of the unknowns in `lift_coordinates.NAMES`.

        The precession model has no nutation: p and q follow from the other numbers.
        """
        without = {'p', 'q'} if self.setup.model == 'precession' else set()
        return [i for i, name in enumerate(lift_coordinates.NAMES) if name not in without]

    def moved(self, estimate: 'Estimate', deltas: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return n states and constants, moved by deltas of shape (n, unknowns)."""
        k = len(self.coordinates)
        moves = np.zeros((len(deltas), lift_coordinates.SIZE))
        moves[:, self.coordinates] = deltas[:, :k]
        constants = estimate.constants + deltas[:, k:]
        row, rows = self.rows(estimate.constants[None])[0], self.rows(constants)
        states = lift_coordinates.moved(self.setup, self.curve, estimate.state, row, moves, rows)
        return states, constants

    @cached_property
    def curve(self) -> lift_coordinates.LiftCurve:
        """Return the lift curve of the disc."""
        disc = self.setup.disc
        return lift_coordinates.lift_curve(disc, self.setup.aero or disc.aero)

    def rows(self, constants: FloatArray) -> FloatArray:
        """Return the constants of n flights, shape (n, len(NAMES))."""
        rows = np.tile(self.row, (len(constants), 1))
        rows[:, self.columns] = constants
        return rows


@dataclass(frozen=True, slots=True)
class Estimate:
    """A throw: the state at the reference, and the uncertain constants.

    Attributes:
        state: Paper's axes, shape (14,).
        constants: In the order of `ThrowPrior.constants`, shape (c,).
    """

    state: FloatArray
    constants: FloatArray


@dataclass(frozen=True, slots=True)
class Residuals:
    """Residuals and landings of n throws.

    Attributes:
        measured: Position and axis less those measured, over their standard deviations; 0 where
            nothing was measured; shape (n, k, 6).
        prior: Shape (n, 7 + c).
        landing: X, Y [m] and time since the reference [s]; nan without landing, shape (n, 3).
        flights: The flights.
    """

    measured: FloatArray
    prior: FloatArray
    landing: FloatArray
    flights: Sampled


@dataclass(frozen=True, slots=True)
class Fitted:
    """One throw, compared with the measurements.

    Attributes:
        estimate: The throw.
        measured: Its residuals, shape (k, 6).
        landing: X, Y and time; nan without a landing, shape (3,).
        states: States at the measurements, shape (k, 14).
        end: State at the landing, shape (14,).
        cost: Half its sum of squares.
    """

    estimate: Estimate
    measured: FloatArray
    landing: FloatArray
    states: FloatArray
    end: FloatArray
    cost: float


@dataclass(frozen=True, slots=True)
class Linear:
    """The fit close to an estimate: minimum, covariance and landing are linear there.

    Attributes:
        covariance: Of the unknowns, shape (m, m).
        landing: Derivatives of X, Y and time of the landing, shape (3, m).
        now: Derivatives of position and velocity at the newest measurement, shape (6, m).
    """

    covariance: FloatArray
    landing: FloatArray
    now: FloatArray


def residuals(
    model: Model, states: FloatArray, constants: FloatArray, data: Measurements
) -> Residuals:
    """Fly n throws and compare them with the measurements and the prior."""
    n = len(states)
    flights = fly_sampled(
        states,
        model.rows(constants),
        model.setup,
        data.time,
        step=model.step,
        duration=model.duration,
    )
    measured = np.zeros((n, len(data.time), 6))
    measured[:, :, :3] = (flights.states[:, :, :3] - data.position) / data.sigma[:, None]
    if data.has_axis:
        axes = (local.disc_axis(flights.states) - data.axis) / data.axis_sigma[:, None]
        measured[:, :, 3:] = np.where(np.isfinite(data.axis), axes, 0.0)
    landing = np.column_stack([flights.ends[:, :2], flights.time])
    landing[flights.status != LANDED] = np.nan
    of_constants = (constants - model.means) / model.sigmas
    prior = np.hstack([model.prior.state_residuals(states), of_constants])
    return Residuals(measured, prior, landing, flights)


def costs(r: Residuals, scale: FloatArray) -> FloatArray:
    """Return half the sum of squared residuals of n throws, shape (n,); outliers count less."""
    position, axis = _squares(r.measured / scale)
    beyond = np.maximum(position, _GATE)
    robust = np.where(position > _GATE, 2.0 * _GATE - _GATE**2 / beyond, position)
    beyond = np.maximum(axis, _GATE)
    robust = robust + np.where(axis > _GATE, 2.0 * _GATE - _GATE**2 / beyond, axis)
    total: FloatArray = 0.5 * (np.sum(robust, axis=1) + np.sum(r.prior**2, axis=1))
    return np.where(np.isfinite(total), total, _NO_COST)


def scale_of(measured: FloatArray) -> FloatArray:
    """Return how much larger residuals are than stated, from their median; at least 1.

    Args:
        measured: Residuals of one throw, shape (k, 6).

    Returns:
        A factor for each column, shape (6,).
    """
    position, axis = _squares(measured)
    factors = [np.sqrt(max(1.0, float(np.median(position)) / _USUAL)), 1.0]
    if np.any(axis > 0.0):
        factors[1] = np.sqrt(max(1.0, float(np.median(axis[axis > 0.0])) / _USUAL))
    return np.repeat(factors, 3)


def _squares(measured: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.sum(measured[..., :3] ** 2, axis=-1), np.sum(measured[..., 3:] ** 2, axis=-1)


def root_weights(measured: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the square roots of the weights of scaled residuals, shape (k, 6).

    A weight is 1 up to the gate, and falls with the fourth power of the residual beyond.
    """
    position, axis = _squares(measured / scale)
    roots = [np.minimum(1.0, _GATE / np.maximum(x, _GATE)) for x in (position, axis)]
    return np.repeat(np.stack(roots, axis=1), 3, axis=1) / scale


def linearised(
    model: Model, estimate: Estimate, spread: FloatArray, data: Measurements
) -> tuple[Linear, FloatArray, FloatArray]:
    """Fly around an estimate.

    Args:
        model: The model.
        estimate: The estimate.
        spread: Columns of standard deviations of all unknowns but the position, shape (m - 3,
            m - 3).
        data: The measurements.

    Returns:
        The linear fit, the Gauss-Newton step, shape (m,), and the scale of the residuals.
    """
    m = model.unknowns
    free = m - POSITION
    deltas = np.zeros((1 + 2 * free, m))
    deltas[1 : 1 + free, POSITION:] = spread.T
    deltas[1 + free :, POSITION:] = -spread.T
    r = residuals(model, *model.moved(estimate, deltas), data)
    scale = scale_of(r.measured[0])
    roots = root_weights(r.measured[0], scale)

    # Unknowns here: position [m], then multiples of the columns of `spread`.
    measured = np.zeros((len(data.time), 6, m))
    for axis in range(POSITION):
        measured[:, axis, axis] = 1.0 / data.sigma
    measured[:, :, POSITION:] = _half_difference(r.measured, free)
    slopes = (measured * roots[:, :, None]).reshape(-1, m)
    prior = np.zeros((r.prior.shape[1], m))
    prior[:, POSITION:] = _half_difference(r.prior, free)
    landing = np.zeros((_LANDING, m))
    landing[:, POSITION:] = _half_difference(r.landing, free)
    landing[:, :POSITION] = _landing_by_position(r.flights.ends[0])

    now = np.eye(6, m)
    now[POSITION:, POSITION:] = 0.0
    now[:, POSITION:] = _half_difference(r.flights.states[:, -1, :6], free)

    normal = slopes.T @ slopes + prior.T @ prior
    gradient = slopes.T @ (r.measured[0] * roots).ravel() + prior.T @ r.prior[0]
    inverted = inverse(normal)
    turn = np.eye(m)
    turn[POSITION:, POSITION:] = spread
    back = np.linalg.inv(turn)
    linear = Linear(turn @ inverted @ turn.T, landing @ back, now @ back)
    return linear, -turn @ (inverted @ gradient), scale


def _half_difference(values: FloatArray, free: int) -> FloatArray:
    """Return the derivatives, last axis, from lanes: base, plus, minus; 0 where one is lost."""
    difference = 0.5 * (values[1 : 1 + free] - values[1 + free :])
    return np.moveaxis(np.nan_to_num(difference, nan=0.0, posinf=0.0, neginf=0.0), 0, -1)


def _landing_by_position(end: FloatArray) -> FloatArray:
    """Return the derivatives of X, Y and time of a landing by the first position, shape (3, 3)."""
    s = State(*end)
    sink = max(s.VZ, 0.1)
    return np.array([[1.0, 0.0, -s.VX / sink], [0.0, 1.0, -s.VY / sink], [0.0, 0.0, -1.0 / sink]])


def inverse(normal: FloatArray) -> FloatArray:
    """Return the inverse of a positive matrix, scaled first."""
    d = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-12))
    scaled = normal * d[:, None] * d
    inverted = np.asarray(np.linalg.inv(scaled + 1e-10 * np.eye(len(d))), dtype=float)
    return np.asarray(0.5 * (inverted + inverted.T) * d[:, None] * d, dtype=float)


def square_root(covariance: FloatArray) -> FloatArray:
    """Return the lower triangular root of a covariance; rounding may have made it singular."""
    widened = covariance + 1e-12 * np.diag(np.diag(covariance))
    return np.asarray(np.linalg.cholesky(widened), dtype=float)


def best_on_line(
    model: Model, estimate: Estimate, step: FloatArray, data: Measurements, scale: FloatArray
) -> Fitted:
    """Return the best of several fractions of a step."""
    states, constants = model.moved(estimate, FRACTIONS[:, None] * step)
    r = residuals(model, states, constants, data)
    cost = costs(r, scale)
    i = int(np.argmin(cost))
    return Fitted(
        Estimate(states[i], constants[i]),
        r.measured[i],
        r.landing[i],
        r.flights.states[i],
        r.flights.ends[i],
        float(cost[i]),
    )
