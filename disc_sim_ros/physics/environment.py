"""The air: density, gravity, mean wind, its profile over the height, and turbulence."""

from dataclasses import dataclass

from disc_sim_ros import validation
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.quantities import AIR, MEAN_WIND, WIND


@dataclass(frozen=True, kw_only=True, slots=True)
class Air:
    """Density and gravity; the defaults reproduce the paper's Fig. 5, which gives no density.

    Raises:
        ConfigError: A value is out of range.
    """

    density: float = AIR['air_density'].default  # kg/m^3, ISA sea level
    gravity: float = AIR['gravity'].default  # m/s^2

    def __post_init__(self) -> None:
        AIR['air_density'].check(self.density, 'density')
        AIR['gravity'].check(self.gravity)


@dataclass(frozen=True, kw_only=True, slots=True)
class Wind:
    """Wind over the ground: a mean, optionally with a log profile and Dryden turbulence.

    Attributes:
        mean: Velocity of the air in the paper's earth axes (X forward, Y right, Z down) [m/s],
            shape (3,). With a log profile its horizontal part is the wind at `reference_height`.
        roughness_length: z0 of U(h) = U_ref ln(h / z0) / ln(h_ref / z0) [m]; 0 is no profile.
        reference_height: h_ref [m].
        turbulence: Mean wind at 6 m height that sets the strength of the Dryden gusts,
            MIL-F-8785C's W_20 [m/s]; 0 is none. About 8 is light, 15 moderate, 23 severe.
        seed: Of the gusts; the same seed gives the same gusts.

    Raises:
        ConfigError: A value is out of range, or `reference_height` is below twice
            `roughness_length`, where the profile diverges.
    """

    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roughness_length: float = WIND['roughness_length'].default
    reference_height: float = WIND['reference_height'].default
    turbulence: float = WIND['turbulence'].default
    seed: int = WIND['gust_seed'].default

    def __post_init__(self) -> None:
        validation.vector('wind', self.mean)
        for axis, quantity, speed in zip('XYZ', MEAN_WIND.values(), self.mean, strict=True):
            quantity.check(speed, f'wind {axis}')
        for name in ('roughness_length', 'reference_height', 'turbulence'):
            WIND[name].check(getattr(self, name))
        WIND['gust_seed'].check(self.seed, 'seed')
        lowest = 2.0 * self.roughness_length
        if self.reference_height < lowest:  # the profile divides by ln(h_ref / z0)
            height = WIND['reference_height']
            allowed = f'{height.within(lowest).allowed}, at least twice roughness_length'
            raise ConfigError(height.name, self.reference_height, allowed, height.name)
