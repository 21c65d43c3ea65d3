"""Systems of units of pages, for people."""

from dataclasses import dataclass
from typing import Any

from disc_sim_ros.units import UNITS


@dataclass(frozen=True)
class System:
    """A system of units for people, by the names of `units.UNITS`.

    Attributes:
        length: Unit of heights and distances.
        speed: Unit of speeds.
        spin: Unit of spin rates.
    """

    length: str
    speed: str
    spin: str

    def lengths(self, values: Any) -> Any:
        """Return lengths [m] in this system."""
        return values / UNITS['m'][self.length]

    def speeds(self, values: Any) -> Any:
        """Return speeds [m/s] in this system."""
        return values / UNITS['m/s'][self.speed]

    def spins(self, values: Any) -> Any:
        """Return rates [rad/s] in this system."""
        return values / UNITS['rad/s'][self.spin]


SYSTEMS = {'metric': System('m', 'm/s', 'rad/s'), 'us': System('ft', 'mph', 'rpm')}
