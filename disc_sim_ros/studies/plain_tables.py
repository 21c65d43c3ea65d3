"""Tables of flights without pyarrow: unfinished parts as NumPy files, finished ones as CSV."""

from collections.abc import Iterator, Sequence
import csv
from io import BytesIO
from pathlib import Path
from typing import BinaryIO
import zipfile

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.studies.columns import STATUS

Columns = dict[str, NDArray[np.generic]]
SUFFIX = '.npz'
_ROWS = 65536  # rows of a chunk


def part_bytes(columns: Columns) -> bytes:
    """Return flights as the bytes of an NPZ file, with one array for each column."""
    sink = BytesIO()
    np.savez(sink, **columns)  # type: ignore[arg-type]  # no column is named allow_pickle
    return sink.getvalue()


def rows_of(path: Path) -> int:
    """Return the number of flights in an NPZ file; -1 if it is damaged."""
    try:
        columns = _part(path)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile):
        return -1
    return len(next(iter(columns.values()), ()))


def join_csv(parts: Sequence[Path], file: BinaryIO) -> None:
    """Write the flights of NPZ files as CSV: a line with the names, then one for each flight."""
    for number, path in enumerate(parts):
        columns = _part(path)
        if not number:
            file.write((','.join(columns) + '\n').encode())
        texts = [
            [STATUS[i] for i in values.tolist()] if name == 'status' else _texts(values)
            for name, values in columns.items()
        ]
        file.write(''.join(f'{",".join(row)}\n' for row in zip(*texts, strict=True)).encode())


def csv_chunks(path: Path, names: Sequence[str]) -> Iterator[Columns]:
    """Yield columns of a CSV file, some thousand flights at a time; see `tables.chunks`.

    Raises:
        ValueError: The file lacks a column, or holds a text where a number is due.
    """
    with path.open(encoding='utf-8', newline='') as file:
        reader = csv.reader(file)
        header = next(reader, [])
        places = [header.index(name) for name in names]
        rows: list[list[str]] = []
        for row in reader:
            rows.append(row)
            if len(rows) == _ROWS:
                yield _numbers(rows, names, places)
                rows = []
        if rows:
            yield _numbers(rows, names, places)


def _numbers(rows: list[list[str]], names: Sequence[str], places: list[int]) -> Columns:
    columns: Columns = {}
    for name, place in zip(names, places, strict=True):
        texts = [row[place] for row in rows]
        columns[name] = np.array(
            [STATUS.index(t) for t in texts] if name == 'status' else [float(t) for t in texts]
        )
    return columns


def _part(path: Path) -> Columns:
    with np.load(path) as stored:
        return {name: stored[name] for name in stored.files}


def _texts(values: NDArray[np.generic]) -> list[str]:
    """Return numbers as the shortest texts that read as the same numbers."""
    return [repr(value) for value in values.tolist()]
