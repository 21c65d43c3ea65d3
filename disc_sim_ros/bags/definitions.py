"""Between a topic and the MCAP records that define it: its channel and its schema."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, McapRecord, Schema

from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.topic import Qos, Topic, parse_qos, qos_yaml
from disc_sim_ros.errors import BagError

_QOS = 'offered_qos_profiles'
_HASH = 'topic_type_hash'
_NO_ENCODING = ('', 'unknown')  # of the MCAP specification, and of rosbag2


@dataclass(frozen=True, slots=True)
class Definition:
    """A channel and its schema, ready to be written into a file."""

    channel: Channel
    schema: Schema | None  # None: schema id 0, the channel has none
    packed: bytes  # the records, schema first

    @classmethod
    def of(cls, channel: Channel, schema: Schema | None) -> 'Definition':
        """Serialise the records."""
        records = (channel,) if schema is None else (schema, channel)
        return cls(channel, schema, b''.join(record_bytes(r) for r in records))


def record_bytes(record: McapRecord) -> bytes:
    """Return a record with its opcode and length."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def channel_of(topic: Topic, channel_id: int, schema_id: int) -> Channel:
    """Return the channel of a topic, as rosbag2 writes it."""
    return Channel(
        id=channel_id,
        topic=topic.name,
        message_encoding=topic.serialization_format,
        metadata={_QOS: qos_yaml(topic.qos), _HASH: topic.type_hash},
        schema_id=schema_id,
    )


def with_qos(channel: Channel, profiles: Sequence[Qos]) -> Channel:
    """Return a channel that has these profiles; the same one where it has them already."""
    if topic_of(channel, None).qos == tuple(profiles):
        return channel
    return replace(channel, metadata={**channel.metadata, _QOS: qos_yaml(profiles)})


def schema_of(topic: Topic, schema_id: int) -> Schema:
    """Return the schema of a topic; without a definition its encoding and its data are empty."""
    known = topic.definition is not None
    return Schema(
        id=schema_id,
        name=topic.type,
        encoding=topic.definition_encoding if known else '',
        data=(topic.definition or '').encode(errors='surrogateescape'),
    )


def topic_of(channel: Channel, schema: Schema | None) -> Topic:
    """Return what a channel and its schema report of a topic."""
    try:
        offered = parse_qos(channel.metadata.get(_QOS) or '[]')
    except BagError:
        offered = ()
    known = schema is not None and not is_missing(schema)
    return Topic(
        name=channel.topic,
        type=schema.name if schema else '',
        definition=schema.data.decode(errors='surrogateescape') if schema and known else None,
        type_hash=channel.metadata.get(_HASH, ''),
        qos=offered,
        serialization_format=channel.message_encoding,
        definition_encoding=schema.encoding if schema else '',
    )


def is_missing(schema: Schema) -> bool:
    """Return True if a schema names a type and defines nothing.

    An empty `ros2msg` schema is the definition of a type without fields.
    """
    return not schema.data and schema.encoding in _NO_ENCODING


def filled(channel: Channel, schema: Schema | None, type_name: str = '') -> Schema | None:
    """Return a schema with the installed definition of its type where it has none.

    Args:
        channel: Its channel. Definitions are known for messages in CDR.
        schema: As the file has it; None where it has none.
        type_name: What metadata.yaml says, for a channel without a schema.

    Returns:
        The schema itself where nothing is missing or nothing is installed; it has the id
        `channel.schema_id`. None where neither the file nor metadata.yaml names a type.
    """
    if channel.message_encoding != 'cdr' or (schema is not None and not is_missing(schema)):
        return schema
    name = (schema.name if schema else '') or type_name
    if not name:
        return schema
    text = schemas.definition(name)
    empty = schema or Schema(id=channel.schema_id, data=b'', encoding='', name=name)
    if text is None:
        return replace(empty, name=name, encoding='')
    return replace(empty, name=name, encoding='ros2msg', data=text.encode())
