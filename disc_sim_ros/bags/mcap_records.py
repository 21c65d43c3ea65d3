"""What an MCAP file holds, found by its index or, without one, by reading it all."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
import struct
from typing import BinaryIO, NamedTuple
import zlib

import lz4.frame  # type: ignore[import-untyped]
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, McapRecord, Metadata, Schema
import zstandard

from disc_sim_ros.errors import DamageError

MAGIC = b'\x89MCAP0\r\n'
HEAD = struct.Struct('<BQ')  # opcode and length of a record
_MESSAGE = struct.Struct('<HIQQ')  # channel, sequence, log time, publish time
_CHUNK = struct.Struct('<QQQI')  # start, end, plain size, checksum
_CHUNK_FIELDS = 40  # bytes of a chunk record beside the name of its compression and the data
_COMPRESSIONS = (b'', b'zstd', b'lz4')
_MOST_PLAIN = 1 << 32  # bytes of a chunk, a bound against damaged sizes


class Stored(NamedTuple):
    """A message as it is stored."""

    channel_id: int
    sequence: int
    log_time: int  # ns
    publish_time: int  # ns
    data: bytes


@dataclass(frozen=True, slots=True)
class Chunk:
    """A part of a file that holds messages: the content of a chunk, or records outside of one."""

    offset: int  # of the chunk record, or of the first record
    length: int  # with the head of the record
    start: int  # least log time [ns]
    end: int
    channels: frozenset[int] | None  # those with messages; None: not known
    chunk: bool = True
    cut: bool = False  # the end is missing


@dataclass(frozen=True, slots=True)
class Loss:
    """Bytes of a file that say nothing any more."""

    path: Path
    offset: int
    length: int
    reason: str
    messages: int | None = None  # None: not known

    def __str__(self) -> str:
        count = '' if self.messages is None else f', {self.messages} messages'
        return (
            f'{self.path.name}: {self.length} bytes from byte {self.offset}{count}: {self.reason}'
        )


@dataclass(slots=True)
class Contents:
    """What one file holds. Times are log times [ns]."""

    path: Path
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    pieces: list[Chunk] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)  # messages by channel id
    attachments: list[int] = field(default_factory=list)  # offsets
    metadata: list[Metadata] = field(default_factory=list)
    losses: list[Loss] = field(default_factory=list)
    complete: bool = False  # it has its end, and nothing was seen to be damaged

    @property
    def message_count(self) -> int:
        """Messages of all channels."""
        return sum(self.counts.values())


def parsed(kind: type[McapRecord], content: bytes) -> McapRecord:
    """Return a record of a kind that has a `read` of one argument.

    Raises:
        DamageError: The content is no such record.
    """
    try:
        return kind.read(ReadDataStream(BytesIO(content)))  # type: ignore[attr-defined, no-any-return]
    except (EndOfFile, UnicodeDecodeError, struct.error, MemoryError, OverflowError) as error:
        raise DamageError(f'no {kind.__name__} record ({type(error).__name__})') from None


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, offset and length of the content of each record in plain data.

    Raises:
        DamageError: The last record is not whole.
    """
    at, end = 0, len(data)
    while at + HEAD.size <= end:
        opcode, length = HEAD.unpack_from(data, at)
        at += HEAD.size
        if length > end - at:
            raise DamageError('a record is cut off')
        yield opcode, at, length
        at += length
    if at != end:
        raise DamageError('a record is cut off')


