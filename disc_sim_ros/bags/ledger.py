"""What a bag in the making holds: its topics, its files, and the metadata that tells of them."""

from collections.abc import Mapping

from disc_sim_ros.bags import metadata
from disc_sim_ros.bags.mcap_writer import Definition, McapFile
from disc_sim_ros.bags.metadata import BagMetadata, FileInfo, TopicInfo
from disc_sim_ros.bags.topic import Topic


class Ledger:
    """Topics and files of one bag."""

    def __init__(self, ros_distro: str, custom: Mapping[str, str]) -> None:
        self.topics: dict[int, Topic] = {}
        self.definitions: dict[int, Definition] = {}
        self.definitions_size = 0  # bytes
        self.custom = dict(custom)
        self.files: list[FileInfo] = []  # those with their end
        self.size = 0  # bytes of these
        self.text_size = 0  # bytes of the last metadata
        self._counts: dict[int, int] = {}  # messages in these, by topic
        self._schemas: dict[tuple[str, str], int] = {}  # type, definition: schema id
        self._ros_distro = ros_distro

    def set(self, topic_id: int, topic: Topic) -> Definition:
        """Note a topic, or what is new of it; return its records."""
        schema = self._schemas.setdefault((topic.type, topic.definition), len(self._schemas) + 1)
        self.topics[topic_id] = topic
        definition = Definition.of(topic, topic_id, schema)
        self.definitions[topic_id] = definition
        self.definitions_size = sum(len(d.packed) for d in self.definitions.values())
        return definition

    def fold(self, file: McapFile) -> None:
        """Note a file that has its end."""
        self.files.append(info_of(file))
        self.size += file.size
        for topic_id, count in file.counts.items():
            self._counts[topic_id] = self._counts.get(topic_id, 0) + count

    def infos(self, file: McapFile) -> list[FileInfo]:
        """Return the files with the open one last."""
        return [*self.files, info_of(file)]

    def counts(self, file: McapFile) -> dict[str, int]:
        """Return the messages by name of the topic, with those of the open chunk."""
        counts = dict.fromkeys((t.name for t in self.topics.values()), 0)
        for topic_id, topic in self.topics.items():
            counts[topic.name] += self._count(topic_id, file) + file.pending_of(topic_id)
        return counts

    def message_count(self, file: McapFile) -> int:
        """Return the messages written, without those of the open chunk."""
        return sum(self._counts.values()) + file.message_count

    def text(self, file: McapFile) -> str:
        """Return metadata.yaml, with what is written of the open file."""
        topics: dict[str, TopicInfo] = {}
        for topic_id, topic in self.topics.items():
            before = topics.get(topic.name)  # of another type or definition
            count = self._count(topic_id, file) + (before.message_count if before else 0)
            first = before.topic if before else topic
            topics[topic.name] = TopicInfo(topic=first, message_count=count)
        text = metadata.text_of(
            BagMetadata(
                topics=tuple(topics.values()),
                files=tuple(self.infos(file)),
                custom_data=self.custom,
                ros_distro=self._ros_distro,
            )
        )
        self.text_size = len(text.encode())
        return text

    def _count(self, topic_id: int, file: McapFile) -> int:
        return self._counts.get(topic_id, 0) + file.counts.get(topic_id, 0)


def info_of(file: McapFile) -> FileInfo:
    """Return what metadata.yaml says of a file."""
    return FileInfo(
        path=file.path.name, message_count=file.message_count, start=file.start, end=file.end
    )
