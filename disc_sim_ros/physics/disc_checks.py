"""Checks of mass, size and inertia of a disc against each other, with a guess at a wrong unit."""

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.quantities import DISC
from disc_sim_ros.validation import Quantity

# Units that people mistake for the unit of the quantity, and their size in it.
_OTHER_UNITS: dict[str, dict[str, float]] = {
    'mass': {'grams': 1e-3, 'ounces': 28.349523125e-3},
    'diameter': {'inches': 25.4e-3, 'cm': 1e-2, 'mm': 1e-3},
    'area': {'cm^2': 1e-4, 'mm^2': 1e-6},
}
_INERTIA_UNITS = {'g m^2': 1e-3, 'kg cm^2': 1e-4, 'kg mm^2': 1e-6, 'g cm^2': 1e-7}
# Discs that people throw, from a mini to a large ring; only for guesses, never a limit.
_USUAL = {'mass': (0.01, 0.5), 'diameter': (0.08, 0.5), 'area': (0.005, 0.2)}
# I_z / (m (d/2)^2) of discs: 0.5 if the mass is spread evenly, 1 if it is all in the rim.
_USUAL_SHAPE = (0.4, 1.0)
_ROUNDING = 1.0 + 1e-9


def check_number(quantity: Quantity, value: object, thing: str = '') -> float:
    """Return the value of a quantity of `DISC` as a float.

    Args:
        quantity: One quantity of `DISC`.
        value: The value from the user.
        thing: Name of the value in the message; empty for the name of the quantity.

    Raises:
        ConfigError: The value is not a number or out of range; the message guesses the unit.
    """
    try:
        return float(quantity.check(value, thing))
    except ConfigError as error:
        guess = _guess(quantity.name, error.value)
        raise ConfigError(error.thing, error.value, error.allowed + guess, quantity.name) from None


def check_body(
    mass: float, diameter: float, area: float, inertia_axial: float, inertia_diametral: float
) -> None:
    """Refuse a body that cannot exist: no part of a disc is further out than its rim.

    Args:
        mass: [kg].
        diameter: [m].
        area: Planform area [m^2]; at most that of a square around the disc.
        inertia_axial: I_z [kg m^2], at most m (d/2)^2 and at most 2 I_x.
        inertia_diametral: I_x = I_y [kg m^2], at most m (d/2)^2.

    Raises:
        ConfigError: One of the bounds is passed; the message has the bound and a guess.
    """
    if area > diameter**2:
        allowed = f'at most diameter^2, {diameter**2:.4g} m^2' + _guess('area', area)
        raise ConfigError('area', area, allowed, 'area')
    most = mass * (diameter / 2.0) ** 2
    for name, value in (
        ('inertia_axial', inertia_axial),
        ('inertia_diametral', inertia_diametral),
    ):
        if value > most * _ROUNDING:
            allowed = (
                f'at most m (d/2)^2 = {most:.4g} kg m^2 with a mass of {mass:g} kg and a diameter '
                f'of {diameter:g} m{_inertia_guess(name, value, mass, most)}'
            )
            raise ConfigError(name, value, allowed, name)
    # No body has I_z > I_x + I_y; a flat one has equality, to rounding.
    if inertia_axial > 2.0 * inertia_diametral * _ROUNDING:
        allowed = f'at most twice inertia_diametral, {2 * inertia_diametral:g} kg m^2'
        raise ConfigError('inertia_axial', inertia_axial, allowed, 'inertia_axial')


def _guess(name: str, value: object) -> str:
    """Return the unit that makes a number usual, as the end of a sentence; empty if none does."""
    if name not in _OTHER_UNITS or isinstance(value, bool) or not isinstance(value, int | float):
        return ''
    low, high = _USUAL[name]
    for unit, size in _OTHER_UNITS[name].items():
        if low <= value <= high / size and low <= value * size <= high:
            return f'; {DISC[name].unit} expected, this looks like {unit}'
    return ''


def _inertia_guess(name: str, value: float, mass: float, most: float) -> str:
    half = 1.0 if name == 'inertia_axial' else 0.5  # I_x is about half of I_z
    low, high = (half * share * most for share in _USUAL_SHAPE)
    symbol = 'I_z' if name == 'inertia_axial' else 'I_x'
    if low <= value * mass <= high:
        return f'; kg m^2 expected, this looks like {symbol} / m in m^2'
    for unit, size in _INERTIA_UNITS.items():
        if low <= value * size <= high:
            return f'; kg m^2 expected, this looks like {unit}'
    return ''
