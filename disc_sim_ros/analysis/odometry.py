"""Recorded motion as arrays: Odometry and PoseStamped taken out of their bytes, without ROS."""

from collections.abc import Iterable
from dataclasses import dataclass
import struct

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.bags.reader import RawMessage
from disc_sim_ros.errors import BagError

IntArray = NDArray[np.int64]

ODOMETRY = 'nav_msgs/msg/Odometry'
POSE = 'geometry_msgs/msg/PoseStamped'
COMPONENTS = (
    *(f'position.{axis}_m' for axis in 'xyz'),
    *(f'orientation.{axis}' for axis in 'xyzw'),
    *(f'velocity.{axis}_m_s' for axis in 'xyz'),
    *(f'rate.{axis}_rad_s' for axis in 'xyz'),
)  # of an Odometry, in the order of `Motion.numbers`
_STAMP = slice(4, 12)
_PREFIX = 12  # bytes of encapsulation and stamp
_LATEST = 2**63 - 1  # ns; a damaged log time may be later
_STRINGS = {ODOMETRY: 2, POSE: 1}
_TWIST_AT = 7 + 36  # doubles: pose, its covariance
_DOUBLES = {ODOMETRY: _TWIST_AT + 6, POSE: 7}


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """One recorded body, in axes of messages; n is the number of messages, in order of arrival.

    Attributes:
        topic: Its topic.
        frame: In which its pose is given.
        child: The frame of the body; empty for a PoseStamped.
        stamps: Of the headers [ns], shape (n,).
        log: When they were received [ns], shape (n,).
        numbers: Position x, y, z [m], quaternion x, y, z, w, and of Odometry the velocity [m/s]
            and the rates [rad/s] in `child`; shape (n, 13) or (n, 7).
    """

    topic: str
    frame: str
    child: str
    stamps: IntArray
    log: IntArray
    numbers: FloatArray

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def has_twist(self) -> bool:
        """Say whether velocity and rates were recorded."""
        return int(self.numbers.shape[1]) > 7

    @property
    def position(self) -> FloatArray:
        """Position in `frame` [m], shape (n, 3)."""
        return self.numbers[:, :3]

    @property
    def quaternion(self) -> FloatArray:
        """Attitude x, y, z, w, shape (n, 4)."""
        return self.numbers[:, 3:7]

    def part(self, rows: slice) -> 'Motion':
        """Return some of the messages."""
        return Motion(
            self.topic,
            self.frame,
            self.child,
            self.stamps[rows],
            self.log[rows],
            self.numbers[rows],
        )


def motions(messages: Iterable[RawMessage], type_name: str) -> list[Motion]:
    """Return the motions in the messages of topics of one type, one a topic and child frame.

    Args:
        messages: Of this type.
        type_name: ODOMETRY or POSE.

    Raises:
        BagError: The bytes are no such message.
    """
    kinds: dict[bytes, _Kind] = {}
    found: dict[tuple[str, str, str], list[RawMessage]] = {}
    starts: dict[tuple[str, str, str], _Kind] = {}
    for message in messages:
        data = message.data
        kind = next((k for text, k in kinds.items() if data.startswith(text, _PREFIX)), None)
        if kind is None or data[:4] != kind.head:
            kind = _kind(message, type_name)
            kinds[data[_PREFIX : kind.text_end]] = kind
        if len(data) < kind.start + 8 * _DOUBLES[type_name]:
            raise BagError(f'{message.topic}: a message is too short for {type_name}')
        key = (message.topic, kind.frame, kind.child)
        found.setdefault(key, []).append(message)
        starts[key] = kind
    return [_motion(key, group, starts[key], type_name) for key, group in found.items()]


@dataclass(frozen=True, slots=True)
class _Kind:
    """Where the numbers are in messages that begin alike."""

    head: bytes
    order: str
    frame: str
    child: str
    text_end: int
    start: int  # of the first double


def _kind(message: RawMessage, type_name: str) -> _Kind:
    data = message.data
    if len(data) < _PREFIX or data[0] != 0 or data[1] not in {0, 1}:
        raise BagError(f'{message.topic}: a message is not serialised as CDR')
    order = '<' if data[1] else '>'
    texts, at = [], _PREFIX
    try:
        for _ in range(_STRINGS[type_name]):
            at += -at % 4
            (length,) = struct.unpack_from(f'{order}I', data, at)
            texts.append(data[at + 4 : at + 3 + length].decode())
            at += 4 + length
    except (struct.error, UnicodeDecodeError):
        raise BagError(f'{message.topic}: a message is no {type_name}') from None
    start = at + (4 - at) % 8  # alignment counts from behind the encapsulation
    frame, child = (*texts, '')[:2]
    return _Kind(data[:4], order, frame, child, at, start)


def _motion(
    key: tuple[str, str, str], group: list[RawMessage], kind: _Kind, type_name: str
) -> Motion:
    size, start = 8 * _DOUBLES[type_name], kind.start
    stamps = np.frombuffer(
        b''.join(m.data[_STAMP] for m in group),
        dtype=[('sec', f'{kind.order}i4'), ('nanosec', f'{kind.order}u4')],
    )
    doubles = np.frombuffer(
        b''.join(m.data[start : start + size] for m in group), dtype=f'{kind.order}f8'
    ).reshape(len(group), -1)
    parts = [doubles[:, :7]]
    if type_name == ODOMETRY:
        parts.append(doubles[:, _TWIST_AT:])
    return Motion(
        *key,
        stamps=stamps['sec'].astype(np.int64) * 1_000_000_000 + stamps['nanosec'],
        log=np.array([min(m.log_time, _LATEST) for m in group], dtype=np.int64),
        numbers=np.hstack(parts).astype(float),
    )
