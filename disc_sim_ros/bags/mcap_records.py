"""Records of the MCAP format, parsed from bytes: messages, chunks, attachments.

Records may be longer than their fields, all but Message, DataEnd and Footer; what follows the
known fields is ignored, as the specification demands.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
import re
import struct
from typing import NamedTuple
import zlib

import lz4.frame  # type: ignore[import-untyped]
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Attachment, McapRecord
import zstandard

from disc_sim_ros.errors import DamageError

MAGIC = b'\x89MCAP0\r\n'
HEAD = struct.Struct('<BQ')  # opcode and length of a record
ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'  # at the beginning of a frame
LZ4_MAGIC = b'\x04\x22\x4d\x18'
_MESSAGE = struct.Struct('<HIQQ')  # channel, sequence, log time, publish time
_CHUNK = struct.Struct('<QQQI')  # start, end, plain size, checksum
_CHUNK_FIELDS = 40  # bytes of a chunk record beside the name of its compression and the data
COMPRESSION_MAGICS = {b'': b'', b'zstd': ZSTD_MAGIC, b'lz4': LZ4_MAGIC}  # of chunks
_LONGEST_NAME = 16  # bytes of the name of a compression
_LARGEST_CHUNK = 1 << 32  # bytes of plain data, a bound against damaged sizes


class Stored(NamedTuple):
    """A message as it is stored."""

    channel_id: int
    sequence: int
    log_time: int  # ns
    publish_time: int  # ns
    data: bytes


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
    """Yield the messages in plain data, of all channels or of those wanted.

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


def whole_records(data: bytes) -> bytes:
    """Return the beginning of plain data up to the end of its last whole record."""
    end = 0
    try:
        for _, at, length in records(data):
            end = at + length
    except DamageError:
        pass
    return data[:end]


def parsed_attachment(content: bytes) -> Attachment:
    """Return an attachment whose checksum agrees.

    Raises:
        DamageError: It does not.
    """
    record = parsed(Attachment, content)
    assert isinstance(record, Attachment)  # noqa: S101 - for mypy
    sizes = len(record.name.encode()), len(record.media_type.encode()), len(record.data)
    end = 8 + 8 + 4 + sizes[0] + 4 + sizes[1] + 8 + sizes[2]
    crc = int.from_bytes(content[end : end + 4], 'little')
    if crc and zlib.crc32(content[:end]) != crc:
        raise DamageError('the checksum of an attachment disagrees')
    return record


# ---- chunks ----


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

        Args:
            content: Its first bytes; 64 are enough.
            length: As the record states it.

        Raises:
            DamageError: It is no chunk, or the lengths that it states disagree.
        """
        try:
            _, _, plain_size, crc = _CHUNK.unpack_from(content, 0)
            (name_size,) = struct.unpack_from('<I', content, _CHUNK.size)
            name = content[_CHUNK.size + 4 : _CHUNK.size + 4 + min(name_size, _LONGEST_NAME)]
            data_at = _CHUNK_FIELDS + len(name)
            (data_size,) = struct.unpack_from('<Q', content, data_at - 8)
        except struct.error:
            raise DamageError('a chunk is cut off') from None
        known = name in COMPRESSION_MAGICS or re.fullmatch(rb'[a-z0-9_-]+', name)
        if not known or length < data_at + data_size:
            raise DamageError('a chunk states lengths that disagree')
        return cls(plain_size, crc, name, data_at, data_size)


def chunk_data(content: bytes) -> bytes:
    """Return the plain data of a whole chunk record.

    Raises:
        DamageError: It cannot be decompressed, or is not what its checksum says.
    """
    head = ChunkHead.of(content, len(content))
    plain = _decompress(head, content[head.data_at : head.data_at + head.data_size])
    if len(plain) != head.plain_size:
        raise DamageError('a chunk has another size than it states')
    if head.crc and zlib.crc32(plain) != head.crc:
        raise DamageError('the checksum of a chunk disagrees')
    return plain


def cut_chunk_data(content: bytes) -> bytes:
    """Return the whole records at the beginning of a chunk record that is cut off."""
    try:
        (length,) = struct.unpack_from('<Q', content, 1)
        head = ChunkHead.of(content[HEAD.size :], length)
        start = HEAD.size + head.data_at
        plain = _decompress(head, content[start : start + head.data_size])
    except (DamageError, struct.error):
        return b''
    return whole_records(plain)


def decompress_zstd(data: bytes, limit: int = _LARGEST_CHUNK) -> bytes:
    """Return what the frames of zstd hold, one behind the other; of a cut frame its beginning.

    Raises:
        DamageError: They cannot be decompressed, or to more than `limit` bytes.
    """
    parts = []
    try:
        while data:
            frame = zstandard.ZstdDecompressor().decompressobj()
            parts.append(frame.decompress(data))
            data = frame.unused_data
            limit -= len(parts[-1])
            _check_limit(limit)
    except (zstandard.ZstdError, MemoryError) as error:
        raise DamageError(f'the data cannot be decompressed ({error})') from None
    return parts[0] if len(parts) == 1 else b''.join(parts)


def decompress_lz4(data: bytes, limit: int = _LARGEST_CHUNK) -> bytes:
    """Return what the frames of lz4 hold, as `decompress_zstd` does.

    Raises:
        DamageError: As there.
    """
    parts = []
    try:
        while data:
            frame = lz4.frame.LZ4FrameDecompressor()
            parts.append(bytes(frame.decompress(data)))
            data = frame.unused_data or b''
            limit -= len(parts[-1])
            _check_limit(limit)
    except (RuntimeError, MemoryError, ValueError) as error:
        raise DamageError(f'the data cannot be decompressed ({error})') from None
    return parts[0] if len(parts) == 1 else b''.join(parts)


def _check_limit(rest: int) -> None:
    if rest < 0:
        raise DamageError('a chunk has another size than it states')


def _decompress(head: ChunkHead, data: bytes) -> bytes:
    """Return the plain data of a chunk, all of it or its beginning."""
    if head.plain_size > _LARGEST_CHUNK:
        raise DamageError('a chunk states a size that cannot be')
    if head.compression == b'zstd':
        return decompress_zstd(data, head.plain_size)
    if head.compression == b'lz4':
        return decompress_lz4(data, head.plain_size)
    if head.compression:
        raise DamageError(f'the compression {head.compression.decode()!r} is not known')
    return data
