"""The part of the writer that collects what metadata.yaml reports: topics, files, counts."""

from collections.abc import Iterable, Mapping

from disc_sim_ros.bags import metadata
from disc_sim_ros.bags.definitions import Definition, channel_of, schema_of
from disc_sim_ros.bags.mcap_writer import McapFile
from disc_sim_ros.bags.metadata import BagMetadata, FileInfo, TopicInfo
from disc_sim_ros.bags.topic import Topic, qos_yaml


class MetadataBuilder:
    """Topics and files of the bag that a writer makes."""

    def __init__(self, ros_distro: str, custom_data: Mapping[str, str]) -> None:
        self.topics: dict[int, Topic] = {}
        self.definitions: dict[int, Definition] = {}
        self.definitions_size = 0  # bytes
        self.custom_data = dict(custom_data)
        self.closed_files: list[FileInfo] = []
        self.closed_size = 0  # bytes of these files
        self._closed_counts: dict[int, int] = {}  # messages in the closed files, by topic
        self._repeats: dict[int, int] = {}  # messages written a second time, by topic
        self._schema_ids: dict[tuple[str, str, bytes], int] = {}  # by name, encoding, data
        self._ros_distro = ros_distro

    def note_late_qos(self, topic: Topic) -> None:
        """Keep the QoS of publishers that came when the channel was written already.

        The channel and the entry in metadata.yaml stay as they are and agree: rosbags leaves out
        the messages of a channel whose profiles are not those of metadata.yaml.
        """
        self.custom_data[metadata.LATE_QOS + topic.name] = qos_yaml(topic.qos)

    def set_topic(self, topic_id: int, topic: Topic) -> Definition:
        """Add a topic or replace its description; return its MCAP records."""
        schema = schema_of(topic, 0)
        key = schema.name, schema.encoding, schema.data
        schema.id = self._schema_ids.setdefault(key, len(self._schema_ids) + 1)
        self.topics[topic_id] = topic
        definition = Definition.of(channel_of(topic, topic_id, schema.id), schema)
        self.definitions[topic_id] = definition
        self.definitions_size = sum(len(d.packed) for d in self.definitions.values())
        return definition

    def close_file(self, file: McapFile) -> None:
        """Add a file that has its end."""
        self.closed_files.append(file_info(file))
        self.closed_size += file.size
        for topic_id, count in file.counts.items():
            self._closed_counts[topic_id] = self._closed_counts.get(topic_id, 0) + count

    def count_repeats(self, topic_ids: Iterable[int]) -> None:
        """Note that a message of each topic was written again, at the beginning of a file."""
        for topic_id in topic_ids:
            self._repeats[topic_id] = self._repeats.get(topic_id, 0) + 1

    def files(self, open_file: McapFile) -> list[FileInfo]:
        """Return all files, the open one last."""
        return [*self.closed_files, file_info(open_file)]

    def counts(self, open_file: McapFile) -> dict[str, int]:
        """Return the messages taken of each topic, by name, with those of the open chunk."""
        counts = dict.fromkeys((t.name for t in self.topics.values()), 0)
        for topic_id, topic in self.topics.items():
            written = self._count(topic_id, open_file) + open_file.pending_of(topic_id)
            counts[topic.name] += written - self._repeats.get(topic_id, 0)
        return counts

    def message_count(self, open_file: McapFile) -> int:
        """Return the messages taken and written, without those of the open chunk."""
        written = sum(self._closed_counts.values()) + open_file.message_count
        return written - sum(self._repeats.values())

    def metadata(self, open_file: McapFile) -> BagMetadata:
        """Return the content of metadata.yaml, with what is written of the open file."""
        topics: dict[tuple[str, str], TopicInfo] = {}
        for topic_id, topic in self.topics.items():
            key = topic.name, topic.type  # a topic may come with a second type
            before = topics.get(key)
            count = self._count(topic_id, open_file) + (before.message_count if before else 0)
            first = before.topic if before else topic
            topics[key] = TopicInfo(topic=first, message_count=count)
        return BagMetadata(
            topics=tuple(topics.values()),
            files=tuple(self.files(open_file)),
            custom_data=self.custom_data,
            ros_distro=self._ros_distro,
        )

    def _count(self, topic_id: int, open_file: McapFile) -> int:
        return self._closed_counts.get(topic_id, 0) + open_file.counts.get(topic_id, 0)


def file_info(file: McapFile) -> FileInfo:
    """Return the entry of a file in metadata.yaml."""
    return FileInfo(
        path=file.path.name, message_count=file.message_count, start=file.start, end=file.end
    )
