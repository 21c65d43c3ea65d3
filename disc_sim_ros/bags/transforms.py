"""`/tf` made from recorded transforms, for bags of machines without tf2_msgs.

A tf2_msgs/TFMessage is a list of TransformStamped: its bytes are a count and those messages, with
other padding. RViz and Rerun then show a bag whose transforms were sent on other topics.
"""

from collections.abc import Iterable
from importlib.util import find_spec
import struct

from disc_sim_ros import topics
from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.topic import Qos, Topic

TRANSFORM = 'geometry_msgs/msg/TransformStamped'
TF_MESSAGE = 'tf2_msgs/msg/TFMessage'
NOTE = 'made'  # key of `custom_data`, before the name of the topic
# The type description of tf2_msgs of Jazzy, which is the same in all its versions.
_HASH = 'RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087'
_RULE = '=' * 80
_HEAD = b'\x00\x01\x00\x00'  # CDR, little endian
_STAMP = struct.Struct('<iI')
_VALUES = struct.Struct('<7d')


def is_needed() -> bool:
    """Return True if tf2_msgs is not installed, so that nothing publishes `/tf` here."""
    return find_spec('tf2_msgs') is None


def note(sources: Iterable[str]) -> tuple[str, str]:
    """Return key and text of `custom_data` for a `/tf` that is made from topics."""
    return f'{NOTE} {topics.TF}', f'from {", ".join(sorted(sources))}: no tf2_msgs is installed'


def tf_topic() -> Topic:
    """Return the description of `/tf`, as of a topic of an installed tf2_msgs."""
    return Topic(
        name=topics.TF,
        type=TF_MESSAGE,
        definition=schemas.definition(TF_MESSAGE) or _definition(),
        type_hash=schemas.type_hash(TF_MESSAGE) or _HASH,
        qos=(Qos(history='unknown', depth=0, reliability='reliable', durability='volatile'),),
    )


def tf_message(transform: bytes) -> bytes | None:
    """Return a TFMessage with one transform.

    Args:
        transform: A serialised TransformStamped.

    Returns:
        The serialised message; None if the bytes are not little-endian CDR or are too short.
    """
    if transform[:2] != _HEAD[:2]:
        return None
    body = transform[4:]
    try:
        end = _end_of_texts(body)
        values = _VALUES.unpack_from(body, end + -end % 8)
    except struct.error:
        return None
    moved = struct.pack('<I', 1) + body[:end]
    return _HEAD + moved + bytes(-len(moved) % 8) + _VALUES.pack(*values)


def _end_of_texts(body: bytes) -> int:
    """Return where the stamp and both names of frames end."""
    at = _STAMP.size
    for _ in range(2):
        at += -at % 4
        (length,) = struct.unpack_from('<I', body, at)
        at += 4 + length
    return at


def _definition() -> str | None:
    """Return the definition of a TFMessage from that of its transforms."""
    held = schemas.definition(TRANSFORM)
    if held is None:
        return None
    own = f'{TRANSFORM.replace("/msg/", "/")}'
    return f'{own}[] transforms\n\n{_RULE}\nMSG: {own}\n{held}'
