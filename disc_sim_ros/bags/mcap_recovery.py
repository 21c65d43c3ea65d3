"""Reading an MCAP file from its beginning, however it ended and whatever befell it."""

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
import re
import struct
from typing import BinaryIO
import zlib

from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema

from disc_sim_ros.bags.mcap_records import (
    HEAD,
    MAGIC,
    Chunk,
    ChunkHead,
    Contents,
    Loss,
    chunk_data,
    cut_chunk_data,
    messages,
    parsed,
    parsed_attachment,
    records,
)
from disc_sim_ros.errors import BagError, DamageError

_CHUNK_START = 64  # bytes that hold the beginning of a chunk record up to its data
_WINDOW = 1 << 20  # bytes searched at a time
_RUN = 1 << 20  # bytes of messages outside of chunks that make one piece
# A chunk or a message record shorter than 2^40 bytes.
_CANDIDATE = re.compile(rb'[\x05\x06].{5}\x00\x00\x00', re.DOTALL)
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
_EXACT = (Opcode.FOOTER, Opcode.SUMMARY_OFFSET, Opcode.DATA_END)
_LOOSE = (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL)
_FOOTER = struct.Struct('<QQI')  # start of the index, of its offsets, checksum
_MOST_PRIVATE = 1 << 40  # bytes


def scanned(path: Path) -> Contents:
    """Return what a file holds, each chunk checked, and what is lost.

    Raises:
        BagError: It is no MCAP file at all.
        OSError: It cannot be read.
    """
    with path.open('rb') as file:
        return _Scan(path, file).run()


