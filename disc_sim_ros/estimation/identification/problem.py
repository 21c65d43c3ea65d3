"""The least-squares problem of an identification: parameters, residuals, derivatives, priors.

Parameters, in this order: the free coefficients; the wind of the session, x and y in `map`; the
point on the ground under the camera, where there is one; and for each throw the changes of its
first state in local coordinates and of its spin angle.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation import local
from disc_sim_ros.estimation.identification import coefficients
from disc_sim_ros.estimation.identification.coefficients import Base
from disc_sim_ros.estimation.identification.observations import CAMERA, GYRO
from disc_sim_ros.estimation.identification.throws import RELEASE_SIZE, Throw
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.rows import AT
from disc_sim_ros.physics.sampled import default_row, fly_sampled, good_step
from disc_sim_ros.quantities import COEFFICIENTS

# Steps of the differences: small beside the curvature of a flight, large beside rounding.
_RELEASE_STEPS = np.array([1e-3] * 6 + [1e-4] * 2 + [1e-2] * 3 + [1e-4])
_SHARED_STEP = 1e-3
# Margins of the integration step. With FINE a gyro at 0.02 rad/s would read 0.15 of its noise
# wrong towards the end of a throw, always to the same side; with FINEST less than 0.01.
ROUGH, FINE, FINEST = 4.0, 8.0, 20.0
_LOST = 1e4  # residual of a flight that the steps cannot follow, in standard deviations


@dataclass(frozen=True)
class Prior:
    """What is believed of the shared parameters before the throws: means and deviations.

    Attributes:
        coefficients: Standard deviations in the order of `coefficients.NAMES`, shape (9,); the
            means are those of the base disc and `moved`.
        wind: Mean wind x, y in `map` [m/s].
        wind_deviation: Its standard deviation [m/s].
        foot: Point under the camera, x and y in `map` [m].
        foot_deviation: Its standard deviation [m].
        moved: What is added to the coefficients of the base disc, shape (9,); None for nothing.
    """

    coefficients: FloatArray
    wind: tuple[float, float] = (0.0, 0.0)
    wind_deviation: float = 3.0
    foot: tuple[float, float] = (0.0, 0.0)
    foot_deviation: float = 5.0
    moved: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Problem:
    """A least-squares problem.

    Attributes:
        setup: The base disc and its surroundings.
        base: The base disc.
        free: Places of the free coefficients in `coefficients.NAMES`.
        throws: The measured throws.
        prior: Of the shared parameters.
        noise: Standard deviation of each instrument, by its kind.
        held: Values of the coefficients that are not free, in the order of `coefficients.NAMES`.
        margin: Of the integration step, see `sampled.good_step`.
    """

    setup: Setup
    base: Base
    free: tuple[int, ...]
    throws: tuple[Throw, ...]
    prior: Prior
    noise: Mapping[str, float]
    held: FloatArray
    margin: float = FINE

    @cached_property
    def step(self) -> float:
        """Return an integration step for the fastest of the throws [s]."""
        spin = max(abs(float(throw.start[12])) for throw in self.throws)
        speed = max(float(np.linalg.norm(throw.start[3:6])) for throw in self.throws) + 5.0
        return good_step(self.setup, 1.2 * spin, speed, margin=self.margin)

    @property
    def has_camera(self) -> bool:
        """Return True if a camera tracked a throw."""
        return any(o.kind == CAMERA for throw in self.throws for o in throw.observations)

    @property
    def roughest(self) -> float:
        """Return the margin with which minima may be compared.

        Rough steps misread a gyro by several times its noise where the spin is fast.
        """
        return FINE if any(throw.has(GYRO) for throw in self.throws) else ROUGH

    @property
    def turns_only(self) -> bool:
        """Return True if of no throw more than the turning was measured."""
        return all(throw.turns_only for throw in self.throws)

    @property
    def shared(self) -> int:
        """Return the number of parameters that the throws share."""
        return len(self.free) + (4 if self.has_camera else 2)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the shared parameters."""
        camera = ('camera_x', 'camera_y') if self.has_camera else ()
        free = (coefficients.NAMES[i] for i in self.free)
        return (*free, 'wind_x', 'wind_y', *camera)

    @property
    def size(self) -> int:
        """Return the number of parameters."""
        return self.shared + RELEASE_SIZE * len(self.throws)

    @cached_property
    def means(self) -> FloatArray:
        """Return the parameters before the throws, shape (p,)."""
        camera = self.prior.foot if self.has_camera else ()
        moved = 0.0 if self.prior.moved is None else self.prior.moved
        values = (self.base.values + moved)[list(self.free)]
        shared = [*values, *self.prior.wind, *camera]
        return np.concatenate([shared, np.zeros(self.size - len(shared))])

    @cached_property
    def shared_deviations(self) -> FloatArray:
        """Return the standard deviations of the shared parameters before the throws."""
        prior = self.prior
        camera = [prior.foot_deviation] * 2 if self.has_camera else []
        free = prior.coefficients[list(self.free)]
        return np.array([*free, *[prior.wind_deviation] * 2, *camera])

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the lowest and highest allowed shared parameters, each of shape (shared,)."""
        camera = 2 if self.has_camera else 0
        quantities = [COEFFICIENTS[coefficients.NAMES[i]] for i in self.free]
        return (
            np.array([*(q.lowest for q in quantities), *[-np.inf] * (2 + camera)]),
            np.array([*(q.highest for q in quantities), *[np.inf] * (2 + camera)]),
        )

    def own(self, k: int) -> slice:
        """Return the places of the release of throw `k`."""
        start = self.shared + RELEASE_SIZE * k
        return slice(start, start + RELEASE_SIZE)

    # ---- flights ----

    @cached_property
    def _row(self) -> FloatArray:
        """Return the constants of a flight with the base disc."""
        return default_row(self.setup)

    def states_and_rows(
        self, k: int, parameters: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return first states, constants and camera foot points of flights of throw `k`.

        Args:
            k: Number of the throw.
            parameters: The shared ones and the release, shape (m, shared + 12).
        """
        m, shared = len(parameters), self.shared
        release = parameters[:, shared:]
        states = local.moved(self.throws[k].start, release[:, : local.SIZE])
        states[:, 13] += release[:, local.SIZE]
        rows = np.tile(self._row, (m, 1))
        values = np.tile(self.held, (m, 1))
        n = len(self.free)
        values[:, list(self.free)] = parameters[:, :n]
        coefficients.write_rows(self.base, values, rows)
        rows[:, AT['wind_x']], rows[:, AT['wind_y']] = parameters[:, n], parameters[:, n + 1]
        foot = parameters[:, n + 2 : n + 4] * (1.0, -1.0) if self.has_camera else np.zeros((m, 2))
        return states, rows, foot

    def predictions(self, k: int, parameters: FloatArray) -> list[FloatArray]:
        """Return the residuals of each instrument of throw `k` in its unit, each (m, n, d)."""
        return self._predictions_from(k, *self.states_and_rows(k, parameters))

    def _predictions_from(
        self, k: int, states: FloatArray, rows: FloatArray, foot: FloatArray
    ) -> list[FloatArray]:
        """Return the same of flights that begin at first states; see `states_and_rows`."""
        throw = self.throws[k]
        sampled = fly_sampled(
            states, rows, self.setup, throw.times, step=self.step, duration=0.0
        ).states
        return [
            o.residuals(sampled[:, places], foot)
            for o, places in zip(throw.observations, throw.places, strict=True)
        ]

    def whitened(self, k: int, parameters: FloatArray) -> FloatArray:
        """Return the residuals of throw `k` in standard deviations, shape (m, n)."""
        return self.whitened_from(k, *self.states_and_rows(k, parameters))

    def whitened_from(
        self, k: int, states: FloatArray, rows: FloatArray, foot: FloatArray
    ) -> FloatArray:
        """Return the same of flights that begin at first states; see `states_and_rows`."""
        parts = [
            r.reshape(len(states), -1) / self.noise[o.kind]
            for o, r in zip(
                self.throws[k].observations,
                self._predictions_from(k, states, rows, foot),
                strict=True,
            )
        ]
        return np.nan_to_num(np.concatenate(parts, axis=1), nan=_LOST, posinf=_LOST, neginf=-_LOST)

    # ---- residuals ----

    def residuals(self, k: int, here: FloatArray) -> FloatArray:
        """Return the whitened residuals of throw `k`, shape (m,).

        Args:
            k: Number of the throw.
            here: The shared parameters and the release, shape (shared + 12,).
        """
        residuals: FloatArray = self.whitened(k, here[np.newaxis])[0]
        return residuals

    def linearised(
        self, k: int, here: FloatArray, *, release_only: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """Return the whitened residuals of throw `k` and their derivatives by its parameters.

        Args:
            k: Number of the throw.
            here: The shared parameters and the release, shape (shared + 12,).
            release_only: Whether to leave out the derivatives by the shared parameters.

        Returns:
            Residuals, shape (m,), and derivatives, shape (m, shared + 12) or (m, 12).
        """
        near = self.neighbours(here, release_only=release_only)
        return near.slopes(self.whitened(k, near.parameters))

    def neighbours(self, here: FloatArray, *, release_only: bool = False) -> 'Neighbours':
        """Return where to compute residuals for their derivatives; see `linearised`."""
        h = np.concatenate([_SHARED_STEP * self.shared_deviations, _RELEASE_STEPS])
        highest = np.concatenate([self.bounds[1], np.full(RELEASE_SIZE, np.inf)])
        h = np.where(here + h > highest, -h, h)
        every = np.arange(self.shared if release_only else 0, len(h))
        batch = np.tile(here, (len(every) + 1, 1))
        batch[1 + np.arange(len(every)), every] += h[every]
        return Neighbours(batch, h[every])

    def shared_priors(self, shared: FloatArray) -> FloatArray:
        """Return the residuals of the priors of the shared parameters, shape (shared,)."""
        residuals: FloatArray = (shared - self.means[: self.shared]) / self.shared_deviations
        return residuals

    def release_priors(self, k: int, release: FloatArray) -> FloatArray:
        """Return the residuals of the prior of a release or of several, shape (12,) or (m, 12)."""
        throw = self.throws[k]
        residuals: FloatArray = (release - throw.believed) @ throw.information.T
        return residuals

    def here(self, k: int, x: FloatArray) -> FloatArray:
        """Return the shared parameters and the release of throw `k`, shape (shared + 12,)."""
        return np.concatenate([x[: self.shared], x[self.own(k)]])


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Parameters and their neighbours in each direction.

    Attributes:
        parameters: Those in the middle first, shape (1 + d, shared + 12).
        steps: From the first to each other, shape (d,).
    """

    parameters: FloatArray
    steps: FloatArray

    def slopes(self, r: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return residuals in the middle, shape (m,), and derivatives, (m, d), from (1 + d, m)."""
        slopes: FloatArray = ((r[1:] - r[0]) / self.steps[:, np.newaxis]).T
        return r[0], slopes


def whitened_together(
    finest: Problem, problems: Sequence[Problem], k: int, several: Sequence[FloatArray]
) -> list[FloatArray]:
    """Return the residuals of throw `k` of problems that differ in its first state alone.

    Args:
        finest: The one in whose step all flights are computed, at once.
        problems: The problems.
        k: Number of the throw.
        several: Parameters for each problem, shape (m, shared + 12).

    Returns:
        Residuals in standard deviations for each problem, shape (m, n).
    """
    flights = [
        problem.states_and_rows(k, parameters)
        for problem, parameters in zip(problems, several, strict=True)
    ]
    states, rows, foot = (np.concatenate(parts) for parts in zip(*flights, strict=True))
    ends = np.cumsum([len(parameters) for parameters in several])
    return np.split(finest.whitened_from(k, states, rows, foot), ends[:-1])
