"""The index at the end of an MCAP file: what the file holds without reading all of it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
import struct
from typing import BinaryIO
import zlib

from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from disc_sim_ros.bags.contents import Chunk, Contents
from disc_sim_ros.bags.mcap_records import HEAD, MAGIC, parsed, records
from disc_sim_ros.errors import DamageError

_FOOTER = struct.Struct('<BQQQI')  # opcode, length, start of summary, of offsets, checksum
_TAIL = _FOOTER.size + len(MAGIC)
_INDEX = struct.Struct('<HI')  # of a message index: channel, bytes of its entries
_ENTRY_SIZE = 16  # bytes
_DATA_END_SIZE = HEAD.size + 4
_LARGEST_METADATA = 1 << 28  # bytes
_FIRST_PRIVATE = 0x80  # opcode
_KINDS: dict[int, type[McapRecord]] = {
    int(Opcode.SCHEMA): Schema,
    int(Opcode.CHANNEL): Channel,
    int(Opcode.STATISTICS): Statistics,
    int(Opcode.CHUNK_INDEX): ChunkIndex,
    int(Opcode.ATTACHMENT_INDEX): AttachmentIndex,
    int(Opcode.METADATA_INDEX): MetadataIndex,
}


def indexed(path: Path, unpacked: Path | None = None) -> Contents | None:
    """Return what a file holds by its index; None if no index covers all of it.

    Args:
        path: The file.
        unpacked: Where its plain bytes are, if it is compressed as a whole.

    Raises:
        OSError: It cannot be read.
    """
    contents = Contents(path, unpacked)
    with contents.data_path.open('rb') as file:
        try:
            return contents if _Index(file).fill(contents) else None
        except DamageError:
            return None


@dataclass(slots=True)
class _Summary:
    """The records of the summary section, and where they begin."""

    at: int
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    statistics: Statistics | None = None
    chunks: list[ChunkIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)

    def covers_everything(self) -> bool:
        """Return True if nothing that the statistics count is without an entry."""
        s = self.statistics
        if s is None:
            return False
        return (
            s.message_count == sum(s.channel_message_counts.values())
            and s.chunk_count == len(self.chunks)
            and s.attachment_count == len(self.attachments)
            and s.metadata_count == len(self.metadata)
            and s.channel_count <= len(self.channels)  # the C++ library does not count silent ones
            and s.channel_message_counts.keys() <= self.channels.keys()
            and all(
                c.schema_id == 0 or c.schema_id in self.schemas for c in self.channels.values()
            )
        )


class _Index:
    """Reads the summary of one file and compares it with the data section."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._size = file.seek(0, 2)

    def fill(self, contents: Contents) -> bool:
        """Put in what the index lists; return False if it does not cover everything.

        Raises:
            DamageError: The index or a record in the data section is no such record.
        """
        summary = self._summary()
        if summary is None or not summary.covers_everything():
            return False
        if not self._walk(summary, contents) or not self._counts_agree(summary):
            return False
        contents.schemas, contents.channels = summary.schemas, summary.channels
        contents.chunks = [_chunk(c) for c in summary.chunks]
        contents.attachments = [a.offset for a in summary.attachments]
        contents.metadata = [self._metadata(m) for m in summary.metadata]
        assert summary.statistics is not None  # noqa: S101 - for mypy
        contents.counts = dict(summary.statistics.channel_message_counts)
        contents.complete = contents.closed = True
        return True

    def _read(self, at: int, size: int) -> bytes:
        self._file.seek(at)
        return self._file.read(size)

    def _summary(self) -> _Summary | None:
        if self._size < len(MAGIC) + _TAIL or self._read(0, len(MAGIC)) != MAGIC:
            return None
        tail_at = self._size - _TAIL
        tail = self._read(tail_at, _TAIL)
        opcode, length, start, _, crc = _FOOTER.unpack_from(tail)
        if opcode != Opcode.FOOTER or length != _FOOTER.size - HEAD.size:
            return None
        if tail[-len(MAGIC) :] != MAGIC or not len(MAGIC) < start <= tail_at:
            return None
        content = self._read(start, tail_at - start)
        if crc and zlib.crc32(tail[: _FOOTER.size - 4], zlib.crc32(content)) != crc:
            return None
        summary = _Summary(start)
        for kind, at, size in records(content):
            if kind in _KINDS:
                _sort_in(summary, parsed(_KINDS[kind], content[at : at + size]))
        return summary

    def _walk(self, summary: _Summary, contents: Contents) -> bool:
        """Go over the data section from record to record, without reading the chunks.

        Returns:
            False if a message or a chunk is not in the index, or something is not where it says.
        """
        ends = {
            c.chunk_start_offset: c.chunk_start_offset + c.chunk_length + c.message_index_length
            for c in summary.chunks
        }
        ends |= {a.offset: a.offset + a.length for a in summary.attachments}
        ends |= {m.offset: m.offset + m.length for m in summary.metadata}
        at = len(MAGIC)
        while at <= summary.at - _DATA_END_SIZE:
            if at in ends:
                at = _later(at, ends.pop(at))
                continue
            opcode, length = HEAD.unpack(self._read(at, HEAD.size))
            if opcode == Opcode.DATA_END:
                return not ends
            if opcode in {0, Opcode.MESSAGE, Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.METADATA}:
                return False
            if opcode == Opcode.HEADER:
                header = parsed(Header, self._read(at + HEAD.size, min(length, self._size)))
                contents.profile = getattr(header, 'profile', None)
            if opcode >= _FIRST_PRIVATE:
                contents.private.append((at, HEAD.size + length))
            at += HEAD.size + length
        return False

    def _counts_agree(self, summary: _Summary) -> bool:
        """Return False if the message indexes contradict the index of chunks or the statistics.

        By the index of a chunk a reader skips it: a channel that is missing there is not read.
        Chunks without message indexes contradict nothing.
        """
        totals: dict[int, int] = {}
        for chunk in summary.chunks:
            if not chunk.message_index_length:
                if chunk.message_start_time or chunk.message_end_time:
                    return True
                continue
            at = chunk.chunk_start_offset + chunk.chunk_length
            size = min(chunk.message_index_length, self._size)
            for channel_id, count in _index_counts(self._read(at, size)):
                if count and channel_id not in chunk.message_index_offsets:
                    return False
                totals[channel_id] = totals.get(channel_id, 0) + count
        assert summary.statistics is not None  # noqa: S101 - for mypy
        counts = summary.statistics.channel_message_counts
        return all(totals.get(i, 0) == counts.get(i, 0) for i in totals.keys() | counts.keys())

    def _metadata(self, index: MetadataIndex) -> Metadata:
        content = self._read(index.offset, min(index.length, _LARGEST_METADATA))
        if not content or content[0] != Opcode.METADATA:
            raise DamageError('there is no metadata where the index says')
        record = parsed(Metadata, content[HEAD.size :])
        assert isinstance(record, Metadata)  # noqa: S101 - for mypy
        return record


def _index_counts(content: bytes) -> Iterator[tuple[int, int]]:
    """Yield channel and number of entries of each message index."""
    for kind, at, size in records(content):
        if kind == Opcode.MESSAGE_INDEX and size >= _INDEX.size:
            channel_id, entries = _INDEX.unpack_from(content, at)
            yield channel_id, entries // _ENTRY_SIZE


def _sort_in(summary: _Summary, record: McapRecord) -> None:
    match record:
        case Schema():
            summary.schemas[record.id] = record
        case Channel():
            summary.channels[record.id] = record
        case Statistics():
            summary.statistics = record
        case ChunkIndex():
            summary.chunks.append(record)
        case AttachmentIndex():
            summary.attachments.append(record)
        case MetadataIndex():
            summary.metadata.append(record)


def _later(at: int, end: int) -> int:
    if end <= at:
        raise DamageError('the index states a length that cannot be')
    return end


def _chunk(record: ChunkIndex) -> Chunk:
    channels = frozenset(record.message_index_offsets) if record.message_index_offsets else None
    return Chunk(
        record.chunk_start_offset,
        record.chunk_length,
        record.message_start_time,
        record.message_end_time,
        channels,
    )