def messages(data: bytes, wanted: frozenset[int] | None = None) -> Iterator[Stored]:
    """Yield the messages in plain data.

    Raises:
        DamageError: The last record is not whole.
    """
    for opcode, at, length in records(data):
        if opcode == Opcode.MESSAGE:
            if length < _MESSAGE.size:
                raise DamageError('a message is too short')
            fields = _MESSAGE.unpack_from(data, at)
            if wanted is None or fields[0] in wanted:
                channel_id, sequence, log_time, publish_time = fields
                payload = data[at + _MESSAGE.size : at + length]
                yield Stored(channel_id, sequence, log_time, publish_time, payload)


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """The beginning of a chunk record."""

    plain_size: int
    crc: int
    compression: bytes
    data_at: int  # in the content of the record
    data_size: int

    @classmethod
    def of(cls, content: bytes, length: int) -> 'ChunkHead':
        """Read the beginning of a record with content of `length` bytes.

        Raises:
            DamageError: The lengths that it states disagree.
        """
        try:
            _, _, plain_size, crc = _CHUNK.unpack_from(content, 0)
            (name_size,) = struct.unpack_from('<I', content, _CHUNK.size)
            name = content[_CHUNK.size + 4 : _CHUNK.size + 4 + min(name_size, 8)]
            (data_size,) = struct.unpack_from('<Q', content, _CHUNK.size + 4 + len(name))
        except struct.error:
            raise DamageError('a chunk is cut off') from None
        if name not in _COMPRESSIONS or length != _CHUNK_FIELDS + len(name) + data_size:
            raise DamageError('a chunk states lengths that disagree')
        return cls(plain_size, crc, name, _CHUNK_FIELDS + len(name), data_size)


def chunk_data(content: bytes) -> bytes:
    """Return the plain data of a whole chunk record.

    Raises:
        DamageError: It cannot be decompressed, or is not what its checksum says.
    """
    head = ChunkHead.of(content, len(content))
    plain = _decompress(head, content[head.data_at :])
    if len(plain) != head.plain_size:
        raise DamageError('a chunk is shorter than it says')
    if head.crc and zlib.crc32(plain) != head.crc:
        raise DamageError('the checksum of a chunk disagrees')
    return plain


def cut_chunk_data(content: bytes) -> bytes:
    """Return the whole records at the beginning of a chunk record that is cut off."""
    try:
        (length,) = struct.unpack_from('<Q', content, 1)
        head = ChunkHead.of(content[HEAD.size :], length)
        plain = _decompress(head, content[HEAD.size + head.data_at :])
    except (DamageError, struct.error):
        return b''
    return whole_records(plain)


def whole_records(data: bytes) -> bytes:
    """Return the beginning of plain data up to the end of its last whole record."""
    end = 0
    try:
        for _, at, length in records(data):
            end = at + length
    except DamageError:
        pass
    return data[:end]


def chunk_bytes(file: BinaryIO, piece: Chunk) -> bytes:
    """Return the plain data of a piece of an open file.

    Raises:
        DamageError: It is damaged.
        OSError: It cannot be read.
    """
    file.seek(piece.offset)
    stored = file.read(piece.length)
    if len(stored) < piece.length:
        raise DamageError('the file ends early')
    if not piece.chunk:
        return stored
    if piece.cut:
        return cut_chunk_data(stored)
    if stored[0] != Opcode.CHUNK:
        raise DamageError('there is no chunk where the index says')
    return chunk_data(stored[HEAD.size :])


def attachment_at(file: BinaryIO, offset: int) -> Attachment:
    """Return an attachment of an open file.

    Raises:
        DamageError: It is damaged.
        OSError: It cannot be read.
    """
    file.seek(offset)
    head = file.read(HEAD.size)
    if len(head) < HEAD.size or head[0] != Opcode.ATTACHMENT:
        raise DamageError('there is no attachment where the index says')
    return parsed_attachment(file.read(HEAD.unpack(head)[1]))


def parsed_attachment(content: bytes) -> Attachment:
    """Return an attachment whose checksum agrees.

    Raises:
        DamageError: It does not.
    """
    crc = int.from_bytes(content[-4:], 'little')
    if crc and zlib.crc32(content[:-4]) != crc:
        raise DamageError('the checksum of an attachment disagrees')
    record = parsed(Attachment, content)
    assert isinstance(record, Attachment)  # noqa: S101 - for mypy
    return record


def _decompress(head: ChunkHead, data: bytes) -> bytes:
    """Return what comes out of the data of a chunk, all of it or its beginning."""
    if head.plain_size > _MOST_PLAIN:
        raise DamageError('a chunk states a size that cannot be')
    try:
        if head.compression == b'zstd':
            return zstandard.ZstdDecompressor().decompressobj().decompress(data)
        if head.compression == b'lz4':
            plain = lz4.frame.LZ4FrameDecompressor().decompress(data)
            return bytes(plain)
    except (zstandard.ZstdError, RuntimeError, MemoryError, ValueError) as error:
        raise DamageError(f'a chunk cannot be decompressed ({error})') from None
    return data
