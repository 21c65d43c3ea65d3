"""Latched messages, repeated at the beginning of each further file of a bag.

A subscription that comes late gets the last messages of a transient-local publisher. A file of a
split bag that is played or viewed alone should give the same, so the writer begins it with these
messages: their publish times are the original ones, their log time is that of the first message of
the file. They fill one chunk, and an MCAP metadata record in front of it counts them, so that a
reader of the whole bag can leave them out.
"""

from collections import deque
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from disc_sim_ros.bags.topic import Topic

RECORD = 'disc_sim_ros/repeated_messages'  # name of the MCAP metadata record
LOG_TIME, COUNT = 'log_time', 'message_count'  # its keys
MOST = 100  # messages kept of one topic
_SHARE = 4  # at most this part of a file of limited size repeats messages


class Kept(NamedTuple):
    """A latched message."""

    data: bytes
    publish_time: int  # ns
    sequence: int


class LatchedMessages:
    """The last messages of each latched topic.

    Attributes:
        by_topic: Messages by the id of their topic, the oldest first. Append to them.
    """

    def __init__(self) -> None:
        self.by_topic: dict[int, deque[Kept]] = {}

    def set_topic(self, topic_id: int, topic: Topic) -> None:
        """Keep the messages of a topic if a publisher is latched: as many as they all keep."""
        depth = sum(
            MOST if p.history == 'keep_all' else max(p.depth, 1)  # 0: DDS does not report it
            for p in topic.qos
            if p.durability == 'transient_local'
        )
        if depth:
            before: Iterable[Kept] = self.by_topic.get(topic_id, ())
            self.by_topic[topic_id] = deque(before, maxlen=min(depth, MOST))

    def to_repeat(self, max_size: float) -> list[tuple[int, Kept]]:
        """Return topic ids and messages to repeat, in a file of a largest size [bytes].

        Topics with large messages are left out where the messages would fill the file.
        """
        room = max_size / _SHARE
        sizes = {i: sum(len(m.data) for m in kept) for i, kept in self.by_topic.items()}
        chosen = set()
        for topic_id in sorted(sizes, key=lambda i: sizes[i]):
            room -= sizes[topic_id]
            if room < 0:
                break
            chosen.add(topic_id)
        return [(i, m) for i, kept in self.by_topic.items() if i in chosen for m in kept]


def record(log_time: int, count: int) -> dict[str, str]:
    """Return the content of the metadata record in front of repeated messages."""
    return {LOG_TIME: str(log_time), COUNT: str(count)}


def log_time_of(content: Mapping[str, str]) -> int | None:
    """Return the log time [ns] of repeated messages; None where the record is not understood."""
    try:
        return int(content[LOG_TIME])
    except (KeyError, ValueError):
        return None
