"""What one MCAP file holds, as found by its index or by reading all of it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema

from disc_sim_ros.bags.mcap_records import HEAD, chunk_data, cut_chunk_data, parsed_attachment
from disc_sim_ros.errors import DamageError


@dataclass(frozen=True, slots=True)
class Chunk:
    """A part of a file that holds messages: a chunk record, or records outside of chunks."""

    offset: int  # of the chunk record, or of the first record
    length: int  # with the head of the record
    start: int  # least log time [ns]
    end: int
    channels: frozenset[int] | None  # those with messages; None: not known
    is_record: bool = True
    is_cut: bool = False  # the end is missing


@dataclass(frozen=True, slots=True)
class Loss:
    """Bytes or messages that a bag should have and that cannot be read."""

    path: Path
    offset: int
    length: int
    reason: str
    messages: int | None = None  # None: not known

    def __str__(self) -> str:
        amounts = [f'{self.length} bytes from byte {self.offset}'] if self.length else []
        amounts += [] if self.messages is None else [f'{self.messages} messages']
        return ': '.join([self.path.name, *([', '.join(amounts)] if amounts else []), self.reason])


@dataclass(slots=True, weakref_slot=True)
class Contents:
    """What one file holds. Times are log times [ns].

    Attributes:
        path: The file, as it is named in the bag.
        unpacked: Where its plain bytes are, if the file is compressed as a whole.
        profile: Of the header; None where that is lost.
        schemas, channels: By id.
        in_summary_only: Definitions that the data section does not have: ids of channels.
        chunks: Where the messages are.
        counts: Messages by channel id.
        attachments: Their offsets.
        metadata: Metadata records.
        private: Offset and length of the records of other programs (opcodes from 0x80).
        losses: What is damaged or missing.
        complete: The file has its end, and no damage was found.
        closed: The file has its end: its recorder had no more to write.
    """

    path: Path
    unpacked: Path | None = None
    profile: str | None = None
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    in_summary_only: set[int] = field(default_factory=set)
    chunks: list[Chunk] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)
    attachments: list[int] = field(default_factory=list)
    metadata: list[Metadata] = field(default_factory=list)
    private: list[tuple[int, int]] = field(default_factory=list)
    losses: list[Loss] = field(default_factory=list)
    complete: bool = False
    closed: bool = False

    @property
    def data_path(self) -> Path:
        """The file with the plain bytes."""
        return self.unpacked or self.path

    @property
    def message_count(self) -> int:
        """Messages of all channels."""
        return sum(self.counts.values())

    @property
    def start(self) -> int:
        """Least log time [ns]; 0 without messages."""
        return min((c.start for c in self.chunks), default=0)

    @property
    def end(self) -> int:
        """Greatest log time [ns]; 0 without messages."""
        return max((c.end for c in self.chunks), default=0)


def chunk_bytes(file: BinaryIO, chunk: Chunk) -> bytes:
    """Return the plain data of a chunk of an open file.

    Raises:
        DamageError: It is damaged.
        OSError: It cannot be read.
    """
    file.seek(chunk.offset)
    stored = file.read(chunk.length)
    if len(stored) < chunk.length:
        raise DamageError('the file ends early')
    if not chunk.is_record:
        return stored
    if chunk.is_cut:
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
