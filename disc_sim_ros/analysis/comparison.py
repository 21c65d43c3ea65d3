"""Several flights side by side: a table to read, in metric units or those of the USA."""

from collections.abc import Sequence
import math

from disc_sim_ros.physics.flight import Flight
from disc_sim_ros.units import METRIC, System


def table(names: Sequence[str], flights: Sequence[Flight], system: System = METRIC) -> str:
    """Return a line for each flight, under a line with units.

    Args:
        names: What tells the flights apart, such as their discs.
        flights: The flights.
        system: Units of the numbers.
    """
    s = system

    def cell(value: float, si: str, form: str = '.1f') -> str:
        return f'{s.number(value, si):{form}}'

    width = max(len('flight'), *(len(name) for name in names))
    heads = (
        f'range {s.length}', f'left {s.length}', 'time s', f'apex {s.length}',
        f'speed {s.speed}', f'at the end {s.speed}', f'spin {s.spin}', 'left of it',
    )  # fmt: skip
    lines = [f'{"flight":{width}}  ' + '  '.join(heads)]
    for name, flight in zip(names, flights, strict=True):
        spin = flight.launch.spin
        cells = (
            cell(flight.range, 'm'),
            cell(flight.drift, 'm'),
            f'{flight.time:.2f}' if flight.landed else f'{flight.time:.2f}+',
            cell(flight.apex, 'm'),
            cell(flight.launch.speed, 'm/s'),
            cell(math.hypot(*flight.end[3:6]), 'm/s'),
            cell(spin, 'rad/s', '.0f'),
            f'{flight.end.r / spin:.1%}' if spin else '',
        )
        lines.append(
            f'{name:{width}}  '
            + '  '.join(f'{c:>{len(h)}}' for c, h in zip(cells, heads, strict=True))
        )
    if not all(flight.landed for flight in flights):
        lines.append('+: still in the air when the duration was over')
    return '\n'.join(lines)
