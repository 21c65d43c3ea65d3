"""Finding the next record of an MCAP file behind damage."""

import re
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, McapRecord, Metadata, Schema

from disc_sim_ros.bags.mcap_records import COMPRESSION_MAGICS, HEAD, ChunkHead, parsed
from disc_sim_ros.errors import DamageError

CHUNK_START = 64  # bytes that hold the beginning of a chunk record up to its data
_FIRST_WINDOW = 1 << 12  # bytes searched first: mostly the next record is near
_WINDOW = 1 << 20  # bytes searched at a time at most
_BLOCK = 1 << 16  # bytes read ahead for small records
_CHAIN = 3  # records behind each other that are no accident
# The head of a record that the specification knows, shorter than 2^40 bytes.
_CANDIDATE = re.compile(rb'(?=[\x01-\x0f].{5}\x00\x00\x00)', re.DOTALL)  # they may overlap
_LEAST = {  # bytes of the content of a record
    Opcode.HEADER: 8,
    Opcode.FOOTER: 20,
    Opcode.SCHEMA: 14,
    Opcode.CHANNEL: 16,
    Opcode.MESSAGE: 22,
    Opcode.CHUNK: 40,
    Opcode.MESSAGE_INDEX: 6,
    Opcode.CHUNK_INDEX: 64,
    Opcode.ATTACHMENT: 36,
    Opcode.ATTACHMENT_INDEX: 48,
    Opcode.STATISTICS: 46,
    Opcode.METADATA: 8,
    Opcode.METADATA_INDEX: 20,
    Opcode.SUMMARY_OFFSET: 17,
    Opcode.DATA_END: 4,
}
_EXACT = (Opcode.FOOTER, Opcode.DATA_END)  # these are never extended
_LONGEST_UNKNOWN = 1 << 40  # bytes
_LONGEST_EXTENSION = 1 << 16  # bytes behind the known fields of a chunk
_PARSED: dict[int, type[McapRecord]] = {
    int(Opcode.SCHEMA): Schema,
    int(Opcode.CHANNEL): Channel,
    int(Opcode.METADATA): Metadata,
}


class Source:
    """A file that is read at any place; small parts are read ahead."""

    def __init__(self, file: BinaryIO) -> None:
        self.size = file.seek(0, 2)
        self._file = file
        self._at = 0
        self._block = b''

    def read(self, at: int, size: int) -> bytes:
        """Return bytes from a place on; fewer at the end of the file."""
        if size > _BLOCK:
            self._file.seek(at)
            return self._file.read(size)
        begin = at - self._at
        if begin < 0 or begin + size > len(self._block):
            self._file.seek(at)
            self._at, self._block, begin = at, self._file.read(_BLOCK), 0
        return self._block[begin : begin + size]


def is_plausible(opcode: int, length: int) -> bool:
    """Return True if a record can begin so; opcodes that are not known yet may come."""
    if opcode not in _LEAST:
        return opcode != 0 and length < _LONGEST_UNKNOWN
    if opcode in _EXACT:
        return length == _LEAST[Opcode(opcode)]
    return length >= _LEAST[Opcode(opcode)]


def next_record(source: Source, at: int, channels: dict[int, Channel]) -> int | None:
    """Return where the first record at or behind a place begins, or None.

    Args:
        source: The file.
        at: Where to begin the search.
        channels: Those known: of their messages less evidence is asked.
    """
    size = _FIRST_WINDOW
    while at < source.size:
        window = source.read(at, size + HEAD.size)
        for match in _CANDIDATE.finditer(window):
            place = at + match.start()
            if _is_record(source, place, channels):
                return place
        at += size
        size = min(2 * size, _WINDOW)
    return None


def _is_record(source: Source, at: int, channels: dict[int, Channel]) -> bool:
    opcode, length = HEAD.unpack(source.read(at, HEAD.size))
    if not is_plausible(opcode, length):
        return False
    if opcode == Opcode.CHUNK:
        return _is_chunk(source, at, length)
    if at + HEAD.size + length > source.size:
        return False
    if opcode == Opcode.MESSAGE:
        channel = int.from_bytes(source.read(at + HEAD.size, 2), 'little')
        return _is_followed(source, at, 1 if channel in channels else _CHAIN)
    if opcode in _PARSED:
        try:
            parsed(_PARSED[opcode], source.read(at + HEAD.size, length))
        except DamageError:
            return False
    return _is_followed(source, at, _CHAIN)


def _is_chunk(source: Source, at: int, length: int) -> bool:
    """Return True if the data begin as their compression demands, and the lengths agree."""
    start = source.read(at, CHUNK_START)
    if len(start) < CHUNK_START:
        return False
    try:
        head = ChunkHead.of(start[HEAD.size :], length)
    except DamageError:
        return False
    if head.compression not in COMPRESSION_MAGICS or not head.data_size:
        return False
    if length - head.data_at - head.data_size > _LONGEST_EXTENSION:
        return False
    data = start[HEAD.size + head.data_at :]
    if head.compression:
        return data.startswith(COMPRESSION_MAGICS[head.compression])
    return head.plain_size == head.data_size and is_plausible(*HEAD.unpack_from(data))


def _is_followed(source: Source, at: int, count: int) -> bool:
    """Return True if `count` heads of records come behind the record there, or the end does."""
    for _ in range(count):
        _, length = HEAD.unpack(source.read(at, HEAD.size))
        at += HEAD.size + length
        head = source.read(at, HEAD.size)
        if len(head) < HEAD.size:  # the end, or too little to judge
            return at <= source.size or count == 1
        opcode, length = HEAD.unpack(head)
        if not is_plausible(opcode, length) or (count > 1 and opcode not in _LEAST):
            return False
        if at + HEAD.size + length > source.size:  # cut off
            return True
    return True
