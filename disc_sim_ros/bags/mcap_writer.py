"""One MCAP file as rosbag2 writes it: chunks, indexes, summary.

The records are those of the `mcap` package. Its `Writer` is not used: it counts what it is about
to write, so that after a full disk its index would list chunks that are not there.
"""

from collections.abc import Callable, Iterable
from pathlib import Path
import struct
import time
import zlib

import lz4.frame  # type: ignore[import-untyped]
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Statistics,
    SummaryOffset,
)
from mcap.writer import LIBRARY_IDENTIFIER, MCAP0_MAGIC
import zstandard

from disc_sim_ros import __version__, files
from disc_sim_ros.bags.definitions import Definition, record_bytes
from disc_sim_ros.errors import BagError

CHUNK_SIZE = 768 * 1024  # bytes before compression, as the C++ library
ZSTD_LEVEL = 1  # as the C++ library; 3, that of mcap.Writer, saves nothing with Odometry
COMPRESSIONS = ('zstd', 'lz4', 'none')
_MESSAGE = struct.Struct('<BQHIQQ').pack  # opcode, length, channel, sequence, log, publish time
_MESSAGE_OPCODE = int(Opcode.MESSAGE)
_MESSAGE_FIELDS = 22  # bytes of a message record before its data
_FOOTER = struct.Struct('<BQQQ').pack


