"""Measured throws in CSV files: the columns of one instrument or of several, row by row.

Columns, by name, in any order; an empty cell is no measurement:

| column | is |
|---|---|
| throw | name of the throw; without it the file holds one |
| t_s | time [s] |
| x_m, y_m, z_m | position of the centre in `map`; without z_m what a camera above draws |
| qx, qy, qz, qw | attitude from `disc` or `disc_body` to `map` |
| p_rad_s, q_rad_s, r_rad_s | gyro fixed in the disc: x, y in its plane, z through the underside |
| fx_m_s2, fy_m_s2, fz_m_s2 | accelerometer at the centre, in the axes of the gyro |

Positions may also have the names that `fly --csv` gives them. `csv_table` says what else a file
may look like.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from disc_sim_ros import csv_table
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.csv_table import Table
from disc_sim_ros.errors import ConfigError

TIME, THROW = 't_s', 'throw'
GROUPS = {
    'position': ('x_m', 'y_m', 'z_m'),
    'attitude': ('qx', 'qy', 'qz', 'qw'),
    'gyro': ('p_rad_s', 'q_rad_s', 'r_rad_s'),
    'acceleration': ('fx_m_s2', 'fy_m_s2', 'fz_m_s2'),
}
_OF_FLY = {f'position_{column}': column for column in GROUPS['position']}  # `fly --csv`
_KNOWN = (TIME, THROW, *(column for columns in GROUPS.values() for column in columns))
CAMERA_COLUMNS = ('x_m', 'y_m')
_LARGEST = 1e100  # larger numbers are none: their squares are infinite

Columns = Mapping[str, tuple[FloatArray, FloatArray]]  # times (n,) and values (n, d) by instrument


@dataclass(frozen=True)
class MeasuredThrows:
    """What a file holds.

    Attributes:
        throws: By the name of the throw the times [s] and values of each instrument that has
            any: 'position' (map), 'camera' (map, x and y), 'attitude' (x, y, z, w), 'gyro',
            'acceleration'.
        unread: Columns that are none of these.
    """

    throws: dict[str, Columns]
    unread: tuple[str, ...]


def read(path: Path | str, thing: str = 'THROWS') -> MeasuredThrows:
    """Return the measurements of each throw of a file.

    Args:
        path: The file.
        thing: What the file is to the user, for errors.

    Raises:
        ConfigError: The file cannot be read, lacks a column, or holds something that is not a
            finite number; the message names file, line and column.
    """
    table = csv_table.read(path, thing).renamed(_OF_FLY)
    instruments = _instruments(table)
    at = {column: place for place, column in enumerate(table.columns)}
    rows: dict[str, dict[str, list[list[float]]]] = {}
    for line, cells in table.rows():
        throw = cells[at[THROW]] if THROW in at else Path(table.name).stem
        if not throw:
            raise ConfigError(f'{table.name}: line {line}: {THROW}', '', 'give the throw a name')
        of = rows.setdefault(throw, {})
        for instrument, columns in instruments.items():
            values = [cells[at[column]] for column in (TIME, *columns)]
            if all(values):
                numbers = [
                    _number(table, line, column, value)
                    for column, value in zip((TIME, *columns), values, strict=True)
                ]
                of.setdefault(instrument, []).append(numbers)
    if not rows:
        raise ConfigError(thing, table.name, 'no row has a measurement')
    arrays = {
        throw: {kind: np.array(numbers) for kind, numbers in of.items()}
        for throw, of in rows.items()
    }
    throws: dict[str, Columns] = {
        throw: {kind: (a[:, 0], a[:, 1:]) for kind, a in of.items()}
        for throw, of in arrays.items()
    }
    known = {TIME, THROW, *(column for columns in instruments.values() for column in columns)}
    return MeasuredThrows(throws, tuple(name for name in table.columns if name not in known))


def label(throw: str) -> str:
    """Return the name of a throw in a text: `throw 3` where the file has only a number."""
    return f'throw {throw}' if throw.isdigit() else throw


def _instruments(table: Table) -> dict[str, tuple[str, ...]]:
    """Return the columns of the instruments that a file has.

    Raises:
        ConfigError: There is no time, no instrument, or an instrument in part.
    """
    head = set(table.columns)
    if TIME not in head:
        raise table.lacks(f'it needs a column {TIME}, the time in s', (TIME,), _KNOWN)
    instruments = {kind: columns for kind, columns in GROUPS.items() if head.issuperset(columns)}
    if 'position' not in instruments and head.issuperset(CAMERA_COLUMNS):
        instruments['camera'] = CAMERA_COLUMNS
    for kind, columns in GROUPS.items():
        missing = [column for column in columns if column not in head]
        if missing and head.intersection(columns) and {kind, 'camera'}.isdisjoint(instruments):
            needed = f'{kind} needs {", ".join(columns)}: it has no {", ".join(missing)}'
            raise table.lacks(needed, missing, _KNOWN)
    if not instruments:
        groups = '; '.join(', '.join(columns) for columns in GROUPS.values())
        raise table.lacks(f'it needs columns of {groups}', _KNOWN[2:], _KNOWN)
    return instruments


def _number(table: Table, line: int, column: str, cell: str) -> float:
    """Return a finite number, whose square is finite too."""
    number = table.number(cell)
    if number is None or not abs(number) < _LARGEST:
        where = f'{table.name}: line {line}: {column}'
        raise ConfigError(where, cell, 'give a finite number, or nothing')
    return number
