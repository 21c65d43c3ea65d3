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
"""

from collections.abc import Mapping
import csv
from pathlib import Path

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.files import reason

TIME, THROW = 't_s', 'throw'
GROUPS = {
    'position': ('x_m', 'y_m', 'z_m'),
    'attitude': ('qx', 'qy', 'qz', 'qw'),
    'gyro': ('p_rad_s', 'q_rad_s', 'r_rad_s'),
    'acceleration': ('fx_m_s2', 'fy_m_s2', 'fz_m_s2'),
}
CAMERA_COLUMNS = ('x_m', 'y_m')
_MOST_ROWS = 1_000_000
_LARGEST = 1e100  # larger numbers are none: their squares are infinite

Columns = Mapping[str, tuple[FloatArray, FloatArray]]  # times (n,) and values (n, d) by instrument


def read(path: Path | str, thing: str = 'THROWS') -> dict[str, Columns]:
    """Return the measurements of each throw of a file, by the name of the throw.

    Args:
        path: The file.
        thing: What the file is to the user, for errors.

    Returns:
        For each throw the times [s] and values of each instrument that has any: 'position' (map),
        'camera' (map, x and y), 'attitude' (x, y, z, w), 'gyro', 'acceleration'.

    Raises:
        ConfigError: The file cannot be read, lacks a column, or holds something that is not a
            finite number; the message names file, line and column.
    """
    name = str(path)
    try:
        text = Path(path).expanduser().read_text(encoding='utf-8-sig')
    except (OSError, ValueError) as error:
        why = reason(error) if isinstance(error, OSError) else 'it is no text in UTF-8'
        raise ConfigError(thing, name, f'cannot read it ({why})') from None
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.startswith('#')
    ]
    if len(lines) > _MOST_ROWS:
        raise ConfigError(thing, f'{name}: {len(lines)} rows', f'at most {_MOST_ROWS} rows')
    if not lines:
        raise ConfigError(thing, name, 'the file is empty')
    head = _cells(thing, name, *lines[0])
    instruments = _instruments(thing, name, head)
    at = {column: place for place, column in enumerate(head)}
    rows: dict[str, dict[str, list[list[float]]]] = {}
    for number, line in lines[1:]:
        cells = _cells(thing, name, number, line)
        if len(cells) != len(head):
            where = f'{name}: line {number}: {len(cells)} cells'
            raise ConfigError(thing, where, f'the head of the file has {len(head)}')
        throw = cells[at[THROW]] if THROW in at else Path(name).stem
        of = rows.setdefault(throw, {})
        for instrument, columns in instruments.items():
            values = [cells[at[column]] for column in (TIME, *columns)]
            if all(values):
                numbers = [
                    _number(name, number, column, value)
                    for column, value in zip((TIME, *columns), values, strict=True)
                ]
                of.setdefault(instrument, []).append(numbers)
    if not rows:
        raise ConfigError(thing, name, 'no row has a measurement')
    arrays = {
        throw: {kind: np.array(numbers) for kind, numbers in of.items()}
        for throw, of in rows.items()
    }
    return {
        throw: {kind: (a[:, 0], a[:, 1:]) for kind, a in of.items()}
        for throw, of in arrays.items()
    }


def _instruments(thing: str, name: str, head: list[str]) -> dict[str, tuple[str, ...]]:
    """Return the columns of the instruments that a file has."""
    if TIME not in head:
        raise ConfigError(thing, f'{name}: {", ".join(head)}', f'name the columns, {TIME} first')
    if len(set(head)) < len(head):
        raise ConfigError(thing, f'{name}: {", ".join(head)}', 'name each column once')
    instruments = {kind: columns for kind, columns in GROUPS.items() if set(columns) <= set(head)}
    if 'position' not in instruments and set(CAMERA_COLUMNS) <= set(head):
        instruments['camera'] = CAMERA_COLUMNS
    if not instruments:
        groups = '; '.join(', '.join(columns) for columns in GROUPS.values())
        raise ConfigError(thing, f'{name}: {", ".join(head)}', f'give columns of {groups}')
    return instruments


def _number(name: str, line: int, column: str, value: str) -> float:
    """Return a finite number, whose square is finite too."""
    where = f'{name}: line {line}: {column}'
    try:
        number = float(value)
    except ValueError:
        number = float('nan')
    if not abs(number) < _LARGEST:
        raise ConfigError(where, value, 'give a finite number, or nothing')
    return number


def _cells(thing: str, name: str, number: int, line: str) -> list[str]:
    """Return the cells of a line.

    Raises:
        ConfigError: It is no CSV, such as a cell of more than 131072 characters.
    """
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise ConfigError(thing, f'{name}: line {number}', str(error)) from None