class _Scan:
    """One pass over a file."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self.found = Contents(path)
        self._file = file
        self._size = file.seek(0, 2)
        self._trusted = 0  # what lies before it is known to be what it says
        self._ended = False  # what follows is the index
        self._closed = False
        self._owed = False  # message indexes that follow count the messages of the last loss
        self._run: tuple[int, int] | None = None  # begin and end of records outside of chunks

    def run(self) -> Contents:
        """Read the whole file."""
        at: int | None = len(MAGIC)
        if self._read(0, len(MAGIC)) != MAGIC:
            at = self._next_record(0)
            if at is None:
                what = 'is no MCAP file' if self._size else 'is empty'
                raise BagError(f'{self.found.path}: the file {what}')
            self._lose(0, at, 'the beginning is damaged')
        while at is not None and at < self._size:
            at = self._record(at)
        self._end_run()
        self._drop_undefined()
        self.found.complete = self._closed and not self.found.losses
        return self.found

    def _record(self, at: int) -> int | None:
        """Take the record there and return where the next one begins; None at the end."""
        head = self._read(at, HEAD.size)
        if len(head) < HEAD.size:
            self._end(at, head)
            return None
        opcode, length = HEAD.unpack(head)
        after: int = at + HEAD.size + length
        if not _plausible(opcode, length):
            return self._resume(at)
        if after > self._size:
            return self._cut(at, opcode, length)
        if opcode == Opcode.CHUNK:
            return self._chunk(at, after)
        if opcode in _LOOSE and not self._ended:
            self._loose(at, after)
        else:
            self._end_run()
            self._other(opcode, at, after)
        return after

    def _end(self, at: int, rest: bytes) -> None:
        """Take what is left when there is no room for a record."""
        if self._ended and rest == MAGIC:
            self._closed = True
        else:
            self._end_cut(at, 0)

    def _chunk(self, at: int, after: int) -> int | None:
        content = self._read(at + HEAD.size, after - at - HEAD.size)
        try:
            ChunkHead.of(content, len(content))
        except DamageError:
            return self._resume(at)
        self._end_run()
        try:
            self._add_piece(Chunk(at, after - at, 0, 0, None), chunk_data(content))
        except DamageError as error:
            self._lose(at, after, str(error))
            self._owed = True
            self._trusted = at + 1
        else:
            self._owed = False
            self._trusted = after
        return after

    def _loose(self, at: int, after: int) -> None:
        """Take a message or a definition outside of a chunk."""
        self._owed = False
        self._trusted = at + 1
        if self._run is not None and at - self._run[0] > _RUN:
            self._end_run()
        self._run = (at if self._run is None else self._run[0], after)
        content = self._read(at, after - at)
        if content[0] != Opcode.MESSAGE:
            self._define(content[0], content[HEAD.size :])

    def _end_run(self, end: int | None = None) -> None:
        """Make a piece of the messages outside of chunks, up to `end`."""
        if self._run is None:
            return
        begin, last = self._run
        self._run = None
        last = last if end is None else min(last, end)
        if begin < last:
            piece = Chunk(begin, last - begin, 0, 0, None, chunk=False)
            try:
                self._add_piece(piece, self._read(begin, last - begin))
            except DamageError as error:
                self._lose(begin, last, str(error))

    def _other(self, opcode: int, at: int, after: int) -> None:
        content = self._read(at + HEAD.size, after - at - HEAD.size)
        if opcode == Opcode.MESSAGE_INDEX:
            if int.from_bytes(content[2:6], 'little') == len(content) - 6:
                self._trusted = after
            if self._owed:
                last = self.found.losses[-1]
                count = (last.messages or 0) + (len(content) - 6) // 16
                self.found.losses[-1] = replace(last, messages=count)
            return
        self._owed = False
        self._trusted = at + 1
        try:
            if opcode == Opcode.METADATA:
                record = parsed(Metadata, content)
                assert isinstance(record, Metadata)  # noqa: S101 - for mypy
                self.found.metadata.append(record)
            elif opcode == Opcode.ATTACHMENT:
                parsed_attachment(content)
                self.found.attachments.append(at)
            elif opcode in _LOOSE:  # of the index
                self._define(opcode, content)
            elif opcode == Opcode.DATA_END:
                self._ended = True
            elif opcode == Opcode.FOOTER:
                self._check_index(at, content)
        except DamageError as error:
            self._lose(at, after, str(error))

    def _check_index(self, at: int, footer: bytes) -> None:
        """Compare the index with its checksum in the footer.

        Raises:
            DamageError: It disagrees.
        """
        start, _, crc = _FOOTER.unpack(footer)
        end = at + HEAD.size + _FOOTER.size - 4
        if crc and (start > at or zlib.crc32(self._read(start, end - start)) != crc):
            raise DamageError('the checksum of the index disagrees')

    def _add_piece(self, piece: Chunk, data: bytes) -> None:
        """Count the messages in plain data.

        Raises:
            DamageError: The records in it are not whole.
        """
        counts: dict[int, int] = {}
        times = []
        for message in messages(data):
            counts[message.channel_id] = counts.get(message.channel_id, 0) + 1
            times.append(message.log_time)
        for opcode, at, length in records(data):
            if opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:
                self._define(opcode, data[at : at + length])
        if not times:
            return
        self.found.pieces.append(
            replace(piece, start=min(times), end=max(times), channels=frozenset(counts))
        )
        for channel_id, count in counts.items():
            self.found.counts[channel_id] = self.found.counts.get(channel_id, 0) + count

    def _define(self, opcode: int, content: bytes) -> None:
        """Note a definition; a damaged one may come again, or else its topic is given up."""
        with suppress(DamageError):
            record = parsed(Schema if opcode == Opcode.SCHEMA else Channel, content)
            if isinstance(record, Schema):
                self.found.schemas.setdefault(record.id, record)
            elif isinstance(record, Channel):
                self.found.channels.setdefault(record.id, record)

    def _cut(self, at: int, opcode: int, length: int) -> int | None:
        """Take a record that reaches beyond the end of the file."""
        rest = self._read(at, self._size - at)
        kept = 0
        try:
            if opcode != Opcode.CHUNK:
                raise DamageError('not a chunk')  # noqa: TRY301
            ChunkHead.of(rest[HEAD.size :], length)
        except DamageError:
            if self._next_record(max(at + 1, self._trusted)) is not None:
                return self._resume(at)
        else:
            self._end_run()
            before = self.found.message_count
            self._add_piece(Chunk(at, len(rest), 0, 0, None, cut=True), cut_chunk_data(rest))
            kept = self.found.message_count - before
        self._end_cut(at, opcode, kept)
        return None

    def _end_cut(self, at: int, opcode: int, kept: int = 0) -> None:
        """Note that the last record is not whole."""
        if self._ended:
            self._lose(at, self._size, 'the index is cut off', 0)
        elif opcode == Opcode.MESSAGE_INDEX:
            self._lose(at, self._size, 'the index of the last chunk is cut off', 0)
        else:
            note = f'; its first {kept} messages are kept' if kept else ''
            self._lose(at, self._size, f'the last record is cut off{note}')

    def _resume(self, at: int) -> int | None:
        """Find the next record after damage, which may be in the one before this."""
        if self._ended:
            self._lose(at, self._size, 'the index is damaged', 0)
            return None
        following = self._next_record(max(self._trusted, 1))
        begin = at
        if following is not None and following < at:  # a damaged length led over it
            begin = self._trusted - 1
            self._end_run(begin)
        self._end_run()
        self._owed = False
        end = self._size if following is None else following
        self._lose(begin, end, 'a record is damaged')
        self._trusted = end + 1
        return following

    def _next_record(self, start: int) -> int | None:
        """Return where the first record from `start` on is that can be trusted, or None."""
        at = start
        while at < self._size:
            window = self._read(at, _WINDOW + HEAD.size)
            for match in _CANDIDATE.finditer(window):
                if self._stands(at + match.start()):
                    return at + match.start()
            at += _WINDOW
        return None

    def _stands(self, at: int) -> bool:
        """Say whether there is a chunk or a message of a known channel."""
        start = self._read(at, _CHUNK_START)
        if len(start) < _CHUNK_START and start[0] == Opcode.CHUNK:
            return False
        opcode, length = HEAD.unpack_from(start)
        if opcode == Opcode.CHUNK:
            try:
                ChunkHead.of(start[HEAD.size :], length)
            except DamageError:
                return False
            return True
        after = at + HEAD.size + length
        channel = int.from_bytes(start[HEAD.size : HEAD.size + 2], 'little')
        if not _plausible(opcode, length) or channel not in self.found.channels:
            return False
        following = self._read(after, HEAD.size)
        return after == self._size or (
            len(following) == HEAD.size and _plausible(*HEAD.unpack(following))
        )

    def _lose(self, begin: int, end: int, reason: str, count: int | None = None) -> None:
        losses = self.found.losses
        while losses and losses[-1].offset + losses[-1].length > begin:
            begin = min(begin, losses.pop().offset)
        losses.append(Loss(self.found.path, begin, end - begin, reason, count))

    def _drop_undefined(self) -> None:
        """Give up the messages of which nobody knows what they are."""
        found = self.found
        for channel_id in list(found.counts):
            channel = found.channels.get(channel_id)
            if channel is None or (channel.schema_id and channel.schema_id not in found.schemas):
                count = found.counts.pop(channel_id)
                reason = f'the definition of topic {channel_id} is lost'
                found.losses.append(Loss(found.path, 0, 0, reason, count))
        for channel_id, channel in list(found.channels.items()):
            if channel.schema_id and channel.schema_id not in found.schemas:
                del found.channels[channel_id]

    def _read(self, at: int, size: int) -> bytes:
        self._file.seek(at)
        return self._file.read(size)


def _plausible(opcode: int, length: int) -> bool:
    """Say whether a record can begin so."""
    if opcode >= 0x80:  # of others
        return length < _MOST_PRIVATE
    if opcode in _EXACT:
        return length == _LEAST[Opcode(opcode)]
    return opcode in _LEAST and length >= _LEAST[Opcode(opcode)]
