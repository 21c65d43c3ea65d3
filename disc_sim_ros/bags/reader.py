"""Reading a bag: of this package, of `ros2 bag record`, and one whose recorder was killed."""

from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
import struct
from typing import Any, BinaryIO, NamedTuple

from mcap.exceptions import McapError
from mcap.records import Attachment, Channel

from disc_sim_ros.bags import latched, metadata
from disc_sim_ros.bags.bag_folder import BagFolder, bag_folder, read_files
from disc_sim_ros.bags.contents import Chunk, Contents, Loss, attachment_at, chunk_bytes
from disc_sim_ros.bags.decoding import decoder_of
from disc_sim_ros.bags.definitions import filled, topic_of
from disc_sim_ros.bags.mcap_reader import indexed
from disc_sim_ros.bags.mcap_records import ZSTD_MAGIC, decompress_zstd, messages
from disc_sim_ros.bags.mcap_recovery import scanned
from disc_sim_ros.bags.metadata import BagMetadata, TopicInfo
from disc_sim_ros.bags.topic import Qos, Topic, full_type, parse_qos
from disc_sim_ros.errors import BagError, DamageError
from disc_sim_ros.files import reason


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
    """An opened bag. It keeps no file open.

    Attributes:
        path: The folder, or the one file.
        files: The files that are read, in their order.
        metadata: What metadata.yaml or the files report of the whole bag.
        complete: False where something is missing or damaged that `repair_bag` deals with.
        losses: What is damaged or missing.
        custom_data: Free texts of the recorder.
        topics: Topics with the counts of their messages; a topic whose type changed stands once
            for each type.
        message_count: Messages of all topics; latched messages that a file repeats count once.
        start, end: Least and greatest log time [ns]; 0 in a bag without messages.
    """

    def __init__(
        self, folder: BagFolder, contents: Sequence[Contents], about: BagMetadata, *, whole: bool
    ) -> None:
        """Use `open_bag`."""
        self.path = folder.path
        self.metadata = about
        self.files = tuple(c.path for c in contents)
        self.complete = whole and not folder.losses and all(c.complete for c in contents)
        self.losses: tuple[Loss, ...] = (
            *folder.losses,
            *(loss for c in contents for loss in c.losses),
        )
        self._all_contents = tuple(contents)  # unpacked files live as long as these
        self.contents = tuple(c if n == 0 else _without_repeats(c) for n, c in enumerate(contents))
        self.custom_data = dict(about.custom_data)
        self._listed_types = {info.name: info.type for info in about.topics}
        self.topics = _topics(self.contents, about)
        self.message_count = sum(t.message_count for t in self.topics)
        filled_files = [c for c in self.contents if c.chunks]
        self.start = min((c.start for c in filled_files), default=0)
        self.end = max((c.end for c in filled_files), default=0)

    @property
    def attachments(self) -> tuple[Attachment, ...]:
        """The attached files.

        Raises:
            BagError: One is damaged.
        """
        attachments = []
        for contents in self.contents:
            if contents.attachments:
                with _opened(contents) as file:
                    for offset in contents.attachments:
                        try:
                            attachments.append(attachment_at(file, offset))
                        except DamageError as error:
                            raise _damage(contents.path, offset, error) from None
        return tuple(attachments)

    def raw(
        self, names: Iterable[str] | None = None, types: Iterable[str] | None = None
    ) -> Iterator[RawMessage]:
        """Yield messages in the order of their log times.

        Args:
            names: Topics; None for all.
            types: Types such as 'nav_msgs/msg/Odometry', which 'nav_msgs/Odometry' is as well;
                None for all.

        Raises:
            DamageError: A part of a file is damaged that was not known to be.
            BagError: A file cannot be read.
        """
        for name, number, stored in self._stored(names, types):
            data = self._plain(number, stored)
            yield RawMessage(name, stored.log_time, stored.publish_time, data, stored.sequence)

    def messages(
        self, names: Iterable[str] | None = None, types: Iterable[str] | None = None
    ) -> Iterator[Message]:
        """Yield decoded messages, by the definitions in the bag, as `raw` does.

        Raises:
            BagError: As `raw`, and where a message cannot be decoded.
        """
        decoders: dict[tuple[int, int], tuple[str, Callable[[bytes], Any]]] = {}
        for name, number, stored in self._stored(names, types):
            key = number, stored.channel_id
            if key not in decoders:
                decoders[key] = _decoder(
                    self.contents[number], stored.channel_id, self._listed_types.get(name, '')
                )
            type_name, decode = decoders[key]
            try:
                value = decode(self._plain(number, stored))
            except (struct.error, ValueError, IndexError, McapError, MemoryError) as error:
                raise BagError(
                    f'{self.path}: the message on {name} at {stored.log_time} ns is no '
                    f'{type_name} ({error})'
                ) from None
            yield Message(name, type_name, stored.log_time, stored.publish_time, value)

    def _plain(self, number: int, stored: Any) -> bytes:
        """Return the data of a message; rosbag2 compresses each in the mode MESSAGE."""
        data: bytes = stored.data
        if not data.startswith(ZSTD_MAGIC):
            return data
        contents = self.contents[number]
        if contents.channels[stored.channel_id].message_encoding != 'cdr':
            return data  # CDR never begins so; other encodings may
        try:
            return decompress_zstd(data)
        except DamageError as error:
            raise DamageError(
                f'{contents.path}: the message at {stored.log_time} ns is damaged ({error})'
            ) from None

    def _stored(
        self, names: Iterable[str] | None, types: Iterable[str] | None
    ) -> Iterator[tuple[str, int, Any]]:
        """Yield name, number of the file and stored message, in the order of the log times."""
        if isinstance(names, str):
            names = (names,)
        wanted = None if names is None else frozenset(names)
        kinds = None if types is None else frozenset(full_type(name) for name in types)
        channels = [self._names(c, wanted, kinds) for c in self.contents]
        ids = [frozenset(c) for c in channels]
        chunks = sorted(
            (
                (chunk.start, number, chunk.offset, chunk)
                for number, c in enumerate(self.contents)
                for chunk in c.chunks
                if chunk.channels is None or chunk.channels & ids[number]
            ),
        )
        waiting: list[tuple[int, int, Any]] = []  # log time, number of the file, message
        with ExitStack() as stack:
            files: dict[int, BinaryIO] = {}
            for start, number, _, chunk in chunks:
                ready = bisect_right(waiting, start, key=_LOG_TIME)
                for _, n, stored in waiting[:ready]:
                    yield channels[n][stored.channel_id], n, stored
                del waiting[:ready]
                contents = self.contents[number]
                if number not in files:
                    files[number] = stack.enter_context(_opened(contents))
                waiting += (
                    (stored.log_time, number, stored)
                    for stored in _messages(contents.path, files[number], chunk, ids[number])
                )
                waiting.sort(key=_LOG_TIME)
            for _, n, stored in waiting:
                yield channels[n][stored.channel_id], n, stored

    def _names(
        self, contents: Contents, wanted: frozenset[str] | None, kinds: frozenset[str] | None
    ) -> dict[int, str]:
        """Return the topics of the channels of a file that are wanted, by their ids."""
        return {
            i: channel.topic
            for i, channel in contents.channels.items()
            if (wanted is None or channel.topic in wanted)
            and (kinds is None or full_type(self._type_of(contents, channel)) in kinds)
        }

    def _type_of(self, contents: Contents, channel: Channel) -> str:
        schema = contents.schemas.get(channel.schema_id)
        return (schema.name if schema else '') or self._listed_types.get(channel.topic, '')


