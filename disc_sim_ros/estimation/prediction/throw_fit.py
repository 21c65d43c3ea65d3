"""A throw fitted to its measurements: residuals, their derivatives, and one Gauss-Newton step.

The unknowns are the state at the first measurement (`lift_coordinates`) and the uncertain
constants of the flight (wind, offsets of coefficients). Derivatives are differences
between flights one standard deviation to both sides of the estimate, along the axes of its
covariance: where a table of coefficients has a corner, they are the mean slopes of what is likely.
"""

from dataclasses import dataclass, replace
from functools import cached_property
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation import lift_coordinates
from disc_sim_ros.estimation.prediction import lanes
from disc_sim_ros.estimation.prediction.prior import Gaussian, ThrowPrior
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.kernels.rows import AT
from disc_sim_ros.physics.kernels.tracking import SEEN
from disc_sim_ros.physics.sampled import default_row
from disc_sim_ros.physics.tracked import Tracker, Tracks

_LANDING = 3  # X, Y and time of a landing
POSITION = 3  # the first unknowns: position, in which flights are linear
FRACTIONS = np.array([1.0, 0.7, 0.5, 0.3, 0.2, 0.1, 0.03, 0.0])  # of a step, tried at once; last 0
GATE = 14.0  # squared residual of a position from which it counts less; 1 in 350 is beyond
_USUAL = 2.37  # median of chi-squared with 3 degrees of freedom


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
        return bool((self.per_sigma[:, 3] > 0.0).any())

    @cached_property
    def sights(self) -> FloatArray:
        """Return positions and axes, 0 where they were not measured, shape (k, 6)."""
        sights = np.concatenate([self.position, self.axis], axis=1)
        sights[~np.isfinite(sights)] = 0.0
        return sights

    @cached_property
    def per_sigma(self) -> FloatArray:
        """Return one over the standard deviations, 0 where nothing was measured, shape (k, 6)."""
        inverse = np.empty((len(self.time), SEEN))
        inverse[:, :3] = (1.0 / self.sigma)[:, None]
        inverse[:, 3:] = np.isfinite(self.axis) / self.axis_sigma[:, None]
        return inverse


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
    def tracker(self) -> Tracker:
        """Return what flies the throws."""
        return Tracker(self.setup, self.step)

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
    def offsets(self) -> list[int]:
        """Return which of the uncertain constants are of the disc."""
        return [k for k, name in enumerate(self.prior.constants) if name in self.prior.offsets]

    @cached_property
    def means(self) -> FloatArray:
        """Return the means of the uncertain constants, shape (c,)."""
        return np.array([g.mean for g in self.prior.constants.values()])

    @cached_property
    def sigmas(self) -> FloatArray:
        """Return the standard deviations of the uncertain constants, shape (c,)."""
        return np.array([g.sigma for g in self.prior.constants.values()])

    @cached_property
    def unknowns(self) -> int:
        """Return the number of unknowns."""
        return len(self.coordinates) + len(self.columns)

    @cached_property
    def coordinates(self) -> list[int]:
        """Return the places of the unknowns in `lift_coordinates.NAMES`.

        Without nutation p and q follow from the other numbers.
        """
        without = {'p', 'q'} if self.setup.has_no_nutation else set()
        return [i for i, name in enumerate(lift_coordinates.NAMES) if name not in without]

    @cached_property
    def spin(self) -> int:
        """Return the place of the spin among the unknowns."""
        return self.coordinates.index(lift_coordinates.NAMES.index('r'))

    def knowing(self, spin: Gaussian) -> 'Model':
        """Return the model of a throw with this spin; it flies with what this one has computed."""
        other = replace(self, prior=replace(self.prior, spin=spin))
        computed = {name: value for name, value in vars(self).items() if name not in vars(other)}
        vars(other).update(computed)
        return other

    @cached_property
    def curve(self) -> lanes.Curve:
        """Return the lift curve of the disc in its air."""
        disc, plant = self.setup.disc, self.setup.plant
        curve = lift_coordinates.lift_curve(disc, self.setup.aero or disc.aero)
        return lanes.Curve(
            np.ascontiguousarray(curve.alpha),
            np.ascontiguousarray(curve.C_Lift),
            0.5 * plant.rho * plant.S / plant.m,
        )

    def moved(self, estimate: 'Estimate', deltas: FloatArray) -> 'Throws':
        """Return n throws, moved by deltas of shape (n, unknowns)."""
        k = len(self.coordinates)
        moves = np.zeros((len(deltas), lift_coordinates.SIZE))
        moves[:, self.coordinates] = deltas[:, :k]
        constants = estimate.constants + deltas[:, k:]
        row, rows = self.rows(estimate.constants[None])[0], self.rows(constants)
        states = np.empty((len(deltas), len(estimate.state)))
        lanes.move(estimate.state, row, moves, rows, self.curve, states)
        of_constants = (constants - self.means) / self.sigmas
        prior = np.concatenate([self.prior.state_residuals(states), of_constants], axis=1)
        return Throws(states, constants, rows, prior)

    def rows(self, constants: FloatArray) -> FloatArray:
        """Return the constants of n flights, shape (n, len(NAMES))."""
        rows = np.empty((len(constants), len(self.row)))
        rows[:] = self.row
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
class Throws:
    """Throws side by side.

    Attributes:
        states: At the reference, shape (n, 14).
        constants: The uncertain ones, shape (n, c).
        rows: All constants of the flights, shape (n, len(NAMES)).
        prior: By how many standard deviations they differ from the prior, shape (n, 7 + c).
    """

    states: FloatArray
    constants: FloatArray
    rows: FloatArray
    prior: FloatArray

    def __getitem__(self, i: int) -> Estimate:
        """Return one of them."""
        return Estimate(self.states[i], self.constants[i])


