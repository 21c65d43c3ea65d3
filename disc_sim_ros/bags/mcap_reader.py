"""The index at the end of an MCAP file."""

from pathlib import Path
import struct
from typing import BinaryIO
import zlib

from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from disc_sim_ros.bags.mcap_records import HEAD, MAGIC, Chunk, Contents, parsed, records
from disc_sim_ros.errors import DamageError

_FOOTER = struct.Struct('<BQQQI')  # opcode, length, start of summary, of offsets, checksum
_TAIL = _FOOTER.size + len(MAGIC)
_KINDS = {
    int(Opcode.SCHEMA): Schema,
    int(Opcode.CHANNEL): Channel,
    int(Opcode.STATISTICS): Statistics,
    int(Opcode.CHUNK_INDEX): ChunkIndex,
    int(Opcode.ATTACHMENT_INDEX): AttachmentIndex,
    int(Opcode.METADATA_INDEX): MetadataIndex,
}


def indexed(path: Path) -> Contents | None:
    """Return what a file holds by its index, or None where it has none that can be trusted.

    Raises:
        OSError: It cannot be read.
    """
    with path.open('rb') as file:
        try:
            return _contents(path, file)
        except DamageError:
            return None


def _contents(path: Path, file: BinaryIO) -> Contents | None:
    size = file.seek(0, 2)
    summary = _summary(file, size)
    if summary is None:
        return None
    contents = Contents(path, complete=True)
    statistics: Statistics | None = None
    for opcode, at, length in records(summary):
        if opcode not in _KINDS:
            continue
        record = parsed(_KINDS[opcode], summary[at : at + length])
        match record:
            case Schema():
                contents.schemas[record.id] = record
            case Channel():
                contents.channels[record.id] = record
            case Statistics():
                statistics = record
            case ChunkIndex():
                contents.pieces.append(_piece(record, size))
            case AttachmentIndex():
                contents.attachments.append(record.offset)
            case MetadataIndex():
                contents.metadata.append(_metadata(file, record))
    if statistics is None or (statistics.message_count and not contents.pieces):
        return None
    contents.counts = dict(statistics.channel_message_counts)
    if any(
        c.schema_id and c.schema_id not in contents.schemas for c in contents.channels.values()
    ):
        return None
    return contents if contents.counts.keys() <= contents.channels.keys() else None


def _summary(file: BinaryIO, size: int) -> bytes | None:
    if size < len(MAGIC) + _TAIL:
        return None
    file.seek(0)
    if file.read(len(MAGIC)) != MAGIC:
        return None
    file.seek(size - _TAIL)
    tail = file.read(_TAIL)
    opcode, length, start, _, crc = _FOOTER.unpack_from(tail)
    if opcode != Opcode.FOOTER or length != _FOOTER.size - HEAD.size or tail[-8:] != MAGIC:
        return None
    if not len(MAGIC) < start <= size - _TAIL:
        return None
    file.seek(start)
    summary = file.read(size - _TAIL - start)
    if crc and zlib.crc32(tail[: _FOOTER.size - 4], zlib.crc32(summary)) != crc:
        return None
    return summary


def _piece(record: ChunkIndex, size: int) -> Chunk:
    if record.chunk_start_offset + record.chunk_length > size or record.chunk_length < HEAD.size:
        raise DamageError('the index tells of a chunk beyond the end')
    channels = frozenset(record.message_index_offsets) if record.message_index_offsets else None
    return Chunk(
        record.chunk_start_offset,
        record.chunk_length,
        record.message_start_time,
        record.message_end_time,
        channels,
    )


def _metadata(file: BinaryIO, index: MetadataIndex) -> Metadata:
    file.seek(index.offset)
    content = file.read(min(index.length, 1 << 28))
    if not content or content[0] != Opcode.METADATA:
        raise DamageError('there is no metadata where the index says')
    record = parsed(Metadata, content[HEAD.size :])
    assert isinstance(record, Metadata)  # noqa: S101 - for mypy
    return record
