"""Units: those that a user may write, such as '60mph', and those in which programs answer."""

from dataclasses import dataclass
from math import pi
from typing import Any

NANOSECONDS = 1_000_000_000  # per second

# By the unit of a quantity in `quantities`: the units that may stand behind its number. Exact by
# definition: the inch is 25.4 mm, the nautical mile 1852 m, the pound 0.45359237 kg.
_INCH, _FOOT, _YARD, _MILE = 0.0254, 0.3048, 0.9144, 1609.344  # m
UNITS: dict[str, dict[str, float]] = {
    'm': {'m': 1.0, 'cm': 0.01, 'ft': _FOOT, 'in': _INCH, 'yd': _YARD},
    'm/s': {
        'm/s': 1.0,
        'km/h': 1.0 / 3.6,
        'kmh': 1.0 / 3.6,
        'mph': _MILE / 3600.0,
        'ft/s': _FOOT,
        'kn': 1852.0 / 3600.0,
    },
    'rad/s': {
        'rad/s': 1.0,
        'rpm': 2.0 * pi / 60.0,
        'rev/s': 2.0 * pi,
        'deg/s': pi / 180.0,
    },
    'degrees': {'deg': 1.0, '°': 1.0, 'rad': 180.0 / pi},
    's': {'s': 1.0, 'ms': 1e-3},
    'kg': {'kg': 1.0, 'g': 1e-3, 'lb': 0.45359237, 'oz': 0.45359237 / 16.0},
    'kg/m^3': {'kg/m^3': 1.0, 'kg/m3': 1.0},
    'degC': {'degC': 1.0, 'C': 1.0},
}


def split(text: str) -> tuple[str, str]:
    """Return the number and the unit of a text such as '60mph' or '60 mph'; '' without a unit."""
    text = text.strip()
    end = len(text)
    while end and not (text[end - 1].isdigit() or text[end - 1] == '.'):
        end -= 1
    # 'inf' and 'nan' have no digits; an exponent ends in one.
    return (text[:end], text[end:].strip()) if end else (text, '')


def spellings(unit: str) -> str:
    """Return the units that may stand behind a number of this unit, for people."""
    return ', '.join(UNITS.get(unit, {}))


@dataclass(frozen=True, slots=True)
class System:
    """A system of units for people, by the names of `UNITS`.

    Attributes:
        length: Unit of heights and distances.
        speed: Unit of speeds.
        spin: Unit of spin rates.
    """

    length: str
    speed: str
    spin: str

    def unit(self, si: str) -> str:
        """Return the unit in which a quantity of this SI unit is shown; angles and times stay."""
        return {'m': self.length, 'm/s': self.speed, 'rad/s': self.spin}.get(si, si)

    def number(self, value: Any, si: str) -> Any:
        """Return a value, or an array of values, in the unit in which it is shown."""
        unit = self.unit(si)
        return value if unit == si else value / UNITS[si][unit]

    def text(self, value: float, si: str, form: str = '.2f') -> str:
        """Return a value as a number, in a form of `format`, with its unit."""
        return f'{self.number(value, si):{form}} {self.unit(si)}'


METRIC = System('m', 'm/s', 'rad/s')
SYSTEMS = {'metric': METRIC, 'us': System('ft', 'mph', 'rpm')}
