"""Decoding messages by the definitions that a bag holds."""

from collections.abc import Callable
from dataclasses import replace
import re
from typing import Any

from mcap.records import Channel, Schema
from mcap_ros2.decoder import DecoderFactory

from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.definitions import is_missing
from disc_sim_ros.errors import BagError, brief

_SERVICE = b'=' * 80 + b'\nSRV: '
# A type at the beginning of a line: of a field, or in the heading of a definition.
_TYPE = re.compile(r'^(\s*(?:MSG: )?(?:\w+/)*)([A-Z]\w*_\w*)(?=[\[\s]|$)', re.MULTILINE)


def decoder_of(channel: Channel, schema: Schema | None) -> tuple[str, Callable[[bytes], Any]]:
    """Return the type of a channel and the function that decodes its messages.

    Raises:
        BagError: There is no definition of the type, or it is not understood.
    """
    if schema is None or is_missing(schema):
        raise BagError('the bag has no definition of its type')
    try:
        decode = _decoder(channel, schema)
    except Exception as error:  # the parser raises errors of many kinds
        is_service = schema.data.startswith(_SERVICE)  # rosbag2 keeps a .srv file for its events
        text = schemas.definition(schema.name) if is_service else None
        if text is None:
            raise BagError(
                f'the definition of {schema.name} is not understood ({brief(str(error))})'
            ) from None
        decode = _decoder(channel, replace(schema, encoding='ros2msg', data=text.encode()))
    if decode is None:
        raise BagError(
            f'messages in {channel.message_encoding!r} with definitions in '
            f'{schema.encoding!r} cannot be decoded, only cdr with ros2msg'
        )
    return schema.name, decode


def _decoder(channel: Channel, schema: Schema) -> Callable[[bytes], Any] | None:
    plain = schema
    if '_' in schema.name.rsplit('/', 1)[-1]:
        plain = _without_underscores(schema)
    decode: Callable[[bytes], Any] | None = DecoderFactory().decoder_for(
        channel.message_encoding, plain
    )
    return decode


def _without_underscores(schema: Schema) -> Schema:
    """Rename the types that rosidl makes of services and actions; the parser refuses their `_`."""
    package, _, name = schema.name.rpartition('/')
    text = _TYPE.sub(lambda m: m[1] + m[2].replace('_', ''), schema.data.decode())
    return replace(schema, name=f'{package}/{name.replace("_", "")}', data=text.encode())
