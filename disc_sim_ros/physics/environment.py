"""The air: density, gravity, mean wind, its profile over height, and how rough it is."""

from dataclasses import dataclass

from disc_sim_ros import validation


@dataclass(frozen=True, kw_only=True, slots=True)
class Air:
    """Still surroundings of a flight; the paper prints no density, these reproduce its Fig. 5."""

    density: float = 1.225  # kg/m^3, ISA sea level
    gravity: float = 9.81  # m/s^2

    def __post_init__(self) -> None:
        validation.number('density', self.density, 0.0, 100.0, unit='kg/m^3')
        validation.number('gravity', self.gravity, 0.0, 100.0, unit='m/s^2')


@dataclass(frozen=True, kw_only=True, slots=True)
class Wind:
    """Wind over the ground: a mean, optionally with a log profile and Dryden turbulence.

    Attributes:
        mean: Where the air moves to, the paper's earth axes (X forward, Y right, Z down) [m/s].
            With a log profile its horizontal part is the wind at `reference_height`.
        roughness_length: z0 of U(h) = U_ref ln(h / z0) / ln(h_ref / z0) [m]; 0 is no profile.
        reference_height: h_ref [m].
        turbulence: Mean wind at 6 m height that sets the strength of the Dryden gusts,
            MIL-F-8785C's W_20 [m/s]; 0 is none. About 8 is light, 15 moderate, 23 severe.
        seed: Of the gusts; the same seed gives the same gusts.
    """

    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roughness_length: float = 0.0
    reference_height: float = 10.0
    turbulence: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for axis, speed in zip('XYZ', self.mean, strict=True):
            validation.number(f'wind {axis}', speed, -100.0, 100.0, unit='m/s')
        validation.number('roughness_length', self.roughness_length, 0.0, 10.0, unit='m')
        # The profile divides by ln(h_ref / z0).
        lowest = max(2.0 * self.roughness_length, 0.1)
        validation.number('reference_height', self.reference_height, lowest, 1000.0, unit='m')
        validation.number('turbulence', self.turbulence, 0.0, 50.0, unit='m/s')
        validation.whole_number('seed', self.seed, 0, 2**63 - 1)