@dataclass(frozen=True, slots=True)
class Fitted:
    """One throw, compared with the measurements.

    Attributes:
        estimate: The throw.
        squares: Squared residuals of positions and of axes, unscaled, shape (k, 2).
        landing: X, Y and time; nan without a landing, shape (3,).
        last: State at the newest measurement, shape (14,).
        cost: Half its sum of squares.
        gain: By how much the step to it lowered the cost.
    """

    estimate: Estimate
    squares: FloatArray
    landing: FloatArray
    last: FloatArray
    cost: float
    gain: float


@dataclass(frozen=True, slots=True)
class Linear:
    """The fit close to an estimate: minimum, covariance and landing are linear there.

    Attributes:
        covariance: Of the unknowns, shape (m, m).
        landing: Derivatives of X, Y and time of the landing, shape (3, m); nan if they were not
            asked for.
        now: Derivatives of position and velocity at the newest measurement, shape (6, m).
    """

    covariance: FloatArray
    landing: FloatArray
    now: FloatArray

    def along(self, k: int) -> FloatArray:
        """Return how all unknowns change with the one at place k, if it changes by 1."""
        moves: FloatArray = self.covariance[:, k] / self.covariance[k, k]
        return moves


def costs(tracks: Tracks, throws: Throws, data: Measurements, scale: FloatArray) -> FloatArray:
    """Return half the sum of squared residuals of n throws, shape (n,); outliers count less."""
    total = np.empty(len(throws.states))
    per_sigma = data.per_sigma / scale
    lanes.costs(tracks.sights, data.sights, per_sigma, throws.prior, GATE, total)
    return total


