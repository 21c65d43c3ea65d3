"""What is known of a throw before it is measured: how people throw, the wind, and the disc."""

from dataclasses import dataclass, field, replace
import math

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.prediction import lanes
from disc_sim_ros.physics.disc import Disc

# Standard deviations of the offsets of a disc whose file states none: about as discs of one kind
# differ in one wind tunnel (docs/discs.md).
DISC_OFFSETS = {'lift_offset': 0.02, 'drag_offset': 0.008, 'pitching_offset': 0.003}
# The same of the rolling moment, which a file cannot state: at the spin of a throw that due to
# spin was measured to be up to this size (`ultrastar`), and most discs have no table of it.
ROLLING_OFFSET = 0.004
MOST_SHAPE = 0.5  # from factor 2 on


@dataclass(frozen=True, slots=True)
class Gaussian:
    """A mean and a standard deviation; a standard deviation of 0 is exact knowledge."""

    mean: float
    sigma: float

    def __post_init__(self) -> None:
        if not math.isfinite(self.mean):
            raise ConfigError('mean', self.mean, 'give a finite number')
        if not (math.isfinite(self.sigma) and self.sigma >= 0.0):
            raise ConfigError('sigma', self.sigma, 'give a finite number of at least 0')


@dataclass(frozen=True, kw_only=True, slots=True)
class ThrowPrior:
    """A throw before its first measurement; independent normal distributions.

    Attributes:
        speed: Speed over the ground [m/s].
        climb: Angle of the velocity above the horizontal [rad].
        nose: Angle of the disc above its velocity over the ground [rad].
        bank: Tilt of the disc about its velocity, right edge down positive [rad].
        rate: Angular velocity about x and y of the disc, each [rad/s].
        spin: Spin rate, clockwise from above positive [rad/s].
        wind_x: Velocity of the air along x of `map` [m/s].
        wind_y: Velocity of the air along y of `map` [m/s].
        offsets: What is added to the coefficients of the disc: columns of an ensemble.
        shape: Standard deviation of what is added to them for the rest of a flight, as a share of
            those of the offsets: tables of another disc differ in shape.
    """

    speed: Gaussian = Gaussian(17.0, 4.0)
    climb: Gaussian = Gaussian(math.radians(12.0), math.radians(8.0))
    nose: Gaussian = Gaussian(math.radians(4.0), math.radians(4.0))
    bank: Gaussian = Gaussian(0.0, math.radians(12.0))
    rate: Gaussian = Gaussian(0.0, 2.0)
    spin: Gaussian = Gaussian(60.0, 15.0)
    wind_x: Gaussian = Gaussian(0.0, 2.0)
    wind_y: Gaussian = Gaussian(0.0, 2.0)
    offsets: dict[str, Gaussian] = field(default_factory=dict)
    shape: float = 0.0

    @property
    def constants(self) -> dict[str, Gaussian]:
        """Return the uncertain constants of a flight by their column."""
        return {name: g for name, g in self.every_constant.items() if g.sigma > 0.0}

    @property
    def every_constant(self) -> dict[str, Gaussian]:
        """Return the constants of a flight by their column."""
        return {'wind_x': self.wind_x, 'wind_y': self.wind_y, **self.offsets}

    def with_opposite_spin(self) -> 'ThrowPrior':
        """Return the prior of throws that spin the other way."""
        return replace(self, spin=Gaussian(-self.spin.mean, self.spin.sigma))

    def state_residuals(self, states: FloatArray) -> FloatArray:
        """Return by how many standard deviations releases differ from the prior.

        Args:
            states: In the paper's axes, shape (n, 14).

        Returns:
            Shape (n, 7).
        """
        every = (self.speed, self.climb, self.nose, self.bank, self.rate, self.rate, self.spin)
        means, sigmas = np.array([(g.mean, g.sigma) for g in every]).T
        residuals: FloatArray = (manner(states) - means) / sigmas
        return residuals


def manner(states: FloatArray) -> FloatArray:
    """Return speed, climb, nose, bank, p, q and spin of states, shape (n, 7), from (n, 14)."""
    out = np.empty((len(states), lanes.MANNER))
    lanes.manners(np.ascontiguousarray(states), out)
    return out


def disc_shape(factor: float) -> float:
    """Return `ThrowPrior.shape` for a factor of the uncertainty: above 1 it is another disc."""
    return MOST_SHAPE * min(max(factor - 1.0, 0.0), 1.0)


def disc_offsets(disc: Disc, factor: float = 1.0) -> dict[str, Gaussian]:
    """Return how uncertain the coefficients of a disc are: as its file states, else as usual.

    Args:
        disc: The disc.
        factor: Of the standard deviations; 0: the disc is known exactly.
    """
    sigmas = {**DISC_OFFSETS, **disc.uncertainty, 'control_CL': ROLLING_OFFSET}
    return {name: Gaussian(0.0, factor * sigma) for name, sigma in sigmas.items()}
