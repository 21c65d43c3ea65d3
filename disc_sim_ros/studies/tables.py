"""Tables of flights: Parquet and CSV, written and read in chunks to limit the memory."""

from collections.abc import Iterator, Sequence
from importlib.util import find_spec
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.studies import plain_tables
from disc_sim_ros.studies.columns import STATUS
from disc_sim_ros.studies.study import Study, study_document

if TYPE_CHECKING:
    import pyarrow as pa


Columns = dict[str, NDArray[Any]]
SUFFIXES = ('.parquet', '.csv')
METADATA_KEY = b'disc_sim_ros'
_ROWS = 65536  # least rows of a chunk


def has_pyarrow() -> bool:
    """Return True if pyarrow is installed; without it there is CSV, but no Parquet."""
    return find_spec('pyarrow') is not None


def part_suffix() -> str:
    """Return how the names of parts end that this process writes."""
    return SUFFIXES[0] if has_pyarrow() else plain_tables.SUFFIX


def check_output(path: Path) -> None:
    """Check that a file of flights can be written or read.

    Raises:
        ConfigError: Its name has another ending, or it needs pyarrow, which is not installed.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ConfigError('output', str(path), 'the name must end in .parquet or .csv')
    if suffix == SUFFIXES[0] and not has_pyarrow():
        allowed = 'Parquet needs pyarrow, which is not installed; install it, or end it in .csv'
        raise ConfigError('output', str(path), allowed)


def part_bytes(columns: Columns) -> bytes:
    """Return flights as the bytes of a part, whose name ends in `part_suffix()`."""
    return parquet_bytes(columns) if has_pyarrow() else plain_tables.part_bytes(columns)


def parquet_bytes(columns: Columns) -> bytes:
    """Return flights as the bytes of a Parquet file with one row group."""
    import pyarrow as pa  # noqa: PLC0415 - takes a quarter of a second
    from pyarrow import parquet  # noqa: PLC0415

    table = _arrow(columns)
    sink = pa.BufferOutputStream()
    parquet.write_table(table, sink, compression='zstd', row_group_size=max(len(table), 1))
    content: bytes = sink.getvalue().to_pybytes()
    return content


def join(parts: Sequence[Path], target: Path, suffix: str, study: Study) -> None:
    """Write the flights of `parts` to one file, one part at a time.

    Args:
        parts: Files of `part_bytes`, in order.
        target: File to write.
        suffix: '.parquet' (one row group for each part) or '.csv' (one header line).
        study: Study of the flights; stored in the metadata of a Parquet file, and in NAME.json
            beside a CSV file.

    Raises:
        OSError: The system refuses.
    """
    with target.open('wb') as file:
        if suffix == '.csv' and not has_pyarrow():
            plain_tables.join_csv(parts, file)
        elif suffix == '.csv':
            _join_csv(parts, file)
        else:
            _join_parquet(parts, file, study)
        file.flush()
        os.fsync(file.fileno())
    if suffix == '.csv':
        text = json.dumps(study_document(study), indent=1)
        sidecar(target.with_name(target.name.removesuffix('.joining'))).write_text(
            text, encoding='utf-8'
        )


def _join_csv(parts: Sequence[Path], file: BinaryIO) -> None:
    from pyarrow import csv, parquet  # noqa: PLC0415

    file.write((','.join(parquet.read_schema(parts[0]).names) + '\n').encode())
    options = csv.WriteOptions(include_header=False, quoting_style='none')
    for path in parts:
        csv.write_csv(_plain(parquet.read_table(path)), file, options)


def _join_parquet(parts: Sequence[Path], file: BinaryIO, study: Study) -> None:
    from pyarrow import parquet  # noqa: PLC0415

    schema = parquet.read_schema(parts[0]).with_metadata(_metadata(study))
    with parquet.ParquetWriter(file, schema, compression='zstd') as writer:
        for path in parts:
            table = parquet.read_table(path)
            writer.write_table(table, row_group_size=len(table))


def chunks(path: Path, names: Sequence[str]) -> Iterator[Columns]:
    """Yield the columns `names` of the flights of a file, some thousand flights at a time.

    `status` is given as numbers, an index of `columns.STATUS`.
    """
    if path.suffix.lower() == '.csv' and not has_pyarrow():
        yield from plain_tables.csv_chunks(path, names)
        return
    if path.suffix.lower() == '.csv':
        from pyarrow import csv  # noqa: PLC0415

        options = csv.ConvertOptions(include_columns=list(names))
        with csv.open_csv(path, convert_options=options) as reader:
            for batch in reader:
                yield _numbers(batch, names)
        return
    from pyarrow import parquet  # noqa: PLC0415

    with parquet.ParquetFile(path) as file:
        # Not iter_batches: it keeps every row that it has read in memory.
        for groups in _row_groups(file.metadata):
            yield _numbers(file.read_row_groups(groups, columns=list(names)), names)


def stored_study(path: Path) -> dict[str, Any] | None:
    """Return the document of the study of a finished file; None if it holds none."""
    try:
        if path.suffix.lower() == '.csv':
            text: bytes | None = sidecar(path).read_bytes()
        else:
            from pyarrow import parquet  # noqa: PLC0415

            text = (parquet.read_schema(path).metadata or {}).get(METADATA_KEY)
        document = json.loads(text) if text else None
    except (OSError, ValueError, RecursionError):  # pyarrow.ArrowInvalid is a ValueError
        return None
    return document if isinstance(document, dict) else None


def sidecar(path: Path) -> Path:
    """Return the path of the file that holds the study of a CSV file."""
    return path.with_name(f'{path.name}.json')


def rows_of(path: Path) -> int:
    """Return the number of flights in a part; -1 if it is damaged."""
    if not has_pyarrow():
        return plain_tables.rows_of(path)
    from pyarrow import parquet  # noqa: PLC0415

    try:
        return int(parquet.read_metadata(path).num_rows)
    except (OSError, ValueError):
        return -1


def _arrow(columns: Columns) -> 'pa.Table':
    import pyarrow as pa  # noqa: PLC0415

    arrays = {
        name: pa.DictionaryArray.from_arrays(pa.array(values, pa.int8()), pa.array(STATUS))
        if name == 'status'
        else pa.array(values)
        for name, values in columns.items()
    }
    return pa.table(arrays)


def _plain(table: 'pa.Table') -> 'pa.Table':
    """Return a table with the status as words, for CSV."""
    import pyarrow as pa  # noqa: PLC0415

    place = table.schema.get_field_index('status')
    return table.set_column(place, 'status', table['status'].cast(pa.string()))


def _row_groups(metadata: Any) -> Iterator[list[int]]:
    """Yield consecutive row groups that together have at least `_ROWS` rows."""
    groups: list[int] = []
    rows = 0
    for i in range(metadata.num_row_groups):
        groups.append(i)
        rows += metadata.row_group(i).num_rows
        if rows >= _ROWS or i == metadata.num_row_groups - 1:
            yield groups
            groups, rows = [], 0


def _numbers(batch: 'pa.Table | pa.RecordBatch', names: Sequence[str]) -> Columns:
    import pyarrow as pa  # noqa: PLC0415

    columns: Columns = {}
    for name in names:
        column = batch.column(batch.schema.get_field_index(name))
        if name == 'status':
            words = np.asarray(column.cast(pa.string()).to_pylist(), dtype=str)
            columns[name] = sum(
                (i * (words == word) for i, word in enumerate(STATUS)), np.zeros(len(words), int)
            )
        else:
            columns[name] = np.asarray(column)
    return columns


def _metadata(study: Study) -> dict[bytes, bytes]:
    return {METADATA_KEY: json.dumps(study_document(study)).encode()}