class McapFile:
    """An MCAP file that is being written; it counts only what the system took."""

    def __init__(self, path: Path, compression: str, profile: str = 'ros2') -> None:
        """Make the file and write its header.

        Args:
            path: Must not exist.
            compression: Of the chunks: one of `COMPRESSIONS`.
            profile: Of the header.

        Raises:
            OSError: The system refuses.
        """
        self.counts: dict[int, int] = {}  # channel id: messages written
        self.start = 0  # least log time written [ns]
        self.end = 0  # greatest
        self.duration = 0  # of the chunks written, added up [ns]
        self.finished = False  # it has its end
        self._compress = _compressor(compression)
        self._compression = '' if compression == 'none' else compression
        self._defined: dict[int, Definition] = {}
        self._chunk = bytearray()
        self._index: dict[int, list[int]] = {}  # channel id: log time, offset, log time, ...
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._new: list[int] = []  # channels first defined in the open chunk
        self._recent: set[int] = set()  # channels defined since the last doubling of the chunks
        self._file = files.GrowingFile(path)
        try:
            header = Header(profile, f'disc_sim_ros {__version__}, {LIBRARY_IDENTIFIER}')
            self._file.append(MCAP0_MAGIC + record_bytes(header))
        except OSError:
            self._file.close()
            path.unlink(missing_ok=True)
            raise

    @property
    def path(self) -> Path:
        """Where the file is."""
        return self._file.path

    @property
    def size(self) -> int:
        """Bytes written."""
        return self._file.size

    @property
    def pending_messages(self) -> int:
        """Messages in the open chunk."""
        return sum(len(index) for index in self._index.values()) // 2

    def pending_of(self, channel_id: int) -> int:
        """Return how many messages of one channel the open chunk has."""
        return len(self._index.get(channel_id, ())) // 2

    @property
    def message_count(self) -> int:
        """Messages written, without the open chunk."""
        return sum(self.counts.values())

    def closing_size(self, definitions: int) -> int:
        """Return the bytes that the end of the file may take, without the metadata record.

        Args:
            definitions: Bytes of all definitions of the bag, which the data section and the
                summary may need.
        """
        per_chunk = 128 + 10 * len(self._defined)
        named = 256 * (len(self._metadata) + len(self._attachments))
        return 2 * definitions + per_chunk * (len(self._chunks) + 2) + named + 4096

    def write(
        self,
        definition: Definition,
        data: bytes,
        log_time: int,
        publish_time: int,
        sequence: int,
    ) -> int:
        """Add a message to the open chunk and return the size of the chunk.

        Raises:
            struct.error: A time is not from 0 to 2^64 - 1.
        """
        channel_id = definition.channel.id
        size = _MESSAGE_FIELDS + len(data)
        record = (
            _MESSAGE(_MESSAGE_OPCODE, size, channel_id, sequence, log_time, publish_time) + data
        )
        chunk = self._chunk
        index = self._index.get(channel_id)
        if index is None:
            index = self._index[channel_id] = []
            self._define(definition)
        index += (log_time, len(chunk))
        chunk += record
        return len(chunk)

    def end_chunk(self) -> None:
        """Write the open chunk and its message indexes; without messages nothing.

        Raises:
            OSError: The system refuses; the chunk is still open.
        """
        if self._index:
            self._append_chunk(self._chunk, self._index)
            self._new = []
            self._chunk, self._index = bytearray(), {}
            if len(self._chunks).bit_count() == 1:
                # Definitions are repeated in the chunk after the 1st, 2nd, 4th, 8th, ...: else a
                # file without its end could not be read once its first chunk is damaged.
                self._recent.clear()

    def drop_chunk(self) -> int:
        """Discard the open chunk; return how many messages it had."""
        dropped = self.pending_messages
        for channel_id in self._new:  # to be defined again in the next chunk
            del self._defined[channel_id]
        self._recent.clear()
        self._new = []
        self._chunk, self._index = bytearray(), {}
        return dropped

    def defines(self, channel_id: int) -> bool:
        """Return True if the file or its open chunk has the definition of a channel."""
        return channel_id in self._defined

    def define(self, definitions: Iterable[Definition]) -> None:
        """Write definitions that the file does not have yet, as of topics without messages.

        Raises:
            OSError: The system refuses.
        """
        schemas = {d.schema.id for d in self._defined.values() if d.schema is not None}
        for definition in definitions:
            if definition.channel.id in self._defined:
                continue
            schema, packed = definition.schema, definition.packed
            if schema is not None and schema.id in schemas:
                packed = record_bytes(definition.channel)
            elif schema is not None:
                schemas.add(schema.id)
            self._file.append(packed)
            self._defined[definition.channel.id] = definition

    def add_record(self, packed: bytes) -> None:
        """Write a record of another program as it is.

        Raises:
            OSError: The system refuses.
        """
        self._file.append(packed)

    def add_metadata(self, name: str, data: dict[str, str]) -> None:
        """Write a metadata record.

        Raises:
            OSError: The system refuses.
        """
        record = record_bytes(Metadata(name=name, metadata=data))
        offset = self._file.size
        self._file.append(record)
        self._metadata.append(MetadataIndex(offset=offset, length=len(record), name=name))

    def add_attachment(self, attachment: Attachment) -> None:
        """Write an attachment record.

        Raises:
            OSError: The system refuses.
        """
        record = record_bytes(attachment)
        offset = self._file.size
        self._file.append(record)
        self._attachments.append(
            AttachmentIndex(
                offset=offset,
                length=len(record),
                log_time=attachment.log_time,
                create_time=attachment.create_time,
                data_size=len(attachment.data),
                name=attachment.name,
                media_type=attachment.media_type,
            )
        )

    def sync(self) -> None:
        """Wait until the disk has what was written."""
        self._file.sync()

    def finish(self) -> None:
        """Write the end: the summary with the index of all that was written.

        Raises:
            OSError: The system refuses; the file has no end but holds all that it held.
        """
        data_end = record_bytes(DataEnd(0))  # as rosbag2: no checksum of the whole
        summary_start = self._file.size + len(data_end)
        summary = bytearray()
        offsets = []
        for opcode, records in self._summary():
            start = len(summary)
            for record in records:
                summary += record_bytes(record)
            if records:
                offsets.append(SummaryOffset(opcode, summary_start + start, len(summary) - start))
        offset_start = summary_start + len(summary)
        for offset in offsets:
            summary += record_bytes(offset)
        crc = zlib.crc32(_FOOTER(int(Opcode.FOOTER), 20, summary_start, offset_start),
                         zlib.crc32(summary))  # fmt: skip
        footer = record_bytes(Footer(summary_start, offset_start, crc))
        self._file.append(data_end + summary + footer + MCAP0_MAGIC)
        self.finished = True

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        self._file.close()

    def _define(self, definition: Definition) -> None:
        """Write a channel and its schema into the open chunk, if no recent chunk has them."""
        channel_id = definition.channel.id
        if channel_id in self._recent:
            return
        self._recent.add(channel_id)
        if channel_id not in self._defined:
            self._new.append(channel_id)
        known = self._defined.setdefault(channel_id, definition)  # may not change in a file
        self._chunk += known.packed

    def _append_chunk(self, plain: bytearray, indexes: dict[int, list[int]]) -> None:
        start = min(min(index[::2]) for index in indexes.values())
        end = max(max(index[::2]) for index in indexes.values())
        data = self._compress(plain)
        record = record_bytes(
            Chunk(
                compression=self._compression,
                data=data,
                message_end_time=end,
                message_start_time=start,
                uncompressed_crc=zlib.crc32(plain),
                uncompressed_size=len(plain),
            )
        )
        offset = self._file.size
        places = {}
        tail = bytearray()
        for channel_id, index in indexes.items():
            places[channel_id] = offset + len(record) + len(tail)
            size = 8 * len(index)
            tail += struct.pack('<BQHI', int(Opcode.MESSAGE_INDEX), 6 + size, channel_id, size)
            tail += struct.pack(f'<{len(index)}Q', *index)
        self._file.append(record + tail)
        self._chunks.append(
            ChunkIndex(
                chunk_length=len(record),
                chunk_start_offset=offset,
                compression=self._compression,
                compressed_size=len(data),
                message_end_time=end,
                message_index_length=len(tail),
                message_index_offsets=places,
                message_start_time=start,
                uncompressed_size=len(plain),
            )
        )
        self.start = min(self.start, start) if self.counts else start
        self.end = max(self.end, end)
        self.duration += end - start
        for channel_id, index in indexes.items():
            self.counts[channel_id] = self.counts.get(channel_id, 0) + len(index) // 2

    def _summary(self) -> list[tuple[int, list[McapRecord]]]:
        schemas = {d.schema.id: d.schema for d in self._defined.values() if d.schema}
        statistics = Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._defined),
            channel_message_counts=self.counts,
            chunk_count=len(self._chunks),
            message_count=self.message_count,
            message_end_time=self.end,
            message_start_time=self.start,
            metadata_count=len(self._metadata),
            schema_count=len(schemas),
        )
        return [
            (int(Opcode.SCHEMA), list(schemas.values())),
            (int(Opcode.CHANNEL), [d.channel for d in self._defined.values()]),
            (int(Opcode.STATISTICS), [statistics]),
            (int(Opcode.CHUNK_INDEX), list(self._chunks)),
            (int(Opcode.ATTACHMENT_INDEX), list(self._attachments)),
            (int(Opcode.METADATA_INDEX), list(self._metadata)),
        ]


def new_attachment(
    name: str, media_type: str, data: bytes, log_time: int | None, create_time: int | None
) -> Attachment:
    """Return an attachment; a time [ns] that is None is now."""
    now = time.time_ns()
    return Attachment(
        create_time=now if create_time is None else create_time,
        log_time=now if log_time is None else log_time,
        name=name,
        media_type=media_type,
        data=data,
    )


def _compressor(compression: str) -> Callable[[bytes | bytearray], bytes]:
    if compression == 'zstd':
        return zstandard.ZstdCompressor(level=ZSTD_LEVEL).compress
    if compression == 'lz4':
        return lz4.frame.compress  # type: ignore[no-any-return]
    if compression == 'none':
        return bytes
    raise BagError(f'compression {compression!r} is unknown; known are {", ".join(COMPRESSIONS)}')
