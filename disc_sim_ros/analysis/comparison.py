"""Several flights side by side: a table to read, in metric units or those of the USA."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from disc_sim_ros.physics.flight import Flight
from disc_sim_ros.units import UNITS


@dataclass(frozen=True)
class System:
    """A system of units for people: how many SI units one of its units has, and its words."""

    length: str
    speed: str
    spin: str

    def text(self, value: float, unit: str, digits: int = 1) -> str:
        """Return a value in SI as a number in one of the units of `units.UNITS`."""
        of = {self.length: 'm', self.speed: 'm/s', self.spin: 'rad/s'}[unit]
        return f'{value / UNITS[of][unit]:.{digits}f}'


SYSTEMS = {'metric': System('m', 'm/s', 'rad/s'), 'us': System('ft', 'mph', 'rpm')}


def table(names: Sequence[str], flights: Sequence[Flight], system: str = 'metric') -> str:
    """Return a line for each flight, under a line with units.

    Args:
        names: What tells the flights apart, such as their discs.
        flights: The flights.
        system: One of SYSTEMS.
    """
    s = SYSTEMS[system]
    width = max(len('flight'), *(len(name) for name in names))
    heads = (
        f'range {s.length}', f'left {s.length}', 'time s', f'apex {s.length}',
        f'speed {s.speed}', f'at the end {s.speed}', f'spin {s.spin}', 'left of it',
    )  # fmt: skip
    lines = [f'{"flight":{width}}  ' + '  '.join(heads)]
    for name, flight in zip(names, flights, strict=True):
        spin = flight.launch.spin
        cells = (
            s.text(flight.range, s.length),
            s.text(flight.drift, s.length),
            f'{flight.time:.2f}' if flight.landed else f'{flight.time:.2f}+',
            s.text(flight.apex, s.length),
            s.text(flight.launch.speed, s.speed),
            s.text(math.hypot(*flight.end[3:6]), s.speed),
            s.text(spin, s.spin, 0),
            f'{flight.end.r / spin:.1%}' if spin else '',
        )
        lines.append(
            f'{name:{width}}  '
            + '  '.join(f'{c:>{len(h)}}' for c, h in zip(cells, heads, strict=True))
        )
    if not all(flight.landed for flight in flights):
        lines.append('+: still in the air when the duration was over')
    return '\n'.join(lines)
