"""Reading a bag: of this package, of `ros2 bag record`, and one whose recorder was killed."""

from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
import re
import struct
from typing import Any, BinaryIO, NamedTuple

from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Schema
from mcap_ros2.decoder import DecoderFactory

from disc_sim_ros.bags import metadata, schemas
from disc_sim_ros.bags.mcap_reader import indexed
from disc_sim_ros.bags.mcap_records import (
    Chunk,
    Contents,
    Loss,
    attachment_at,
    chunk_bytes,
    messages,
)
from disc_sim_ros.bags.mcap_recovery import scanned
from disc_sim_ros.bags.metadata import BagMetadata, TopicInfo
from disc_sim_ros.bags.topic import Topic, parse_qos
from disc_sim_ros.errors import BagError, DamageError, brief
from disc_sim_ros.files import reason

_NUMBER = re.compile(r'_(\d+)\.mcap$')
_OTHERS = (  # how files that are no MCAP begin, and what to do
    (b'SQLite format 3', 'a sqlite3 bag; convert it with `ros2 bag convert`'),
    (b'\x28\xb5\x2f\xfd', 'a compressed file; decompress it with `zstd -d`'),
    (b'\x04\x22\x4d\x18', 'a compressed file; decompress it with `lz4 -d`'),
    (b'#ROSBAG', 'a ROS 1 bag; convert it with `rosbags-convert`'),
)


class RawMessage(NamedTuple):
    """A message as the bytes that were recorded."""

    topic: str
    log_time: int  # when it was received [ns]
    publish_time: int  # when it was sent [ns]
    data: bytes
    sequence: int = 0


class Message(NamedTuple):
    """A decoded message: `value` has the fields of its type."""

    topic: str
    type: str
    log_time: int  # when it was received [ns]
    publish_time: int  # when it was sent [ns]
    value: Any


class Bag:
    """An opened bag; keeps no file open. `complete` is False where `repair_bag` is needed."""

    def __init__(
        self, path: Path, contents: tuple[Contents, ...], told: BagMetadata, *, whole: bool
    ) -> None:
        """Use `open_bag`."""
        self.path = path
        self.contents = contents
        self.metadata = told
        self.files = tuple(c.path for c in contents)
        self.complete = whole and all(c.complete for c in contents)
        self.losses: tuple[Loss, ...] = tuple(loss for c in contents for loss in c.losses)
        self.custom_data = dict(told.custom_data)
        self.topics = _topics(contents, told)
        self.message_count = sum(t.message_count for t in self.topics)
        pieces = [p for c in contents for p in c.pieces]
        self.start = min((p.start for p in pieces), default=0)  # log time [ns], 0 if empty
        self.end = max((p.end for p in pieces), default=0)

    @property
    def attachments(self) -> tuple[Attachment, ...]:
        """The attached files.

        Raises:
            BagError: One is damaged.
        """
        found = []
        for contents in self.contents:
            if contents.attachments:
                with _opened(contents.path) as file:
                    for offset in contents.attachments:
                        try:
                            found.append(attachment_at(file, offset))
                        except DamageError as error:
                            raise _damage(contents.path, offset, error) from None
        return tuple(found)

    def raw(self, names: Iterable[str] | None = None) -> Iterator[RawMessage]:
        """Yield the messages of all or of the named topics, in the order of their log times.

        Raises:
            BagError: A part of a file is damaged that was not known to be.
        """
        for name, _, stored in self._stored(names):
            yield RawMessage(name, stored[2], stored[3], stored[4], stored[1])

    def messages(self, names: Iterable[str] | None = None) -> Iterator[Message]:
        """Yield decoded messages, by the definitions in the bag, as `raw` does.

        Raises:
            BagError: As `raw`, and where a message cannot be decoded.
        """
        decoders: dict[tuple[int, int], tuple[str, Callable[[bytes], Any]]] = {}
        for name, number, stored in self._stored(names):
            key = number, stored[0]
            if key not in decoders:
                decoders[key] = _decoder(self.contents[number], stored[0])
            type_name, decode = decoders[key]
            try:
                value = decode(stored[4])
            except (struct.error, ValueError, IndexError, McapError, MemoryError) as error:
                raise BagError(
                    f'{self.path}: the message on {name} at {stored[2]} ns is no {type_name} '
                    f'({error})'
                ) from None
            yield Message(name, type_name, stored[2], stored[3], value)

    def _stored(self, names: Iterable[str] | None) -> Iterator[tuple[str, int, Any]]:
        """Yield name, number of the file and stored message, in the order of the log times."""
        if isinstance(names, str):
            names = (names,)
        wanted = None if names is None else frozenset(names)
        channels = [_names(c, wanted) for c in self.contents]
        ids = [frozenset(c) for c in channels]
        pieces = sorted(
            (
                (piece.start, number, piece.offset, piece)
                for number, c in enumerate(self.contents)
                for piece in c.pieces
                if piece.channels is None or piece.channels & ids[number]
            ),
        )
        waiting: list[tuple[int, int, Any]] = []  # log time, number of the file, message
        with ExitStack() as stack:
            files: dict[int, BinaryIO] = {}
            for start, number, _, piece in pieces:
                ready = bisect_right(waiting, start, key=_LOG_TIME)
                for _, n, stored in waiting[:ready]:
                    yield channels[n][stored[0]], n, stored
                del waiting[:ready]
                if number not in files:
                    files[number] = stack.enter_context(_opened(self.files[number]))
                waiting += (
                    (stored[2], number, stored)
                    for stored in _messages(self.files[number], files[number], piece, ids[number])
                )
                waiting.sort(key=_LOG_TIME)
            for _, n, stored in waiting:
                yield channels[n][stored[0]], n, stored


