"""Writing a bag: a folder that rosbag2, Foxglove and this package read, safe at any moment."""

from collections.abc import Mapping
import math
from pathlib import Path
import shutil
import struct
import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

from disc_sim_ros import files, validation
from disc_sim_ros.bags.bag_files import BagFiles
from disc_sim_ros.bags.latched import Kept, LatchedMessages
from disc_sim_ros.bags.mcap_writer import CHUNK_SIZE, COMPRESSIONS, new_attachment
from disc_sim_ros.bags.metadata_builder import MetadataBuilder
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.errors import BagError, WriteError
from disc_sim_ros.quantities import BAG_FILES

if TYPE_CHECKING:
    from collections import deque

    from disc_sim_ros.bags.definitions import Definition

_MOST_CHANNELS = 65535  # ids are of 16 bits


class BagWriter:
    """Writes one bag. For one thread; a context manager that closes the bag.

    What was flushed survives the death of the process and of the machine. When the disk is full,
    `write` or `flush` raises, the messages of the open chunk are dropped and counted in `lost`,
    and `close` still ends the bag, in room that was kept for it.
    """

    def __init__(
        self,
        folder: Path | str,
        *,
        compression: str = 'zstd',
        flush_period: float = BAG_FILES['flush_period'].default,
        max_size: int | None = None,
        max_duration: float | None = None,
        custom_data: Mapping[str, str] = {},
        ros_distro: str = '',
        repeat_latched: bool = False,
    ) -> None:
        """Make the folder, its first file and metadata.yaml.

        Args:
            folder: To be made, with its parents; it must not exist.
            compression: Of the chunks: 'zstd', 'lz4' or 'none'.
            flush_period: Longest time that a message waits for the disk [s, wall time], while
                messages come; call `flush` when none come.
            max_size: A file that has reached this size is followed by another [bytes].
            max_duration: As `max_size`, by log time [s].
            custom_data: Free texts for metadata.yaml.
            ros_distro: Of the messages; '' where it is not known.
            repeat_latched: Let each further file begin with the last messages of the topics whose
                publishers are transient local, so that it can be played and viewed alone.

        Raises:
            ConfigError: A value is not allowed, the folder exists or cannot be made.
            BagError: The system refuses to write in it.
        """
        validation.choice('compression', compression, COMPRESSIONS)
        self._period = BAG_FILES['flush_period'].check(flush_period)
        self._max_size: float = math.inf
        if max_size is not None:
            self._max_size = BAG_FILES['file_size'].check(max_size, 'max_size')
        self._max_duration: float = math.inf
        if max_duration is not None:
            seconds = BAG_FILES['file_duration'].check(max_duration, 'max_duration')
            self._max_duration = round(seconds * 1e9)
        self.folder = files.new_folder('bag', Path(folder))
        self.lost = 0  # messages that a full disk cost
        self._metadata = MetadataBuilder(
            ros_distro, {str(k): str(v) for k, v in custom_data.items()}
        )
        self._writable: dict[int, Definition] = {}  # by topic id; empty once writing is over
        self._latched = LatchedMessages() if repeat_latched else None
        self._kept: dict[int, deque[Kept]] = self._latched.by_topic if self._latched else {}
        self._failure: BagError | None = None
        self._closed = False
        self._chunk_size = min(CHUNK_SIZE, max(4096, self._max_size / 8))
        self._turn_at = 0.0  # log time at which another file begins [ns]
        self._due = time.monotonic() + self._period  # when to flush [s]
        try:
            self._files = BagFiles(self.folder, compression, self._metadata)
        except OSError as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            why = files.reason(error)
            raise WriteError(f'{self.folder}: no bag can be written there ({why})', why) from None
        self._file = self._files.file

    def add(self, topic: Topic) -> int:
        """Announce a topic; return the id with which its messages are written."""
        self._refuse_when_over()
        if len(self._metadata.topics) == _MOST_CHANNELS:
            raise BagError(f'{self.folder}: a bag has at most {_MOST_CHANNELS} topics')
        topic_id = len(self._metadata.topics) + 1
        self._set(topic_id, topic)
        return topic_id

    def update(self, topic_id: int, topic: Topic) -> None:
        """Replace the description of a topic.

        Once a file has its channel, only the QoS is kept, in `custom_data`, from where `open_bag`
        takes it.
        """
        self._refuse_when_over()
        before = self._metadata.topics.get(topic_id)
        if before is None or (before.name, before.type) != (topic.name, topic.type):
            raise BagError(f'{self.folder}: topic {topic_id} is not {topic.name}')
        if not self._metadata.closed_files and not self._file.defines(topic_id):
            self._set(topic_id, topic)
        elif before.qos != topic.qos:
            self._metadata.note_late_qos(topic)
            self._files.stale = True
        if self._latched:
            self._latched.set_topic(topic_id, topic)

    def write(
        self, topic_id: int, data: bytes, log_time: int, publish_time: int, sequence: int = 0
    ) -> None:
        """Add a message, as the bytes that came.

        Args:
            topic_id: From `add`.
            data: The serialised message.
            log_time: When it was received [ns].
            publish_time: When it was sent [ns].
            sequence: rosbag2 Jazzy leaves it 0.

        Raises:
            BagError: The id is unknown, a time negative, the bag closed, or the disk full.
        """
        try:
            definition = self._writable[topic_id]
            if log_time >= self._turn_at:
                self._turn(log_time)
            pending = self._file.write(definition, data, log_time, publish_time, sequence)
            if topic_id in self._kept:
                self._kept[topic_id].append(Kept(data, publish_time, sequence))
        except (KeyError, struct.error):
            self._refuse_when_over()
            if topic_id not in self._metadata.topics:
                raise BagError(f'{self.folder}: no topic has the id {topic_id}') from None
            raise BagError(
                f'{self._metadata.topics[topic_id].name}: times must be from 0 to 2^64 - 1 ns, '
                f'not {log_time} and {publish_time}'
            ) from None
        if pending >= self._chunk_size:
            self._end_chunk()
        elif time.monotonic() >= self._due:
            self.flush()

    def flush(self) -> None:
        """Bring everything to the disk, messages and metadata.yaml.

        Raises:
            BagError: The system refuses; what was flushed before is safe.
        """
        self._refuse_when_over()
        try:
            self._flush()
        except OSError as error:
            raise self._failed(error) from None

    def split(self) -> None:
        """End the file and begin another; do nothing while the file has no messages.

        Raises:
            BagError: The system refuses; what was flushed before is safe.
        """
        self._refuse_when_over()
        if not self._file.message_count + self._file.pending_messages:
            return
        try:
            self._files.open_next()
        except OSError as error:
            raise self._failed(error) from None
        finally:
            self._file = self._files.file
        self._turn_at = 0.0
        self._due = time.monotonic() + self._period

    def custom(self, key: str, value: str) -> None:
        """Set a text of `custom_data` in metadata.yaml."""
        if self._metadata.custom_data.get(str(key)) != str(value):
            self._metadata.custom_data[str(key)] = str(value)
            self._files.stale = True

    def attach(
        self,
        name: str,
        media_type: str,
        data: bytes,
        *,
        log_time: int | None = None,
        create_time: int | None = None,
    ) -> None:
        """Put a small file into the bag; times [ns] are now where they are not given.

        Raises:
            BagError: The system refuses.
        """
        self._refuse_when_over()
        try:
            self._file.add_attachment(
                new_attachment(name, media_type, data, log_time, create_time)
            )
        except OSError as error:
            raise self._failed(error) from None

    def note(self, name: str, data: Mapping[str, str]) -> None:
        """Put an MCAP metadata record into the file.

        Raises:
            BagError: The system refuses.
        """
        self._refuse_when_over()
        try:
            self._file.add_metadata(name, dict(data))
        except OSError as error:
            raise self._failed(error) from None

    def close(self) -> None:
        """End the bag with its index; a second call does nothing.

        Raises:
            BagError: Messages were lost now, or there is no room for the end. Everything flushed
                stays readable, and `repair_bag` gives it an end.
        """
        if self._closed:
            return
        self._closed = True
        self._writable = {}
        failure = None
        if self._failure is None:
            try:
                self._file.end_chunk()
            except OSError as error:
                failure = self._failed(error)
        try:
            self._files.end()
        except OSError as error:
            why = self._reason(error)
            raise WriteError(
                f'{self._file.path}: its end cannot be written ({why}); '
                'what is there stays readable, and `repair_bag` makes it whole',
                why,
            ) from None
        finally:
            self._files.close()
        if failure is not None:
            raise failure

    @property
    def files(self) -> tuple[Path, ...]:
        """The files, the open one last."""
        return tuple(self.folder / f.path for f in self._metadata.files(self._file))

    @property
    def flushed(self) -> int:
        """Messages that the disk has."""
        return self._files.flushed

    @property
    def message_count(self) -> int:
        """Messages taken, without those lost."""
        return sum(self.counts.values())

    @property
    def counts(self) -> dict[str, int]:
        """Messages taken of each topic, by name."""
        return self._metadata.counts(self._file)

    @property
    def bytes(self) -> int:
        """Size of the files, without the chunk in the making."""
        return self._metadata.closed_size + self._file.size

    @property
    def start(self) -> int:
        """Least log time on the disk [ns]; 0 without messages."""
        return min(
            (f.start for f in self._metadata.files(self._file) if f.message_count), default=0
        )

    @property
    def end(self) -> int:
        """Greatest log time on the disk [ns]; 0 without messages."""
        return max((f.end for f in self._metadata.files(self._file) if f.message_count), default=0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self.close()
        except BagError:
            if error is None:  # else the first error says more
                raise

    def _set(self, topic_id: int, topic: Topic) -> None:
        self._writable[topic_id] = self._metadata.set_topic(topic_id, topic)
        if self._latched:
            self._latched.set_topic(topic_id, topic)
        self._files.stale = True

    def _refuse_when_over(self) -> None:
        if self._failure is not None:
            raise self._failure
        if self._closed:
            raise BagError(f'{self.folder}: the bag is closed')

    def _turn(self, log_time: int) -> None:
        """Begin another file if this one is full; set when the file will be full."""
        if self._file.message_count + self._file.pending_messages:
            self.split()
        self._turn_at = log_time + self._max_duration
        if self._latched and self._metadata.closed_files and log_time < 2**64:
            try:
                self._files.hold_reserve()
                repeated = self._latched.repeat(
                    self._file, self._writable, log_time, self._max_size
                )
            except OSError as error:
                raise self._failed(error) from None
            self._metadata.count_repeats(repeated)

    def _end_chunk(self) -> None:
        try:
            self._files.end_chunk()
        except OSError as error:
            raise self._failed(error) from None
        self._check_full()
        if time.monotonic() >= self._due:
            self.flush()

    def _check_full(self) -> None:
        # The chunks together last longer than the file where sim time was set back.
        if self._file.size >= self._max_size or self._file.duration >= self._max_duration:
            self._turn_at = 0.0

    def _flush(self) -> None:
        self._due = time.monotonic() + self._period
        self._files.flush()
        self._check_full()

    def _failed(self, error: OSError) -> BagError:
        """Take no more messages; return the error that says why."""
        self.lost += self._file.drop_chunk()
        self._writable = {}
        why = self._reason(error)
        self._failure = WriteError(
            f'{self._file.path}: cannot be written ({why}); '
            f'{self.message_count} messages are kept, {self.lost} and what came after are lost',
            why,
        )
        return self._failure

    def _reason(self, error: OSError) -> str:
        return files.reason(error) if self.folder.is_dir() else 'the folder has been removed'
