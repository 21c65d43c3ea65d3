"""Throws measured by a TechDisc, a disc with sensors: rows of its CSV export as launches."""

from dataclasses import dataclass
from pathlib import Path

from disc_sim_ros import csv_table
from disc_sim_ros.csv_table import Table
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.thrower import THROWS, Release
from disc_sim_ros.quantities import LAUNCH, THROWER
from disc_sim_ros.units import UNITS
from disc_sim_ros.validation import Quantity, range_text

_SPEEDS = {'speedMph': 'mph', 'speedKmh': 'km/h', 'speedMps': 'm/s'}
_NEEDED = ('spinRpm', 'launchAngle', 'noseAngle', 'hyzerAngle')
_KNOWN = (*_SPEEDS, *_NEEDED, 'wobbleAngle', 'throwType')
_WOBBLE = Quantity('wobbleAngle', 'degrees', 0.0, 60.0, 0.0, 'Half the angle of the wobble')
# `throwType` of a right-handed thrower; the sensor does not know the hand.
_TYPES = {**{name: name for name in THROWS}, 'backhand': 'rhbh', 'forehand': 'rhfh'}


@dataclass(frozen=True)
class Throw:
    """One measured throw.

    Attributes:
        name: Of the row: the number in the file, from 1, and the kind of throw.
        release: What the sensor measured; its heading is 0, because the sensor has no compass.
    """

    name: str
    release: Release


def throws(path: Path | str) -> list[Throw]:
    """Return the throws of a CSV file, by the names of its columns.

    Columns: speedMph, speedKmh or speedMps; spinRpm; launchAngle, noseAngle and hyzerAngle in
    degrees, hyzer positive; optional wobbleAngle and throwType. Other columns are not read.

    Raises:
        ConfigError: The file cannot be read, lacks a column, or has a value out of range; the
            message names file, line, column, value and what is allowed.
    """
    table = csv_table.read(path, 'techdisc')
    speeds = [name for name in _SPEEDS if name in table.columns]
    if not speeds:
        raise table.lacks('it needs a column speedMph, speedKmh or speedMps', [*_SPEEDS], _KNOWN)
    missing = [name for name in _NEEDED if name not in table.columns]
    if missing:
        raise table.lacks(f'it needs a column {", ".join(missing)}', missing, _KNOWN)
    measured = [
        _throw(table, dict(zip(table.columns, cells, strict=True)), number, line, speeds[0])
        for number, (line, cells) in enumerate(table.rows(), 1)
    ]
    if not measured:
        raise ConfigError('techdisc', table.name, 'it needs at least one throw below the names')
    return measured


def _throw(table: Table, row: dict[str, str], number: int, line: int, speed: str) -> Throw:
    where = f'{table.name}: line {line}'

    def value(column: str, quantity: Quantity, unit: str = '') -> float:
        """Return a number of the row in the unit of its quantity, within the range of that."""
        factor = UNITS[quantity.unit][unit] if unit else 1.0
        number = table.number(row[column])
        given = row[column] if number is None else number
        try:
            checked: float = quantity.check(given if number is None else number * factor)
        except ConfigError:
            lowest, highest = quantity.lowest / factor, quantity.highest / factor
            allowed = range_text(lowest, highest, None, unit or quantity.unit)
            raise ConfigError(f'{where}: {column}', given, allowed) from None
        return checked

    kind = row.get('throwType', '').lower()
    if kind and kind not in _TYPES:
        raise ConfigError(f'{where}: throwType', kind, f'choose from {", ".join(_TYPES)}')
    spin = value('spinRpm', LAUNCH['spin'], 'rpm')
    if kind:
        spin = abs(spin) * THROWS[_TYPES[kind]]
    wobbles = row.get('wobbleAngle')
    return Throw(
        f'{number} {kind}'.rstrip(),
        Release(
            speed=value(speed, LAUNCH['speed'], _SPEEDS[speed]),
            spin=spin,
            launch_angle=value('launchAngle', THROWER['launch_angle']),
            nose=value('noseAngle', THROWER['nose']),
            hyzer=value('hyzerAngle', THROWER['hyzer']),
            wobble=value('wobbleAngle', _WOBBLE) if wobbles else 0.0,
        ),
    )