_LOG_TIME = itemgetter(0)


def open_bag(path: Path | str) -> Bag:
    """Open a bag.

    Args:
        path: The folder, or one file: .mcap, or compressed as .mcap.zstd.

    Raises:
        BagError: It is no bag that can be read; the reason says what it is.
    """
    path = Path(path)
    try:
        folder = bag_folder(path)
        contents = read_files(folder, lambda file, un: indexed(file, un) or scanned(file, un))
    except OSError as error:
        raise BagError(f'{error.filename or path}: cannot be read ({reason(error)})') from None
    return Bag(folder, contents, reported(contents, folder), whole=is_listed(folder, contents))


def is_listed(folder: BagFolder, contents: Sequence[Contents]) -> bool:
    """Return True if metadata.yaml describes what is there; a lone file needs none.

    It must count the messages of all topics and of each, and name no other types than the files.
    """
    about = folder.metadata
    if about is None:
        return folder.path.is_file()
    if about.message_count != sum(c.message_count for c in contents):
        return False
    counts: dict[str, int] = {}
    types: dict[str, set[str]] = {}
    for c in contents:
        for channel_id, channel in c.channels.items():
            schema = c.schemas.get(channel.schema_id)
            counts[channel.topic] = counts.get(channel.topic, 0) + c.counts.get(channel_id, 0)
            types.setdefault(channel.topic, set()).add(full_type(schema.name) if schema else '')
    listed: dict[str, int] = {}
    for info in about.topics:
        listed[info.name] = listed.get(info.name, 0) + info.message_count
        known = types.get(info.name, {''})
        if '' not in known and info.type and full_type(info.type) not in known:
            return False
    return all(counts.get(name, 0) == count for name, count in listed.items())


