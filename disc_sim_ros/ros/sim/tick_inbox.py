"""The command topics in compiled code: messages are taken, checked, and wait for their time.

What `Commands.accept` accepts at once is accepted here; Python gets everything else, as bytes.
Import this module only where `jit.COMPILED`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.kernels.jit import inline
from disc_sim_ros.physics.kernels.native import call, load_byte, load_float, load_int32

MOMENT, COEFFICIENTS = range(2)  # places of these topics in `Commands.all`
QUEUE = 16  # commands of one topic that wait in compiled code; those beyond wait in Python
NEAR = 20_000_000  # ns; commands stamped further ahead wait in Python
OK = 0  # return code of rcl
SECOND = 1_000_000_000  # ns
_MOST_TAKEN = 256

Ints = NDArray[np.int64]


class Functions(NamedTuple):
    """Addresses of C functions."""

    publish: int  # rcl_publish_serialized_message
    take: int  # rcl_take_serialized_message
    publisher_count: int  # rcl_subscription_get_publisher_count
    time: int  # clock_gettime
    sleep: int  # clock_nanosleep


class Inbox(NamedTuple):
    """The command topics."""

    subscriptions: Ints  # addresses of rcl_subscription_t, shape (4,)
    address: int  # of `message`
    message: Ints  # a rcl_serialized_message_t: buffer, length, ...; shape (8,)
    frames: NDArray[np.uint8]  # names of disc, disc_body, disc_air; shape (3, longest name)
    lengths: Ints  # of the names, shape (3,)
    highest: FloatArray  # greatest magnitude of x, y, z of a moment and of coefficients, (2, 3)
    end_of_time: int  # s, the first stamp that is refused
    stamps: Ints  # of the commands that wait, in order; shape (2, QUEUE)
    queue: FloatArray  # x, y, z and axes of those commands, shape (2, QUEUE, 4)
    waiting: Ints  # their numbers, shape (2,)
    accepted: Ints  # numbers of commands accepted, shape (2,)


@inline
def is_watched(c: Functions, inbox: Inbox, number: Ints, address: int) -> bool:
    """Return True if a publisher of commands is matched; `number` at `address` is overwritten."""
    count = 0
    for i in range(len(inbox.subscriptions)):
        number[0] = 0
        call(c.publisher_count, inbox.subscriptions[i], address, 0, 0)
        count += number[0]
    return count > 0


@inline
def poll(c: Functions, inbox: Inbox, now: int) -> int:
    """Take commands; return the topic of one that Python must look at, or -1."""
    for i in range(len(inbox.subscriptions)):
        for _ in range(_MOST_TAKEN):
            code = call(c.take, inbox.subscriptions[i], inbox.address, 0, 0)
            if code != OK:
                break  # an error, too: Python gets it the next time that it takes a message
            if i > COEFFICIENTS or not _accept(inbox, i, now):
                return i
    return -1


@inline
def _accept(inbox: Inbox, topic: int, now: int) -> bool:
    """Let a command wait for its time, as `Commands.accept`; return False for Python's."""
    start, length = inbox.message[0], inbox.message[1]
    if length < 16 or load_byte(start) != 0 or load_byte(start + 1) != 1:
        return False
    sec, nanosec = int(load_int32(start + 4)), int(load_int32(start + 8))
    characters = int(load_int32(start + 12))
    fits = 0 <= characters <= length - 16
    if sec >= inbox.end_of_time or not 0 <= nanosec < SECOND or not fits:
        return False
    axes = _axes(inbox, topic, start + 16, characters)
    place = 4 + (12 + characters + 7) // 8 * 8
    end = place + (48 if topic == MOMENT else 24)
    if axes < 0 or end > length:
        return False
    for at in range(place, end - 24, 8):
        if load_float(start + at) != 0.0:  # a force
            return False
    x, y, z = (
        load_float(start + end - 24),
        load_float(start + end - 16),
        load_float(start + end - 8),
    )
    highest = inbox.highest[topic]
    if not (abs(x) <= highest[0] and abs(y) <= highest[1] and abs(z) <= highest[2]):
        return False
    if topic == MOMENT:
        x, y, z = frames.flip_yz((x, y, z))
    return _enqueue(inbox, topic, now, max(sec * SECOND + nanosec, now), (x, y, z), axes)


@inline
def _axes(inbox: Inbox, topic: int, start: int, characters: int) -> int:
    """Return the axes that the characters of a frame name, or -1; the last of them is a 0."""
    last = len(inbox.lengths) - 1
    if characters > 0 and load_byte(start + characters - 1) != 0:
        return -1
    if characters <= 1:
        return last
    for i in range(last if topic == COEFFICIENTS else 0, last + 1):
        if inbox.lengths[i] == characters - 1:
            same = True
            for k in range(characters - 1):
                same = same and load_byte(start + k) == inbox.frames[i, k]
            if same:
                return i
    return -1


@inline
def _enqueue(  # noqa: PLR0917
    inbox: Inbox, topic: int, now: int, at: int, value: tuple[float, float, float], axes: int
) -> bool:
    stamps, queue = inbox.stamps[topic], inbox.queue[topic]
    if at == now:
        drop(inbox, topic, count_due(inbox, topic, now))  # superseded
    n = inbox.waiting[topic]
    if n == QUEUE or at > now + NEAR:
        return False
    i = n
    while i > 0 and stamps[i - 1] > at:
        stamps[i] = stamps[i - 1]
        for k in range(4):
            queue[i, k] = queue[i - 1, k]
        i -= 1
    stamps[i] = at
    queue[i, 0], queue[i, 1], queue[i, 2], queue[i, 3] = value[0], value[1], value[2], axes
    inbox.waiting[topic] = n + 1
    inbox.accepted[topic] += 1
    return True


@inline
def count_due(inbox: Inbox, topic: int, now: int) -> int:
    """Return how many of the waiting commands of a topic act at a stamp [ns]."""
    n = 0
    while n < inbox.waiting[topic] and inbox.stamps[topic, n] <= now:
        n += 1
    return n


@inline
def drop(inbox: Inbox, topic: int, count: int) -> None:
    """Remove the first commands of a queue."""
    if count > 0:
        rest = inbox.waiting[topic] - count
        for i in range(rest):
            inbox.stamps[topic, i] = inbox.stamps[topic, i + count]
            for k in range(4):
                inbox.queue[topic, i, k] = inbox.queue[topic, i + count, k]
        inbox.waiting[topic] = rest
