"""MCAP files made record by record, with any of the liberties that the specification allows."""

from collections.abc import Iterable
import io
import struct
import zlib

import lz4.frame
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
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
import zstandard

MAGIC = b'\x89MCAP0\r\n'
NEVER_LONGER = (Opcode.MESSAGE, Opcode.DATA_END, Opcode.FOOTER)
COMPRESS = {
    '': bytes,
    'zstd': zstandard.ZstdCompressor().compress,
    'lz4': lz4.frame.compress,
    # A frame for each half of the data.
    'zstd+zstd': lambda d: b''.join(
        zstandard.ZstdCompressor().compress(h) for h in (d[: len(d) // 2], d[len(d) // 2 :])
    ),
    'lz4+lz4': lambda d: b''.join(
        lz4.frame.compress(h) for h in (d[: len(d) // 2], d[len(d) // 2 :])
    ),
}
SCHEMA = Schema(id=1, name='Example', encoding='c', data=b'\4\5\6')
CHANNEL = Channel(
    id=0, topic='example', message_encoding='a', metadata={'foo': 'bar'}, schema_id=1
)
MESSAGES = [
    Message(channel_id=0, sequence=n, log_time=t, publish_time=t + 1, data=bytes([n, 2, 3]))
    for n, t in enumerate((0, 2, 1, 3, 3, 5, 4, 7, 8, 9))
]
ATTACHMENT = Attachment(
    create_time=1, log_time=2, name='myFile', media_type='application/octet-stream', data=b'\1\2'
)
METADATA = Metadata(name='mine', metadata={'ünï': '日本'})
EVERYTHING = (SCHEMA, CHANNEL, *MESSAGES, ATTACHMENT, METADATA)


def packed(record: McapRecord, pad: bytes = b'') -> bytes:
    """A record with its head, longer than its fields by a pad where that is allowed."""
    builder = RecordBuilder()
    record.write(builder)
    data = builder.end()
    if not pad or data[0] in NEVER_LONGER:
        return data
    return data[:1] + struct.pack('<Q', len(data) - 9 + len(pad)) + data[9:] + pad


def raw_record(opcode: int, content: bytes) -> bytes:
    """A record of any opcode."""
    return struct.pack('<BQ', opcode, len(content)) + content


def mcap_bytes(
    records: Iterable[McapRecord | bytes],
    *,
    pad: bytes = b'',
    pad_in_chunk: bool = False,
    chunked: bool = True,
    compression: str = '',
    message_index: bool = True,
    summary: frozenset[str] = frozenset(('definitions', 'statistics', 'chunks', 'others')),
    data_crc: bool = True,
    end: bool = True,
) -> bytes:
    """A file; bytes among the records are written as they are, outside of the chunk."""
    file = io.BytesIO()
    file.write(MAGIC + packed(Header('', ''), pad))
    chunk, index = io.BytesIO(), MessageIndex(0, [])
    others: list[McapRecord] = []
    counts = dict.fromkeys((Schema, Channel, Message, Attachment, Metadata), 0)
    definitions = []
    for record in records:
        if isinstance(record, bytes):
            file.write(record)
            continue
        counts[type(record)] += 1
        data = packed(record, pad)
        if isinstance(record, Attachment):
            times = record.log_time, record.create_time, len(record.data)
            others.append(AttachmentIndex(file.tell(), len(data), *times, record.name,
                                          record.media_type))  # fmt: skip
        elif isinstance(record, Metadata):
            others.append(MetadataIndex(file.tell(), len(data), record.name))
        elif isinstance(record, (Schema, Channel)):
            definitions.append(record)
        if isinstance(record, (Attachment, Metadata)) or not chunked:
            file.write(data)
            continue
        if isinstance(record, Message):
            index.records.append((record.log_time, chunk.tell()))
        chunk.write(packed(record, pad if pad_in_chunk else b''))
    times = [m.log_time for m in records if isinstance(m, Message)] or [0]
    chunks = []
    if chunked:
        plain = chunk.getvalue()
        data = COMPRESS[compression](plain)
        crc = zlib.crc32(plain)
        name = compression.split('+', maxsplit=1)[0]
        at = file.tell()
        record = packed(Chunk(name, data, max(times), min(times), crc, len(plain)), pad)
        file.write(record)
        places, length = {}, 0
        if message_index and index.records:
            places[0] = file.tell()
            length = file.write(packed(index, pad))
        chunks = [ChunkIndex(len(record), at, name, len(data), max(times), length, places,
                             min(times), len(plain))]  # fmt: skip
    if not end:
        return file.getvalue()
    file.write(packed(DataEnd(zlib.crc32(file.getvalue()) if data_crc else 0)))
    at = file.tell()
    statistics = Statistics(
        counts[Attachment], counts[Channel], {0: counts[Message]} if counts[Message] else {},
        len(chunks), counts[Message], max(times), min(times), counts[Metadata], counts[Schema],
    )  # fmt: skip
    for name, group in (
        ('definitions', definitions),
        ('statistics', [statistics]),
        ('chunks', chunks),
        ('others', others),
    ):
        if name in summary:
            file.write(b''.join(packed(r, pad) for r in group))
    body = file.getvalue()[at:]
    footer = packed(Footer(at if body else 0, 0, 0))
    footer = packed(Footer(at if body else 0, 0, zlib.crc32(body + footer[:-4])))
    return file.getvalue() + footer + MAGIC