_LOG_TIME = itemgetter(0)


def open_bag(path: Path | str) -> Bag:
    """Open a bag.

    Args:
        path: The folder, or one .mcap file.

    Raises:
        BagError: It is no bag that can be read; the reason says what it is.
    """
    path = Path(path)
    try:
        return _open(path)
    except OSError as error:
        raise BagError(f'{error.filename or path}: cannot be read ({reason(error)})') from None


def mcap_files(path: Path) -> tuple[tuple[Path, ...], BagMetadata | None]:
    """Return the files of a bag in their order, and what its metadata.yaml says.

    Raises:
        BagError: It is no bag that can be read.
        OSError: It cannot be read.
    """
    if path.is_file():
        return (path,), None
    if not path.is_dir():
        raise BagError(f'{path}: there is no such bag')
    told = _told(path / metadata.FILE_NAME)
    present = sorted(path.glob('*.mcap'), key=_order)
    if told is not None:
        if told.storage != 'mcap':
            advice = 'convert it with `ros2 bag convert`'
            raise BagError(f'{path}: a bag in {told.storage} format is not read; {advice}')
        if told.compression_mode not in {'', 'none'}:
            advice = 'convert it with `ros2 bag convert`'
            mode = told.compression_mode
            raise BagError(f'{path}: a bag with compression mode {mode} is not read; {advice}')
        listed = [path / f.path for f in told.files]
        for file in listed:
            if not file.is_file():
                raise BagError(f'{file}: the file is missing, {metadata.FILE_NAME} tells of it')
        last = max(map(_order, listed), default=(-1, ''))
        # The recorder may have been killed between a new file and the metadata that tells of it.
        listed += [f for f in present if f not in listed and _order(f) > last]
        if listed:
            return tuple(listed), told
    if not present:
        if any(path.glob('*.db3*')):
            raise BagError(f'{path}: a bag in sqlite3 format is not read; '
                           'convert it with `ros2 bag convert`')  # fmt: skip
        if any(path.glob('*.mcap.*')):
            raise BagError(f'{path}: a bag of compressed files is not read; '
                           'convert it with `ros2 bag convert`')  # fmt: skip
        raise BagError(f'{path}: no bag, there is no .mcap file in it')
    return tuple(present), told


def contents_of(files: tuple[Path, ...], read: Callable[[Path], Contents]) -> list[Contents]:
    """Return what each file of a bag holds; nothing of one that is no MCAP file among others.

    A recorder may be killed before its new file has a beginning.

    Raises:
        BagError: None is an MCAP file, one is in another format, or one cannot be read.
    """
    found: list[Contents] = []
    failures = []
    for file in files:
        _refuse_others(file)
        try:
            found.append(read(file))
        except BagError as error:
            failures.append(error)
            loss = Loss(file, 0, file.stat().st_size, 'the file is no MCAP file')
            found.append(Contents(file, losses=[loss]))
    if failures and len(failures) == len(files):
        raise failures[0]
    return found


def _refuse_others(path: Path) -> None:
    with _opened(path) as file:
        start = file.read(16)
    for beginning, what in _OTHERS:
        if start.startswith(beginning):
            raise BagError(f'{path}: {what}')


def told_by(contents: Iterable[Contents], told: BagMetadata | None) -> BagMetadata:
    """Return what metadata.yaml says, or else the last such record in the files."""
    if told is not None:
        return told
    found = BagMetadata()
    for c in contents:
        for record in c.metadata:
            if record.name == metadata.RECORD:
                try:
                    found = metadata.parse(record.metadata.get(metadata.KEY, ''))
                except BagError:
                    continue
    return found


