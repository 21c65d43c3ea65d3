"""Names of the quantities and of the columns of an ensemble of flights."""

from disc_sim_ros import quantities
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.validation import Quantity

LAUNCH = tuple(quantities.LAUNCH)
WIND = tuple(quantities.MEAN_WIND)
CONTROL = tuple(quantities.CONTROL)
ADVANCE_RATIO = quantities.ADVANCE_RATIO.name
_OTHER_NAMES = {'alpha': 'angle_of_attack', 'CL': CONTROL[0], 'CM': CONTROL[1], 'CN': CONTROL[2]}

# The results of each flight: column, label.
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
STATUS = ('flying', 'landed', 'lost')  # in the order of integrator.FLYING, LANDED, LOST


def quantity(thing: str, name: str) -> Quantity:
    """Return the quantity of a name; the flags of `fly` (roll-rate, alpha) are names too.

    Args:
        thing: Name of the flag or of the argument, for the message.
        name: The name from the user.

    Raises:
        ConfigError: No quantity has this name.
    """
    key = name.strip().replace('-', '_')
    key = _OTHER_NAMES.get(key, key)
    if key not in quantities.VARIED:
        raise ConfigError(thing, name, f'choose from {", ".join(quantities.VARIED)}')
    return quantities.VARIED[key]


def fixed_property(setup: Setup, name: str) -> float:
    """Return a property of the disc or of the air where it is not varied."""
    if name in quantities.AIR:
        return float(getattr(setup.air, name.removeprefix('air_')))
    if name in quantities.AERO_CHANGES:
        return float(quantities.AERO_CHANGES[name].default)
    return float(getattr(setup.disc, name))
