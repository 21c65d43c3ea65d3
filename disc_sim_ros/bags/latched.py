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

from disc_sim_ros.bags.definitions import Definition
from disc_sim_ros.bags.mcap_writer import McapFile
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

    def repeat(
        self, file: McapFile, definitions: Mapping[int, Definition], log_time: int, max_size: float
    ) -> list[int]:
        """Begin a file with the messages, in a chunk of their own.

        Args:
            file: A new one.
            definitions: By topic id.
            log_time: Of the first message to come [ns].
            max_size: Of the file [bytes].

        Returns:
            The topic id of each message.

        Raises:
            OSError: The system refuses; nothing is lost, the messages are in an earlier file.
        """
        messages = self._to_repeat(max_size)
        if messages:
            try:
                file.add_metadata(RECORD, {LOG_TIME: str(log_time), COUNT: str(len(messages))})
                for topic_id, m in messages:
                    file.write(definitions[topic_id], m.data, log_time, m.publish_time, m.sequence)
                file.end_chunk()
            except OSError:
                file.drop_chunk()
                raise
        return [topic_id for topic_id, _ in messages]

    def _to_repeat(self, max_size: float) -> list[tuple[int, Kept]]:
        """Return topic ids and messages; no large ones that would fill a file."""
        room = max_size / _SHARE
        sizes = {i: sum(len(m.data) for m in kept) for i, kept in self.by_topic.items()}
        chosen = set()
        for topic_id in sorted(sizes, key=lambda i: sizes[i]):
            room -= sizes[topic_id]
            if room < 0:
                break
            chosen.add(topic_id)
        return [(i, m) for i, kept in self.by_topic.items() if i in chosen for m in kept]


def log_time_of(content: Mapping[str, str]) -> int | None:
    """Return the log time [ns] of repeated messages; None where the record is not understood."""
    try:
        return int(content[LOG_TIME])
    except (KeyError, ValueError):
        return None