def reported(contents: Iterable[Contents], folder: BagFolder) -> BagMetadata:
    """Return what metadata.yaml says, or else the last such record in the files.

    `ros2 bag reindex` makes a metadata.yaml without custom data and distribution: these are taken
    from the record.
    """
    record = BagMetadata()
    for c in contents:
        for m in c.metadata:
            if m.name == metadata.RECORD:
                with suppress(BagError):
                    record = metadata.parse_record(m.metadata)
    about = folder.metadata
    if about is None:
        return record
    return replace(
        about,
        custom_data=about.custom_data or record.custom_data,
        ros_distro=about.ros_distro or record.ros_distro,
    )


def repeated_chunk(contents: Contents) -> Chunk | None:
    """Return the chunk in which a file repeats latched messages of before, or None."""
    first = min(contents.chunks, key=lambda c: c.offset, default=None)
    note = next((m for m in contents.metadata if m.name == latched.RECORD), None)
    if first is None or note is None:
        return None
    return first if first.start == first.end == latched.log_time_of(note.metadata) else None


def _without_repeats(contents: Contents) -> Contents:
    """Return what a file holds beside the latched messages that an earlier file has."""
    chunk = repeated_chunk(contents)
    if chunk is None:
        return contents
    counts = dict(contents.counts)
    try:
        with _opened(contents) as file:
            for stored in messages(chunk_bytes(file, chunk)):
                counts[stored.channel_id] -= 1
    except (DamageError, KeyError):
        return contents
    return replace(contents, chunks=[c for c in contents.chunks if c != chunk], counts=counts)


def _opened(contents: Contents) -> BinaryIO:
    try:
        return contents.data_path.open('rb')
    except OSError as error:
        raise BagError(f'{contents.path}: cannot be read ({reason(error)})') from None


def _messages(path: Path, file: BinaryIO, chunk: Chunk, ids: frozenset[int]) -> list[Any]:
    try:
        data = chunk_bytes(file, chunk)
        return list(messages(data, ids))
    except DamageError as error:
        raise _damage(path, chunk.offset, error) from None
    except OSError as error:
        raise BagError(f'{path}: cannot be read ({reason(error)})') from None


def _damage(path: Path, offset: int, error: DamageError) -> DamageError:
    return DamageError(
        f'{path}: damaged at byte {offset} ({error}); `repair_bag` makes a bag of all the rest'
    )


def _topics(contents: Iterable[Contents], about: BagMetadata) -> tuple[TopicInfo, ...]:
    listed = {info.name: info for info in about.topics}
    counts: dict[tuple[str, str], int] = {}
    topics: dict[tuple[str, str], Topic] = {}  # by name and type
    for c in contents:
        for channel_id, channel in c.channels.items():
            topic = topic_of(channel, c.schemas.get(channel.schema_id))
            if not topic.type and topic.name in listed:
                topic = replace(topic, type=listed[topic.name].type)
            key = topic.name, topic.type
            topics.setdefault(key, topic)
            counts[key] = counts.get(key, 0) + c.counts.get(channel_id, 0)
    for info in about.topics:
        keys = [key for key in topics if key[0] == info.name]
        key = (info.name, info.type) if len(keys) != 1 else keys[0]
        before = topics.setdefault(key, info.topic)
        late = about.custom_data.get(metadata.LATE_QOS + info.name)
        offered = info.topic.qos if late is None else _profiles(late)
        if offered and before.qos != offered:  # of publishers that came later
            topics[key] = replace(before, qos=offered)
    return tuple(TopicInfo(topic=t, message_count=counts.get(k, 0)) for k, t in topics.items())


def _profiles(text: str) -> tuple[Qos, ...]:
    try:
        return parse_qos(text)
    except BagError:
        return ()


def _decoder(
    contents: Contents, channel_id: int, type_name: str
) -> tuple[str, Callable[[bytes], Any]]:
    """Return the type of a channel and the function that decodes its messages."""
    channel = contents.channels[channel_id]
    schema = filled(channel, contents.schemas.get(channel.schema_id), type_name)
    try:
        return decoder_of(channel, schema)
    except BagError as error:
        raise BagError(f'{contents.path}: {channel.topic}: {error}') from None
