"""Recorded motion as arrays: the numbers of Odometry and PoseStamped bytes, without ROS."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
import struct

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.bags.reader import RawMessage
from disc_sim_ros.errors import BagError
from disc_sim_ros.topics import MessageType
from disc_sim_ros.units import NANOSECONDS

ODOMETRY, POSE = MessageType.ODOMETRY, MessageType.POSE
COMPONENTS = (
    *(f'position.{axis}_m' for axis in 'xyz'),
    *(f'orientation.{axis}' for axis in 'xyzw'),
    *(f'velocity.{axis}_m_s' for axis in 'xyz'),
    *(f'rate.{axis}_rad_s' for axis in 'xyz'),
)  # names of the numbers of `frames.odometry`, with units
_STAMP = slice(4, 12)
_PREFIX = 12  # bytes of encapsulation and stamp
SHORTEST_QUATERNION = 1e-6  # length of one that has an attitude; one that was not set has 0
_LATEST = 2**63 - 1  # ns; a damaged log time may be later
_STRINGS = {ODOMETRY: 2, POSE: 1}
_TWIST_AT = 7 + 36  # doubles: pose, its covariance
_DOUBLES = {ODOMETRY: _TWIST_AT + 6, POSE: 7}


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """One recorded body, in axes of messages; n is the number of messages, in order of arrival.

    Attributes:
        topic: Its topic.
        frame: The frame of its pose.
        child: The frame of the body; empty for a PoseStamped.
        stamps: Of the headers [ns], shape (n,); the log times where `is_stamped` is False.
        log: When they were received [ns], shape (n,).
        numbers: Position x, y, z [m], quaternion x, y, z, w, and of Odometry the velocity [m/s]
            and the rates [rad/s] in `child`; shape (n, 13) or (n, 7).
        is_stamped: False if the stamps of the headers do not advance, such as all 0.
    """

    topic: str
    frame: str
    child: str
    stamps: IntArray
    log: IntArray
    numbers: FloatArray
    is_stamped: bool = True

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def namespace(self) -> str:
        """Return the namespace of its topic, such as '/red'; empty for the root."""
        return self.topic.rpartition('/')[0]

    @property
    def has_twist(self) -> bool:
        """Return True if velocity and rates were recorded."""
        return int(self.numbers.shape[1]) > 7

    @property
    def position(self) -> FloatArray:
        """Position in `frame` [m], shape (n, 3)."""
        return self.numbers[:, :3]

    @property
    def quaternion(self) -> FloatArray:
        """Attitude x, y, z, w, shape (n, 4)."""
        return self.numbers[:, 3:7]

    @property
    def has_attitude(self) -> bool:
        """Return True if an attitude was recorded: quaternions of length 0 are none."""
        return not len(self) or bool(usable(self.quaternion).any())

    def part(self, rows: slice) -> 'Motion':
        """Return some of the messages."""
        return replace(
            self, stamps=self.stamps[rows], log=self.log[rows], numbers=self.numbers[rows]
        )


def usable(quaternions: FloatArray) -> NDArray[np.bool_]:
    """Return which of some quaternions, shape (n, 4), have an attitude; damaged ones have none."""
    with np.errstate(over='ignore', invalid='ignore'):
        norm = np.linalg.norm(quaternions, axis=1)
    of_use: NDArray[np.bool_] = (norm > SHORTEST_QUATERNION) & (norm < 1.0 / SHORTEST_QUATERNION)
    return of_use


def motions(messages: Iterable[RawMessage], type_name: str) -> list[Motion]:
    """Return the motions in the messages of one type: one for each topic and child frame.

    Args:
        messages: Messages of this type.
        type_name: ODOMETRY or POSE.

    Raises:
        BagError: The bytes are not such a message.
    """
    layouts: dict[bytes, _Layout] = {}
    groups: dict[tuple[str, str, str], list[RawMessage]] = {}
    layout_of: dict[tuple[str, str, str], _Layout] = {}
    for message in messages:
        data = message.data
        layout = next((k for text, k in layouts.items() if data.startswith(text, _PREFIX)), None)
        if layout is None or data[:4] != layout.head:
            layout = _layout(message, type_name)
            layouts[data[_PREFIX : layout.text_end]] = layout
        if len(data) < layout.start + 8 * _DOUBLES[type_name]:
            raise BagError(f'{message.topic}: a message is too short for {type_name}')
        key = (message.topic, layout.frame, layout.child)
        groups.setdefault(key, []).append(message)
        layout_of[key] = layout
    return [_motion(key, group, layout_of[key], type_name) for key, group in groups.items()]


@dataclass(frozen=True, slots=True)
class _Layout:
    """Where the numbers are in messages with the same encapsulation and the same frames."""

    head: bytes
    order: str
    frame: str
    child: str
    text_end: int
    start: int  # of the first double


def _layout(message: RawMessage, type_name: str) -> _Layout:
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
        raise BagError(f'{message.topic}: a message is not a {type_name}') from None
    start = at + (4 - at) % 8  # alignment counts from behind the encapsulation
    frame, child = (*texts, '')[:2]
    return _Layout(data[:4], order, frame, child, at, start)


def _motion(
    key: tuple[str, str, str], group: list[RawMessage], layout: _Layout, type_name: str
) -> Motion:
    size, start = 8 * _DOUBLES[type_name], layout.start
    stamps = np.frombuffer(
        b''.join(m.data[_STAMP] for m in group),
        dtype=[('sec', f'{layout.order}i4'), ('nanosec', f'{layout.order}u4')],
    )
    doubles = np.frombuffer(
        b''.join(m.data[start : start + size] for m in group), dtype=f'{layout.order}f8'
    ).reshape(len(group), -1)
    numbers = doubles[:, :7]
    # Without attitudes a twist, in the axes of the body, has no direction.
    oriented = usable(numbers[:, 3:7]).any()
    if type_name == ODOMETRY and oriented and not _lacks_twist(numbers, doubles[:, _TWIST_AT:]):
        numbers = np.hstack([numbers, doubles[:, _TWIST_AT:]])
    nanoseconds = stamps['sec'].astype(np.int64) * NANOSECONDS + stamps['nanosec']
    log = np.array([min(m.log_time, _LATEST) for m in group], dtype=np.int64)
    is_stamped = not _stands_still(nanoseconds) or _stands_still(log)
    return Motion(
        *key,
        stamps=nanoseconds if is_stamped else log,
        log=log,
        numbers=numbers.astype(float),
        is_stamped=is_stamped,
    )


def _lacks_twist(pose: FloatArray, twist: FloatArray) -> bool:
    """Return True if a body moves and every twist is 0 or not a number: nothing measured it."""
    return not np.nan_to_num(twist).any() and len(np.unique(pose[:, :3], axis=0)) > 1


def _stands_still(times: IntArray) -> bool:
    """Return True if all of several times are the same."""
    return len(times) > 1 and bool((times == times[0]).all())
