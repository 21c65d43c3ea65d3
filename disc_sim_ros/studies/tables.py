"""Flights as tables: Parquet and CSV, written and read in pieces so that memory stays flat."""

from collections.abc import Iterator, Sequence
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.studies.columns import STATUS
from disc_sim_ros.studies.study import Study, study_document

if TYPE_CHECKING:
    import pyarrow as pa


Columns = dict[str, NDArray[Any]]
SUFFIXES = ('.parquet', '.csv')
METADATA_KEY = b'disc_sim_ros'
_ROWS = 65536  # read at a time


def parquet_bytes(columns: Columns) -> bytes:
    """Return flights as the bytes of a Parquet file of one row group."""
    import pyarrow as pa  # noqa: PLC0415 - takes a quarter of a second
    from pyarrow import parquet  # noqa: PLC0415

    table = _arrow(columns)
    sink = pa.BufferOutputStream()
    parquet.write_table(table, sink, compression='zstd', row_group_size=max(len(table), 1))
    content: bytes = sink.getvalue().to_pybytes()
    return content


def join(parts: Sequence[Path], target: Path, suffix: str, question: Study) -> None:
    """Write the flights of `parts` to one file, a part at a time.

    Args:
        parts: Parquet files, in order.
        target: What to write.
        suffix: '.parquet' (one row group for each part) or '.csv' (one header line).
        question: Goes into the metadata of Parquet; beside a CSV file, into a file NAME.json.

    Raises:
        OSError: The system refuses.
    """
    from pyarrow import csv, parquet  # noqa: PLC0415

    with target.open('wb') as file:
        if suffix == '.csv':
            file.write((','.join(parquet.read_schema(parts[0]).names) + '\n').encode())
            options = csv.WriteOptions(include_header=False, quoting_style='none')
            for path in parts:
                csv.write_csv(_plain(parquet.read_table(path)), file, options)
        else:
            schema = parquet.read_schema(parts[0]).with_metadata(_metadata(question))
            with parquet.ParquetWriter(file, schema, compression='zstd') as writer:
                for path in parts:
                    table = parquet.read_table(path)
                    writer.write_table(table, row_group_size=len(table))
        file.flush()
        os.fsync(file.fileno())
    if suffix == '.csv':
        text = json.dumps(study_document(question), indent=1)
        sidecar(target.with_name(target.name.removesuffix('.joining'))).write_text(
            text, encoding='utf-8'
        )


def chunks(path: Path, names: Sequence[str]) -> Iterator[Columns]:
    """Yield the flights of a file, some thousand at a time: the columns of `names`.

    `status` comes as numbers, an index of `quantities.STATUS`.
    """
    if path.suffix.lower() == '.csv':
        from pyarrow import csv  # noqa: PLC0415

        options = csv.ConvertOptions(include_columns=list(names))
        with csv.open_csv(path, convert_options=options) as reader:
            for batch in reader:
                yield _numbers(batch, names)
        return
    from pyarrow import parquet  # noqa: PLC0415

    with parquet.ParquetFile(path) as file:
        # Not iter_batches, which keeps in memory what it has read.
        for groups in _row_groups(file.metadata):
            yield _numbers(file.read_row_groups(groups, columns=list(names)), names)


def stored_study(path: Path) -> dict[str, Any] | None:
    """Return the document of the question that a finished file answers; None if it has none."""
    try:
        if path.suffix.lower() == '.csv':
            text: bytes | None = sidecar(path).read_bytes()
        else:
            from pyarrow import parquet  # noqa: PLC0415

            text = (parquet.read_schema(path).metadata or {}).get(METADATA_KEY)
        found: dict[str, Any] | None = json.loads(text) if text else None
    except (OSError, ValueError):  # pyarrow.ArrowInvalid is a ValueError
        return None
    return found


def sidecar(path: Path) -> Path:
    """Return the file beside a CSV file that holds its question."""
    return path.with_name(f'{path.name}.json')


def rows_of(path: Path) -> int:
    """Return how many flights a Parquet file holds; -1 for one that is damaged."""
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
    """Return a table with the status in words, as CSV needs it."""
    import pyarrow as pa  # noqa: PLC0415

    place = table.schema.get_field_index('status')
    return table.set_column(place, 'status', table['status'].cast(pa.string()))


def _row_groups(metadata: Any) -> Iterator[list[int]]:
    """Yield the row groups of a file, as many at a time as make up some thousand rows."""
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

    found: Columns = {}
    for name in names:
        column = batch.column(batch.schema.get_field_index(name))
        if name == 'status':
            words = np.asarray(column.cast(pa.string()).to_pylist(), dtype=str)
            found[name] = sum(
                (i * (words == word) for i, word in enumerate(STATUS)), np.zeros(len(words), int)
            )
        else:
            found[name] = np.asarray(column)
    return found


def _metadata(question: Study) -> dict[bytes, bytes]:
    return {METADATA_KEY: json.dumps(study_document(question)).encode()}
