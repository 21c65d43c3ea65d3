"""Reading an MCAP file from its beginning, however it ended and whatever is damaged in it."""

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
import struct
from typing import BinaryIO
import zlib

from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata, Schema

from disc_sim_ros.bags.contents import Chunk, Contents, Loss
from disc_sim_ros.bags.mcap_records import (
    HEAD,
    MAGIC,
    ChunkHead,
    chunk_data,
    cut_chunk_data,
    messages,
    parsed,
    parsed_attachment,
    records,
)
from disc_sim_ros.bags.mcap_resync import Source, is_plausible, next_record
from disc_sim_ros.errors import BagError, DamageError

_RUN = 1 << 20  # bytes of messages outside of chunks that are taken together
_BLOCK = 1 << 20  # bytes of which a checksum is computed at a time
_FIRST_PRIVATE = 0x80  # opcode
_LOOSE = (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL)
_CHECKED = (  # records whose content is read
    Opcode.HEADER,
    Opcode.MESSAGE_INDEX,
    Opcode.METADATA,
    Opcode.ATTACHMENT,
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.DATA_END,
    Opcode.FOOTER,
)
_FOOTER = struct.Struct('<QQI')  # start of the summary, of its offsets, checksum


def scanned(path: Path, unpacked: Path | None = None) -> Contents:
    """Return what a file holds, each chunk checked, and what is lost.

    Args:
        path: The file.
        unpacked: Where its plain bytes are, if it is compressed as a whole.

    Raises:
        BagError: It is no MCAP file at all.
        OSError: It cannot be read.
    """
    contents = Contents(path, unpacked)
    with contents.data_path.open('rb') as file:
        _Scan(contents, file).run()
    return contents


