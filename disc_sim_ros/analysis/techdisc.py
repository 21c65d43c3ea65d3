"""Throws measured by a TechDisc, a disc with sensors: rows of its CSV export as launches."""

import csv
from dataclasses import dataclass
from pathlib import Path

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.files import reason
from disc_sim_ros.physics.thrower import THROWS, Release
from disc_sim_ros.quantities import LAUNCH, THROWER
from disc_sim_ros.units import UNITS
from disc_sim_ros.validation import Quantity

_SPEEDS = {'speedMph': 'mph', 'speedKmh': 'km/h', 'speedMps': 'm/s'}
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
    try:
        text = Path(path).expanduser().read_text(encoding='utf-8-sig')
    except (OSError, ValueError) as error:
        why = reason(error) if isinstance(error, OSError) else 'it is no text in UTF-8'
        raise ConfigError('techdisc', str(path), f'cannot read it ({why})') from None
    rows = csv.DictReader(text.splitlines())
    try:
        return _throws(path, rows)
    except csv.Error as error:  # such as a cell of more than 131072 characters
        line = rows.line_num + 1
        raise ConfigError('techdisc', f'{path} line {line}', str(error)) from None


def _throws(path: Path | str, rows: 'csv.DictReader[str]') -> list[Throw]:
    columns = [name.strip() for name in rows.fieldnames or ()]
    rows.fieldnames = columns
    speeds = [name for name in _SPEEDS if name in columns]
    needed = ['spinRpm', 'launchAngle', 'noseAngle', 'hyzerAngle']
    missing = [name for name in needed if name not in columns]
    if not speeds or missing:
        names = ', '.join(missing or ['speedMph, speedKmh or speedMps'])
        raise ConfigError('techdisc', str(path), f'it needs a column {names}')
    measured = [
        _throw(row, number, f'{path} line {rows.line_num}', speeds[0])
        for number, row in enumerate(rows, 1)
    ]
    if not measured:
        raise ConfigError('techdisc', str(path), 'it needs at least one throw below the names')
    return measured


def _throw(row: dict[str, str], number: int, where: str, speed: str) -> Throw:
    def value(column: str, quantity: Quantity, factor: float = 1.0) -> float:
        text = (row.get(column) or '').strip()
        try:
            given: float | str = float(text)
        except ValueError:
            given = text
        scaled = given * factor if isinstance(given, float) else given
        try:
            checked: float = quantity.check(scaled)
        except ConfigError as error:
            raise ConfigError(f'{where}: {column}', given, error.allowed) from None
        return checked

    kind = (row.get('throwType') or '').strip().lower()
    if kind and kind not in _TYPES:
        raise ConfigError(f'{where}: throwType', kind, f'choose from {", ".join(_TYPES)}')
    spin = value('spinRpm', LAUNCH['spin'], UNITS['rad/s']['rpm'])
    if kind:
        spin = abs(spin) * THROWS[_TYPES[kind]]
    wobble = (row.get('wobbleAngle') or '').strip()
    return Throw(
        f'{number} {kind}'.rstrip(),
        Release(
            speed=value(speed, LAUNCH['speed'], UNITS['m/s'][_SPEEDS[speed]]),
            spin=spin,
            launch_angle=value('launchAngle', THROWER['launch_angle']),
            nose=value('noseAngle', THROWER['nose']),
            hyzer=value('hyzerAngle', THROWER['hyzer']),
            wobble=value('wobbleAngle', _WOBBLE) if wobble else 0.0,
        ),
    )
