"""One MCAP file as rosbag2 writes it: chunks, indexes, summary.

The records are those of the `mcap` package. Its `Writer` is not used: it counts what it is about
to write, so that after a full disk its index would tell of chunks that are not there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
import struct
import time
import zlib

import lz4.frame  # type: ignore[import-untyped]
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import LIBRARY_IDENTIFIER, MCAP0_MAGIC
import zstandard

from disc_sim_ros import __version__, files
from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.topic import Topic, qos_yaml
from disc_sim_ros.errors import BagError

CHUNK_SIZE = 768 * 1024  # bytes before compression, as the C++ library
ZSTD_LEVEL = 1  # as the C++ library; 3, that of mcap.Writer, saves nothing with Odometry
COMPRESSIONS = ('zstd', 'lz4', 'none')
_MESSAGE = struct.Struct('<BQHIQQ').pack  # opcode, length, channel, sequence, log, publish time
_MESSAGE_OPCODE = int(Opcode.MESSAGE)
_MESSAGE_FIELDS = 22  # bytes of a message record before its data
_FOOTER = struct.Struct('<BQQQ').pack


@dataclass(frozen=True, slots=True)
class Definition:
    """A channel and its schema, ready to be written into any file of the bag."""

    channel: Channel
    schema: Schema
    packed: bytes  # the records, schema first

    @classmethod
    def of(cls, topic: Topic, channel_id: int, schema_id: int) -> 'Definition':
        """Return the records of a topic."""
        # Only of a message without fields is '' the definition.
        found = topic.definition or schemas.definition(topic.type) == ''
        channel = Channel(
            id=channel_id,
            topic=topic.name,
            message_encoding=topic.serialization_format,
            metadata={
                'offered_qos_profiles': qos_yaml(topic.qos),
                'topic_type_hash': topic.type_hash,
                **dict(topic.extra),
            },
            schema_id=schema_id,
        )
        schema = Schema(
            id=schema_id,
            name=topic.type,
            encoding=topic.definition_encoding if found else 'unknown',  # rosbag2's word
            data=topic.definition.encode(errors='surrogateescape'),
        )
        return cls(channel, schema, _bytes_of(schema) + _bytes_of(channel))


class McapFile:
    """An MCAP file in the making; only what the system took is counted."""

    def __init__(self, path: Path, compression: str) -> None:
        """Make the file and write its header.

        Raises:
            OSError: The system refuses.
        """
        self.counts: dict[int, int] = {}  # channel id: messages written
        self.start = 0  # least log time written [ns]
        self.end = 0  # greatest
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
        self._near: set[int] = set()  # channels defined since the last doubling of the chunks
        self._file = files.GrowingFile(path)
        try:
            header = Header('ros2', f'disc_sim_ros {__version__}, {LIBRARY_IDENTIFIER}')
            self._file.append(MCAP0_MAGIC + _bytes_of(header))
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
        """Return the bytes that the end of the file may take, beside the metadata record.

        Args:
            definitions: Bytes of all definitions of the bag.
        """
        per_chunk = 128 + 10 * len(self._defined)
        named = 256 * (len(self._metadata) + len(self._attachments))
        return definitions + per_chunk * (len(self._chunks) + 2) + named + 4096

    def write(
        self,
        definition: Definition,
        data: bytes,
        log_time: int,
        publish_time: int,
        sequence: int,
    ) -> int:
        """Add a message to the open chunk and return the size of that.

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
                # Definitions come again in the chunk after the 1st, 2nd, 4th, 8th, ...: without
                # its end a file would be worth nothing once its first chunk is damaged.
                self._near.clear()

    def drop_chunk(self) -> int:
        """Forget the open chunk; return how many messages that costs."""
        dropped = self.pending_messages
        for channel_id in self._new:  # to be defined again in the next chunk
            del self._defined[channel_id]
        self._near.clear()
        self._new = []
        self._chunk, self._index = bytearray(), {}
        return dropped

    def add_metadata(self, name: str, data: dict[str, str]) -> None:
        """Write a metadata record.

        Raises:
            OSError: The system refuses.
        """
        record = _bytes_of(Metadata(name=name, metadata=data))
        offset = self._file.size
        self._file.append(record)
        self._metadata.append(MetadataIndex(offset=offset, length=len(record), name=name))

    def add_attachment(self, attachment: Attachment) -> None:
        """Write an attachment record.

        Raises:
            OSError: The system refuses.
        """
        record = _bytes_of(attachment)
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

    def finish(self, others: Sequence[Definition] = ()) -> None:
        """Write the end: the index of all that was written, and channels without messages.

        Raises:
            OSError: The system refuses; the file has no end but holds all it held.
        """
        for definition in others:
            self._defined.setdefault(definition.channel.id, definition)
        data_end = _bytes_of(DataEnd(0))  # as rosbag2: no checksum of the whole
        summary_start = self._file.size + len(data_end)
        summary = bytearray()
        offsets = []
        for opcode, records in self._summary():
            start = len(summary)
            for record in records:
                summary += _bytes_of(record)
            if records:
                offsets.append(SummaryOffset(opcode, summary_start + start, len(summary) - start))
        offset_start = summary_start + len(summary)
        for offset in offsets:
            summary += _bytes_of(offset)
        crc = zlib.crc32(_FOOTER(int(Opcode.FOOTER), 20, summary_start, offset_start),
                         zlib.crc32(summary))  # fmt: skip
        footer = _bytes_of(Footer(summary_start, offset_start, crc))
        self._file.append(data_end + summary + footer + MCAP0_MAGIC)
        self.finished = True

    def close(self) -> None:
        """Close the file; again does nothing."""
        self._file.close()

    def _define(self, definition: Definition) -> None:
        """Write a channel and its schema into the open chunk, if they are not near already."""
        channel_id = definition.channel.id
        if channel_id in self._near:
            return
        self._near.add(channel_id)
        if channel_id not in self._defined:
            self._new.append(channel_id)
        known = self._defined.setdefault(channel_id, definition)  # may not change in a file
        self._chunk += known.packed

    def _append_chunk(self, plain: bytearray, indexes: dict[int, list[int]]) -> None:
        start = min(min(index[::2]) for index in indexes.values())
        end = max(max(index[::2]) for index in indexes.values())
        data = self._compress(plain)
        record = _bytes_of(
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
        for channel_id, index in indexes.items():
            self.counts[channel_id] = self.counts.get(channel_id, 0) + len(index) // 2

    def _summary(self) -> list[tuple[int, list[McapRecord]]]:
        schemas = {d.schema.id: d.schema for d in self._defined.values()}
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
    """Return an attachment; without times it is of now."""
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


def _bytes_of(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]
