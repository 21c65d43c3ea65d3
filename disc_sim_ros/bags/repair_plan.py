"""What a repaired bag says of its topics, and which of its files can be copied as they are."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

from mcap.records import Schema

from disc_sim_ros.bags import metadata
from disc_sim_ros.bags.contents import Chunk, Contents, chunk_bytes
from disc_sim_ros.bags.definitions import (
    Definition,
    channel_of,
    filled,
    schema_of,
    topic_of,
    with_qos,
)
from disc_sim_ros.bags.mcap_reader import indexed
from disc_sim_ros.bags.mcap_records import ZSTD_MAGIC, messages
from disc_sim_ros.bags.metadata import BagMetadata, TopicInfo
from disc_sim_ros.bags.topic import Qos, Topic
from disc_sim_ros.errors import DamageError

ROS_PROFILE = 'ros2'
_LARGEST_ID = 65535  # of channels and schemas


class RepairPlan:
    """Decides how each file of a bag is repaired.

    Attributes:
        about: What is known of the whole bag, with the compression that its messages have.
    """

    def __init__(self, about: BagMetadata, all_contents: Sequence[Contents]) -> None:
        self.about = _own_compression(about, all_contents)
        self._types = {t.name: t.type for t in about.topics}
        self._qos = _profiles(about, all_contents)

    def why_rewrite(self, contents: Contents) -> list[str]:
        """Return what is wrong with a file; nothing if it can be copied as it is."""
        reasons = []
        if not contents.complete:
            reasons.append('it was damaged or had no end')
        else:
            index = indexed(contents.path, contents.unpacked)
            if index is None:
                reasons.append('it had no full index')
            elif not _agree(index, contents):
                reasons.append('its index was wrong')
        records = [m.metadata for m in contents.metadata if m.name == metadata.RECORD]
        if any(metadata.has_root(content) for content in records):
            reasons.append('rosbag2 refused the form of its metadata record')
        if contents.in_summary_only:
            reasons.append('definitions stood in the summary alone')
        made = self.definitions(contents)
        without, qos = [], []
        for channel_id, channel in contents.channels.items():
            if made[channel_id].schema != contents.schemas.get(channel.schema_id):
                without.append(channel.topic)
            elif made[channel_id].channel != channel:
                qos.append(channel.topic)
        if without:
            reasons.append(f'a definition was missing: {", ".join(without)}')
        if qos:
            reasons.append(f'the QoS was not that of metadata.yaml: {", ".join(qos)}')
        return reasons

    def profile(self, contents: Contents) -> str:
        """Return the profile of the header of a file; of a lost one by its messages."""
        if contents.profile is not None:
            return contents.profile
        ros = any(c.message_encoding == 'cdr' for c in contents.channels.values())
        return ROS_PROFILE if ros else ''

    def definitions(self, contents: Contents) -> dict[int, Definition]:
        """Return the definitions of the channels of a file by channel id.

        They are as they are in the file, but for what is missing and for QoS that differs from
        that of metadata.yaml: rosbags leaves out the messages of such channels.
        """
        definitions = {}
        schemas = dict(contents.schemas)
        for channel_id, channel in contents.channels.items():
            schema = schemas.get(channel.schema_id) if channel.schema_id else None
            if channel.schema_id and schema is None:  # lost
                schema = Schema(id=channel.schema_id, data=b'', encoding='', name='')
            schema = filled(channel, schema, self._types.get(channel.topic, ''))
            defined = channel
            if schema is not None and not channel.schema_id:  # metadata.yaml names the type
                schema = replace(schema, id=_free(schemas))
                schemas[schema.id] = schema
                defined = replace(channel, schema_id=schema.id)
            if channel.topic in self._qos:
                defined = with_qos(defined, self._qos[channel.topic])
            definitions[channel_id] = Definition.of(defined, schema)
        return definitions

    def silent(self, definitions: dict[int, Definition]) -> list[Definition]:
        """Return the definitions of topics that metadata.yaml names and a file does not."""
        names = {d.channel.topic for d in definitions.values()}
        schemas = {d.schema.id: d.schema for d in definitions.values() if d.schema}
        channels = set(definitions)
        made = []
        for topic in (t.topic for t in self.about.topics if t.topic.name not in names):
            empty = schema_of(replace(topic, definition=None), _free(schemas))
            channel = channel_of(topic, _free(channels), empty.id)
            schema = filled(channel, empty) or empty
            same = [s for s in schemas.values() if replace(s, id=schema.id) == schema]
            schema = same[0] if same else schema
            schemas[schema.id] = schema
            channels.add(channel.id)
            made.append(Definition.of(replace(channel, schema_id=schema.id), schema))
        return made

    def topics(self, written: Iterable[TopicInfo]) -> tuple[TopicInfo, ...]:
        """Return the topics of metadata.yaml: those of the files, then those without messages."""
        topics: dict[tuple[str, str], Topic] = {}
        counts: dict[tuple[str, str], int] = {}
        for info in written:
            key = info.name, info.type
            topics.setdefault(key, info.topic)
            counts[key] = counts.get(key, 0) + info.message_count
        for topic in (t.topic for t in self.about.topics):
            key, untyped = (topic.name, topic.type), (topic.name, '')
            if untyped in topics:
                topics[key] = replace(topics.pop(untyped), type=topic.type)
                counts[key] = counts.pop(untyped)
            elif all(topic.name != name for name, _ in topics):
                topics[key] = topic
        return tuple(
            TopicInfo(topic=topic, message_count=counts.get(key, 0))
            for key, topic in topics.items()
        )


def _agree(index: Contents, contents: Contents) -> bool:
    """Return True if the index of a file agrees with what is in it."""
    chunks = {c.offset: c for c in index.chunks}
    return (
        {i: n for i, n in index.counts.items() if n} == contents.counts
        and index.channels == contents.channels
        and index.schemas.items() <= contents.schemas.items()
        and sorted(index.attachments) == contents.attachments
        and all(c.offset in chunks and _covers(chunks[c.offset], c) for c in contents.chunks)
    )


def _covers(indexed_chunk: Chunk, chunk: Chunk) -> bool:
    if (indexed_chunk.start, indexed_chunk.end) != (chunk.start, chunk.end):
        return False
    channels = indexed_chunk.channels
    return channels is None or channels >= (chunk.channels or frozenset())


def _profiles(about: BagMetadata, all_contents: Sequence[Contents]) -> dict[str, tuple[Qos, ...]]:
    """Return the QoS of each topic: that of metadata.yaml, or the longest list in a file."""
    profiles: dict[str, tuple[Qos, ...]] = {}
    for contents in all_contents:
        for channel in contents.channels.values():
            offered = topic_of(channel, None).qos
            if channel.message_encoding == 'cdr' and len(offered) > len(
                profiles.get(channel.topic, ())
            ):
                profiles[channel.topic] = offered
    return profiles | {t.name: t.topic.qos for t in about.topics if t.topic.qos}


def _own_compression(about: BagMetadata, all_contents: Iterable[Contents]) -> BagMetadata:
    """Return metadata with the compression that the messages have; files are never compressed."""
    if any(_has_compressed_messages(contents) for contents in all_contents):
        return replace(about, compression_format='zstd', compression_mode='MESSAGE')
    return replace(about, compression_format='', compression_mode='')


def _has_compressed_messages(contents: Contents) -> bool:
    cdr = frozenset(i for i, c in contents.channels.items() if c.message_encoding == 'cdr')
    with contents.data_path.open('rb') as file:
        for chunk in contents.chunks:
            try:
                first = next(messages(chunk_bytes(file, chunk), cdr), None)
            except DamageError:
                continue
            if first is not None:
                return first.data.startswith(ZSTD_MAGIC)
    return False


def _free(used: Collection[int]) -> int:
    """Return an id that is not in use."""
    number = max(used, default=0) + 1
    if number <= _LARGEST_ID:
        return number
    return next(n for n in range(1, _LARGEST_ID + 1) if n not in used)
