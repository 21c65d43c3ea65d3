"""What an ensemble may vary: names, units, ranges, and the columns that carry them."""

from dataclasses import dataclass

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.ensemble import OTHER_LIMITS
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.launch import LIMITS


@dataclass(frozen=True, slots=True)
class Quantity:
    """One thing that may differ from flight to flight."""

    name: str
    unit: str  # for people
    suffix: str  # of its column
    lowest: float
    highest: float

    @property
    def column(self) -> str:
        """Return the name of its column."""
        return f'{self.name}_{self.suffix}' if self.suffix else self.name

    @property
    def label(self) -> str:
        """Return its name and unit for people."""
        name = self.name.replace('_', ' ')
        return f'{name}, {SHORT.get(self.unit, self.unit)}' if self.unit else name


SHORT = {'degrees': '°'}
_SUFFIXES = {
    '': '',
    'm/s': 'm_s',
    'degrees': 'deg',
    'rad/s': 'rad_s',
    'm': 'm',
    'kg': 'kg',
    'kg m^2': 'kg_m2',
    'kg/m^3': 'kg_m3',
    'm/s^2': 'm_s2',
}

LAUNCH = tuple(LIMITS)
WIND = ('wind_x', 'wind_y', 'wind_z')  # where the air moves to, map axes
CONTROL = ('control_CL', 'control_CM', 'control_CN')
ADVANCE_RATIO = 'advance_ratio'

QUANTITIES = {
    name: Quantity(name, unit, _SUFFIXES[unit], lowest, highest)
    for name, (lowest, highest, unit) in (
        LIMITS | {ADVANCE_RATIO: (-100.0, 100.0, '')} | OTHER_LIMITS
    ).items()
}
_OTHER_NAMES = {'alpha': 'angle_of_attack', 'CL': CONTROL[0], 'CM': CONTROL[1], 'CN': CONTROL[2]}

# What comes out of each flight: column, label.
RESULTS = {
    'time_s': 'time of flight, s',
    'x_m': 'forward x, m',
    'y_m': 'left y, m',
    'z_m': 'height z, m',
    'range_m': 'range, m',
    'drift_m': 'drift to the left, m',
    'apex_m': 'apex, m',
    'end_speed_m_s': 'speed at the end, m/s',
    'end_spin_rad_s': 'spin at the end, rad/s',
}
STATUS = ('flying', 'landed', 'lost')  # as integration.FLYING, LANDED, LOST count


def quantity(thing: str, name: str) -> Quantity:
    """Return the quantity of a name; flags of `fly` (roll-rate, alpha) are names too.

    Args:
        thing: Of the message: a flag or an argument.
        name: As the user wrote it.

    Raises:
        ConfigError: There is no such quantity.
    """
    key = name.strip().replace('-', '_')
    key = _OTHER_NAMES.get(key, key)
    if key not in QUANTITIES:
        raise ConfigError(thing, name, f'choose from {", ".join(QUANTITIES)}')
    return QUANTITIES[key]


def fixed_property(setup: Setup, name: str) -> float:
    """Return a property of the disc or of the air where it is not varied."""
    if name in {'air_density', 'gravity'}:
        return float(getattr(setup.air, name.removeprefix('air_')))
    if name.endswith('_factor'):
        return 1.0
    return 0.0 if name.endswith('_offset') else float(getattr(setup.disc, name))