def scale_of(squares: FloatArray) -> FloatArray:
    """Return how much larger residuals are than stated, from their median; at least 1.

    Args:
        squares: Squared residuals of positions and axes of one throw, 0 where none was measured,
            shape (k, 2).

    Returns:
        A factor for each column of `Measurements.sights`, shape (6,).
    """
    factors = np.ones(SEEN)
    for part in range(2):
        known = squares[:, part]
        known = known[known > 0.0]
        if len(known):
            middle = float(np.partition(known, len(known) // 2)[len(known) // 2])
            factors[3 * part : 3 * part + 3] = math.sqrt(max(1.0, middle / _USUAL))
    return factors


def squares_of(residuals: FloatArray) -> FloatArray:
    """Return squared residuals of positions and axes, shape (k, 2), from shape (k, 6)."""
    squared: FloatArray = (residuals**2).reshape(-1, 2, 3).sum(axis=2)
    return squared


def linearised(
    model: Model,
    estimate: Estimate,
    spread: FloatArray,
    data: Measurements,
    *,
    to_landing: bool = False,
) -> tuple[Linear, FloatArray, FloatArray]:
    """Fly around an estimate.

    Args:
        model: The model.
        estimate: The estimate.
        spread: Columns of standard deviations of all unknowns but the position, shape (m - 3,
            m - 3).
        data: The measurements.
        to_landing: Also compute the derivatives of the landing.

    Returns:
        The linear fit, the Gauss-Newton step, shape (m,), and the scale of the residuals.
    """
    m = model.unknowns
    free = m - POSITION
    deltas = np.zeros((1 + 2 * free, m))
    deltas[1 : 1 + free, POSITION:] = spread.T
    deltas[1 + free :, POSITION:] = -spread.T
    throws = model.moved(estimate, deltas)
    duration = model.duration if to_landing else 0.0
    tracks = model.tracker.fly(throws.states, throws.rows, data.time, duration)
    off = tracks.sights[0, :, :, 0] - data.sights
    scaled = data.per_sigma * off
    scale = scale_of(squares_of(scaled))
    squares = squares_of(scaled / scale)
    weights = np.repeat(GATE / np.maximum(squares, GATE), 3, axis=1)
    roots = data.per_sigma / scale * weights

    # Unknowns here: position [m], then multiples of the columns of `spread`.
    equations = lanes.equations(m)
    lanes.normal_equations(tracks.sights, off, roots, throws.prior, free, np.empty(m), equations)
    landing = np.full((_LANDING, m), np.nan)
    if to_landing:
        landing[:, POSITION:] = _half_difference(tracks.landing, free)
        landing[:, :POSITION] = _landing_by_position(tracks.ends[0])
    now = np.eye(6, m)
    now[POSITION:, POSITION:] = 0.0
    now[:, POSITION:] = _half_difference(tracks.last[:, :6], free)

    inverted = inverse(equations.normal)
    turn = np.eye(m)
    turn[POSITION:, POSITION:] = spread
    back = np.linalg.inv(turn)
    linear = Linear(turn @ inverted @ turn.T, landing @ back, now @ back)
    return linear, -turn @ (inverted @ equations.gradient), scale


def _half_difference(values: FloatArray, free: int) -> FloatArray:
    """Return the derivatives, last axis, from lanes: base, plus, minus; 0 where one is lost."""
    difference: FloatArray = 0.5 * (values[1 : 1 + free] - values[1 + free :])
    difference[~np.isfinite(difference)] = 0.0
    return difference.T


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
    model: Model,
    estimate: Estimate,
    step: FloatArray,
    data: Measurements,
    scale: FloatArray,
    duration: float,
) -> Fitted:
    """Return the best of several fractions of a step, with its landing within a duration [s]."""
    throws = model.moved(estimate, FRACTIONS[:, None] * step)
    tracks = model.tracker.fly(throws.states, throws.rows, data.time, duration)
    cost = costs(tracks, throws, data, scale)
    i = int(np.argmin(cost))
    return Fitted(
        throws[i],
        squares_of((tracks.sights[0, :, :, i] - data.sights) * data.per_sigma),
        tracks.landing[i],
        tracks.last[i],
        float(cost[i]),
        float(cost[-1] - cost[i]) if math.isfinite(cost[i]) else 0.0,
    )