def topic_of(contents: Contents, channel: Channel) -> Topic:
    """Return what a file says of a topic."""
    schema = contents.schemas.get(channel.schema_id)
    about = dict(channel.metadata)
    offered = about.get('offered_qos_profiles', '')
    try:
        profiles = parse_qos(offered) if offered else ()
        about.pop('offered_qos_profiles', None)
    except BagError:
        profiles = ()  # kept as it is, among the extra
    return Topic(
        name=channel.topic,
        type=schema.name if schema else '',
        definition=schema.data.decode(errors='surrogateescape') if schema else '',
        type_hash=about.pop('topic_type_hash', ''),
        qos=profiles,
        serialization_format=channel.message_encoding,
        definition_encoding=schema.encoding if schema else '',
        extra=tuple(about.items()),
    )


def _open(path: Path) -> Bag:
    files, told = mcap_files(path)
    contents = contents_of(files, lambda file: indexed(file) or scanned(file))
    # rosbag2 wants a metadata.yaml in a folder, and one that is up to date.
    count = sum(c.message_count for c in contents)
    whole = path.is_file() if told is None else told.message_count == count
    return Bag(path, tuple(contents), told_by(contents, told), whole=whole)


def _opened(path: Path) -> BinaryIO:
    try:
        return path.open('rb')
    except OSError as error:
        raise BagError(f'{path}: cannot be read ({reason(error)})') from None


def _told(path: Path) -> BagMetadata | None:
    try:
        return metadata.parse(path.read_text(encoding='utf-8'))
    except (BagError, FileNotFoundError, UnicodeDecodeError):
        return None


def _order(path: Path) -> tuple[int, str]:
    match = _NUMBER.search(path.name)
    return int(match[1]) if match else -1, path.name


def _names(contents: Contents, wanted: frozenset[str] | None) -> dict[int, str]:
    return {
        i: channel.topic
        for i, channel in contents.channels.items()
        if wanted is None or channel.topic in wanted
    }


def _messages(path: Path, file: BinaryIO, piece: Chunk, ids: frozenset[int]) -> list[Any]:
    try:
        data = chunk_bytes(file, piece)
        return list(messages(data, ids))
    except DamageError as error:
        raise _damage(path, piece.offset, error) from None
    except OSError as error:
        raise BagError(f'{path}: cannot be read ({reason(error)})') from None


def _damage(path: Path, offset: int, error: DamageError) -> BagError:
    return BagError(
        f'{path}: damaged at byte {offset} ({error}); `repair_bag` makes a bag of all the rest'
    )


def _topics(contents: Iterable[Contents], told: BagMetadata) -> tuple[TopicInfo, ...]:
    counts: dict[str, int] = {}
    topics: dict[str, Topic] = {}
    for c in contents:
        for channel_id, channel in c.channels.items():
            topics.setdefault(channel.topic, topic_of(c, channel))
            counts[channel.topic] = counts.get(channel.topic, 0) + c.counts.get(channel_id, 0)
    for info in told.topics:
        before = topics.setdefault(info.name, info.topic)
        if info.topic.qos and before.qos != info.topic.qos:  # of publishers that came later
            topics[info.name] = replace(before, qos=info.topic.qos)
    return tuple(TopicInfo(topic=t, message_count=counts.get(n, 0)) for n, t in topics.items())


def _decoder(contents: Contents, channel_id: int) -> tuple[str, Callable[[bytes], Any]]:
    """Return the type of a channel and what decodes its messages."""
    channel = contents.channels[channel_id]
    schema = contents.schemas.get(channel.schema_id)
    where = f'{contents.path}: {channel.topic}'
    if schema is None or (not schema.data and schema.encoding != 'ros2msg'):
        found = schemas.definition(schema.name) if schema else None
        if schema is None or found is None:
            raise BagError(f'{where}: the bag has no definition of its type')
        schema = Schema(schema.id, found.encode(), 'ros2msg', schema.name)
    try:
        decode = DecoderFactory().decoder_for(channel.message_encoding, schema)
    except Exception as error:  # the parser raises whatever it stumbles over
        raise BagError(
            f'{where}: the definition of {schema.name} is not understood ({brief(str(error))})'
        ) from None
    if decode is None:
        raise BagError(
            f'{where}: messages in {channel.message_encoding!r} with definitions in '
            f'{schema.encoding!r} cannot be decoded, only cdr with ros2msg'
        )
    return schema.name, decode