class _Scan:
    """One pass over a file."""

    def __init__(self, contents: Contents, file: BinaryIO) -> None:
        self._contents = contents
        self._source = Source(file)
        self._size = self._source.size
        self._trusted = 0  # what lies before it is known to be what it says
        self._in_summary = False  # the data section has ended
        self._closed = False
        self._counting_loss = False  # message indexes that follow count the last loss
        self._run: tuple[int, int] | None = None  # begin and end of records outside of chunks
        self._channels_in_data: set[int] = set()
        self._schemas_in_data: set[int] = set()

    def run(self) -> None:
        """Read the whole file.

        Raises:
            BagError: There is no record of MCAP in it.
        """
        at: int | None = len(MAGIC)
        if self._source.read(0, len(MAGIC)) != MAGIC:
            at = next_record(self._source, 0, {})
            if at is None:
                what = 'is no MCAP file' if self._size else 'is empty'
                raise BagError(f'{self._contents.path}: the file {what}')
            self._lose(0, at, 'the beginning is damaged')
        while at is not None and at < self._size:
            at = self._record(at)
        self._end_run()
        self._check_definitions()
        self._contents.closed = self._closed
        self._contents.complete = self._closed and not self._contents.losses

    def _record(self, at: int) -> int | None:
        """Take the record there and return where the next one begins; None at the end."""
        head = self._source.read(at, HEAD.size)
        if len(head) < HEAD.size:
            self._end(at, head)
            return None
        opcode, length = HEAD.unpack(head)
        after: int = at + HEAD.size + length
        if not is_plausible(opcode, length):
            return self._resume(at)
        if after > self._size:
            return self._cut(at, opcode, length)
        if opcode == Opcode.CHUNK:
            return self._chunk(at, after)
        if opcode in _LOOSE and not self._in_summary:
            self._loose(opcode, at, after)
        else:
            self._end_run()
            self._other(opcode, at, after)
        return after

    def _end(self, at: int, rest: bytes) -> None:
        """Take what is left when there is no room for a record."""
        if self._in_summary and rest == MAGIC:
            self._closed = True
        else:
            self._end_cut(at, 0)

    def _chunk(self, at: int, after: int) -> int | None:
        content = self._source.read(at + HEAD.size, after - at - HEAD.size)
        try:
            ChunkHead.of(content, len(content))
        except DamageError:
            return self._resume(at)
        self._end_run()
        try:
            self._add_chunk(Chunk(at, after - at, 0, 0, None), chunk_data(content))
        except DamageError as error:
            self._lose(at, after, str(error))
            self._counting_loss = True
            self._trusted = at + 1
        else:
            self._counting_loss = False
            self._trusted = after
        return after

    def _loose(self, opcode: int, at: int, after: int) -> None:
        """Take a message or a definition outside of a chunk."""
        self._counting_loss = False
        self._trusted = at + 1
        if self._run is not None and at - self._run[0] > _RUN:
            self._end_run()
        self._run = (at if self._run is None else self._run[0], after)
        if opcode != Opcode.MESSAGE:
            self._define(opcode, self._source.read(at + HEAD.size, after - at - HEAD.size))

    def _end_run(self, end: int | None = None) -> None:
        """Take the messages outside of chunks up to `end` together."""
        if self._run is None:
            return
        begin, last = self._run
        self._run = None
        last = last if end is None else min(last, end)
        if begin < last:
            chunk = Chunk(begin, last - begin, 0, 0, None, is_record=False)
            try:
                self._add_chunk(chunk, self._source.read(begin, last - begin))
            except DamageError as error:
                self._lose(begin, last, str(error))

    def _other(self, opcode: int, at: int, after: int) -> None:
        """Take a record that is no message and no definition of the data section."""
        size = after - at - HEAD.size if opcode in _CHECKED else 0
        content = self._source.read(at + HEAD.size, size)
        if opcode == Opcode.MESSAGE_INDEX:
            self._message_index(content, after)
            return
        self._counting_loss = False
        self._trusted = at + 1
        contents = self._contents
        try:
            if opcode == Opcode.METADATA:
                record = parsed(Metadata, content)
                assert isinstance(record, Metadata)  # noqa: S101 - for mypy
                contents.metadata.append(record)
            elif opcode == Opcode.ATTACHMENT:
                parsed_attachment(content)
                contents.attachments.append(at)
            elif opcode == Opcode.HEADER and contents.profile is None:
                contents.profile = getattr(parsed(Header, content), 'profile', None)
            elif opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:  # of the summary
                self._define(opcode, content)
            elif opcode == Opcode.DATA_END:
                self._in_summary = True
                self._check_data(at, int.from_bytes(content, 'little'))
            elif opcode == Opcode.FOOTER:
                self._check_summary(at, content)
            elif opcode >= _FIRST_PRIVATE and not self._in_summary:
                contents.private.append((at, after - at))
        except DamageError as error:
            self._lose(at, after, str(error))

    def _message_index(self, content: bytes, after: int) -> None:
        size = int.from_bytes(content[2:6], 'little')
        if size <= len(content) - 6:
            self._trusted = after
        if self._counting_loss:
            last = self._contents.losses[-1]
            count = (last.messages or 0) + min(size, len(content) - 6) // 16
            self._contents.losses[-1] = replace(last, messages=count)

    def _check_data(self, end: int, crc: int) -> None:
        """Compare the data section with its checksum; 0 stands for none."""
        if crc and not self._contents.losses and self._checksum(0, end) != crc:
            text = 'the checksum of all data disagrees; which bytes are damaged is not known'
            self._lose(end, end, text)

    def _check_summary(self, at: int, footer: bytes) -> None:
        """Compare the summary with its checksum in the footer.

        Raises:
            DamageError: It disagrees.
        """
        start, _, crc = _FOOTER.unpack(footer)
        start = start or at  # 0: there is no summary, and the checksum is of the footer alone
        end = at + HEAD.size + _FOOTER.size - 4
        if crc and (start > at or self._checksum(start, end) != crc):
            raise DamageError('the checksum of the index disagrees')

    def _checksum(self, begin: int, end: int) -> int:
        crc = 0
        for at in range(begin, end, _BLOCK):
            crc = zlib.crc32(self._source.read(at, min(_BLOCK, end - at)), crc)
        return crc

    def _add_chunk(self, chunk: Chunk, data: bytes) -> None:
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
        self._contents.chunks.append(
            replace(chunk, start=min(times), end=max(times), channels=frozenset(counts))
        )
        for channel_id, count in counts.items():
            self._contents.counts[channel_id] = self._contents.counts.get(channel_id, 0) + count

    def _define(self, opcode: int, content: bytes) -> None:
        """Note a definition. A damaged one may come again."""
        with suppress(DamageError):
            record = parsed(Schema if opcode == Opcode.SCHEMA else Channel, content)
            if isinstance(record, Schema) and record.id:
                self._contents.schemas.setdefault(record.id, record)
                if not self._in_summary:
                    self._schemas_in_data.add(record.id)
            elif isinstance(record, Channel):
                self._contents.channels.setdefault(record.id, record)
                if not self._in_summary:
                    self._channels_in_data.add(record.id)

    def _cut(self, at: int, opcode: int, length: int) -> int | None:
        """Take a record that reaches beyond the end of the file."""
        rest = self._source.read(at, self._size - at)
        kept = 0
        try:
            if opcode != Opcode.CHUNK:
                raise DamageError('not a chunk')  # noqa: TRY301
            ChunkHead.of(rest[HEAD.size :], length)
        except DamageError:
            if self._next(max(at + 1, self._trusted)) is not None:
                return self._resume(at)
        else:
            self._end_run()
            before = self._contents.message_count
            self._add_chunk(Chunk(at, len(rest), 0, 0, None, is_cut=True), cut_chunk_data(rest))
            kept = self._contents.message_count - before
        self._end_cut(at, opcode, kept)
        return None

    def _end_cut(self, at: int, opcode: int, kept: int = 0) -> None:
        """Note that the last record is not whole."""
        if self._in_summary:
            self._lose(at, self._size, 'the index is cut off', 0)
        elif opcode == Opcode.MESSAGE_INDEX:
            self._lose(at, self._size, 'the index of the last chunk is cut off', 0)
        else:
            note = f'; its first {kept} messages are kept' if kept else ''
            self._lose(at, self._size, f'the last record is cut off{note}')

    def _resume(self, at: int) -> int | None:
        """Find the next record after damage, which may be in the record before this place."""
        if self._in_summary:
            self._lose(at, self._size, 'the index is damaged', 0)
            return None
        following = self._next(max(self._trusted, 1))
        begin = at
        if following is not None and following < at:  # a damaged length led over it
            begin = self._trusted - 1
            self._end_run(begin)
        self._end_run()
        self._counting_loss = False
        end = self._size if following is None else following
        self._lose(begin, end, 'a record is damaged')
        self._trusted = end + 1
        return following

    def _next(self, at: int) -> int | None:
        return next_record(self._source, at, self._contents.channels)

    def _lose(self, begin: int, end: int, reason: str, count: int | None = None) -> None:
        losses = self._contents.losses
        while losses and losses[-1].offset + losses[-1].length > begin:
            begin = min(begin, losses.pop().offset)
        losses.append(Loss(self._contents.path, begin, end - begin, reason, count))
        private = self._contents.private
        while private and private[-1][0] >= begin:
            private.pop()

    def _check_definitions(self) -> None:
        """Give up messages of unknown channels; name the channels whose schema is lost."""
        contents = self._contents
        for channel_id in list(contents.counts):
            channel = contents.channels.get(channel_id)
            if channel is None:
                count = contents.counts.pop(channel_id)
                reason = f'the definition of channel {channel_id} is lost'
                contents.losses.append(Loss(contents.path, 0, 0, reason, count))
            elif channel.schema_id and channel.schema_id not in contents.schemas:
                reason = f'the schema of {channel.topic} is lost; its messages are kept'
                contents.losses.append(Loss(contents.path, 0, 0, reason, 0))
        contents.in_summary_only = {
            i
            for i, c in contents.channels.items()
            if i not in self._channels_in_data
            or (c.schema_id and c.schema_id not in self._schemas_in_data)
        }
