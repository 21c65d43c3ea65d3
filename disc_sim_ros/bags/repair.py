"""Repair of a bag: all that can be read of one, in a new bag with index and metadata.

A file in which nothing is wrong is copied byte for byte. Any other is written anew: its messages,
attachments, metadata, schemas and channels as they are, with the definitions that it lacks.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
import os
from pathlib import Path
import shutil
from typing import TYPE_CHECKING

from mcap.records import Channel, Schema

from disc_sim_ros.bags import metadata
from disc_sim_ros.bags.bag_folder import BagFolder, bag_folder, read_files
from disc_sim_ros.bags.contents import Contents, Loss, attachment_at, chunk_bytes
from disc_sim_ros.bags.definitions import (
    Definition,
    channel_of,
    filled,
    schema_of,
    topic_of,
)
from disc_sim_ros.bags.mcap_reader import indexed
from disc_sim_ros.bags.mcap_records import ZSTD_MAGIC, messages
from disc_sim_ros.bags.mcap_recovery import scanned
from disc_sim_ros.bags.mcap_writer import CHUNK_SIZE, McapFile, new_attachment
from disc_sim_ros.bags.metadata import BagMetadata, FileInfo, TopicInfo
from disc_sim_ros.bags.reader import is_listed, repeated_chunk, reported
from disc_sim_ros.bags.repair_report import RepairReport
from disc_sim_ros.errors import BagError, ConfigError, DamageError, WriteError
from disc_sim_ros.files import check_new_folder, reason, sync_folder, whole_folder, write_whole

if TYPE_CHECKING:
    from disc_sim_ros.bags.topic import Topic

_ROS_PROFILE = 'ros2'
_BLOCK = 1 << 20  # bytes copied at a time
_LARGEST_ID = 65535  # of channels and schemas


def repair(
    source: Path | str, target: Path | str, progress: Callable[[str], None] = lambda _: None
) -> RepairReport:
    """Write all that can be read of one bag into a new one. The source is only read.

    The new bag appears under its name when it is complete. Log and publish times, definitions,
    QoS, attachments and `custom_data` stay; messages stay in their files and in their order.

    Args:
        source: The folder of a bag, or an .mcap file.
        target: The folder to make.
        progress: Is called with a line about each file.

    Raises:
        ConfigError: There is no source, or the target exists or lies inside of the source.
        BagError: The source is no bag, nothing of it can be kept, or the system refuses.
    """
    source, target = Path(source), Path(target)
    _check(source, target)
    try:
        folder = bag_folder(source)

        def read(file: Path, unpacked: Path | None) -> Contents:
            progress(f'reading {file}')
            return scanned(file, unpacked)

        found = read_files(folder, read)
    except OSError as error:
        raise BagError(f'{error.filename or source}: {reason(error)}') from None
    whole = is_listed(folder, found) and not folder.losses and all(c.complete for c in found)
    if not whole and not any(c.message_count or c.attachments for c in found):
        losses = [*folder.losses, *(loss for c in found for loss in c.losses)]
        why = f' ({losses[0]})' if losses else ''
        raise BagError(f'{source}: nothing can be kept, there is no message in it{why}')
    try:
        with whole_folder('OUT', target) as made:
            made.mkdir()
            repairer = _Repairer(folder, found, made, progress)
            repairer.run()
    except WriteError as error:
        why = f'{target}: cannot be written ({error.reason}); nothing is left of it'
        raise BagError(why) from None
    except OSError as error:
        raise BagError(f'{error.filename or source}: {reason(error)}') from None
    return RepairReport(
        source=source,
        target=target,
        was_whole=whole and not repairer.losses,
        kept=repairer.kept,
        attachments=repairer.attachments,
        losses=tuple(repairer.losses),
        mended=tuple(repairer.mended),
    )


def _check(source: Path, target: Path) -> None:
    if not source.exists():
        raise ConfigError('IN', str(source), 'there is no such bag')
    check_new_folder('OUT', target)
    if source.is_dir() and target.resolve().is_relative_to(source.resolve()):
        raise ConfigError('OUT', str(target), f'it must not lie in {source}')


@dataclass(frozen=True, slots=True)
class _Written:
    """A file of the new bag."""

    info: FileInfo
    topics: tuple[TopicInfo, ...]


class _Repairer:
    """Writes one bag from what the files of another hold."""

    def __init__(
        self,
        folder: BagFolder,
        found: Sequence[Contents],
        made: Path,
        progress: Callable[[str], None],
    ) -> None:
        self.losses = [*folder.losses, *(loss for c in found for loss in c.losses)]
        self.mended: list[str] = []
        self.kept: dict[str, int] = {}
        self.attachments = 0
        self._found = found
        self._made = made
        self._progress = progress
        self._about = _own_compression(reported(found, folder), found)
        self._types = {t.name: t.type for t in self._about.topics}
        self._written: list[_Written] = []

    def run(self) -> None:
        """Write the files, then metadata.yaml.

        Raises:
            WriteError: The system refuses.
            OSError: A file of the source cannot be read.
        """
        for number, contents in enumerate(self._found):
            path = self._made / f'{self._made.name}_{number}.mcap'
            self._progress(f'writing {contents.message_count} messages of {contents.path}')
            reasons = self._why_rewrite(contents)
            if reasons:
                self.mended += [f'{contents.path.name}: {text}' for text in reasons]
                self._rewrite(contents, path)
            else:
                _copy_file(contents.data_path, path)
                self.attachments += len(contents.attachments)
            self._written.append(_read_back(path))
        about = self._metadata()
        self.kept = {t.name: t.message_count for t in about.topics}
        text = metadata.text_of(about).encode()
        with _writing():
            write_whole(self._made / metadata.FILE_NAME, text)
            sync_folder(self._made)

    def _why_rewrite(self, contents: Contents) -> list[str]:
        """Return what is wrong with a file; nothing if it can be copied as it is."""
        reasons = []
        if not contents.complete:
            reasons.append('it was damaged or had no end')
        elif indexed(contents.path, contents.unpacked) is None:
            reasons.append('it had no full index')
        if any(
            m.name == metadata.RECORD and metadata.has_root(m.metadata) for m in contents.metadata
        ):
            reasons.append('rosbag2 refused the form of its metadata record')
        if contents.in_summary_only:
            reasons.append('definitions stood in the summary alone')
        without = [c.topic for c in contents.channels.values() if self._is_filled(contents, c)]
        if without:
            reasons.append(f'the definition of {", ".join(without)} was missing')
        return reasons

    def _is_filled(self, contents: Contents, channel: Channel) -> bool:
        schema = contents.schemas.get(channel.schema_id)
        return filled(channel, schema, self._types.get(channel.topic, '')) != schema

    def _rewrite(self, contents: Contents, path: Path) -> None:
        definitions = self._definitions(contents)
        profile = contents.profile
        if profile is None:  # the header is lost
            ros = any(c.message_encoding == 'cdr' for c in contents.channels.values())
            profile = _ROS_PROFILE if ros else ''
        records = profile == _ROS_PROFILE or any(
            m.name == metadata.RECORD for m in contents.metadata
        )
        with _writing():
            file = McapFile(path, 'zstd', profile)
        try:
            if records:
                self._add_record(file, path)
            self._copy_others(contents, file)
            self._copy_messages(contents, file, definitions)
            with _writing():
                file.define([*definitions.values(), *self._silent(definitions)])
            if records:
                self._add_record(file, path, file)
            with _writing():
                file.finish()
                file.sync()
        finally:
            file.close()

    def _definitions(self, contents: Contents) -> dict[int, Definition]:
        """Return the definitions of the channels of a file, with their ids."""
        definitions = {}
        schemas = dict(contents.schemas)
        for channel_id, channel in contents.channels.items():
            schema = schemas.get(channel.schema_id) if channel.schema_id else None
            if channel.schema_id and schema is None:  # lost
                schema = Schema(id=channel.schema_id, data=b'', encoding='', name='')
            schema = filled(channel, schema, self._types.get(channel.topic, ''))
            defined = channel
            if schema is not None and not channel.schema_id:  # metadata.yaml names the type
                schema = replace(schema, id=_free(schemas))
                schemas[schema.id] = schema
                defined = replace(channel, schema_id=schema.id)
            definitions[channel_id] = Definition.of(defined, schema)
        return definitions

    def _silent(self, definitions: dict[int, Definition]) -> list[Definition]:
        """Return the definitions of topics that metadata.yaml names and the file does not."""
        names = {d.channel.topic for d in definitions.values()}
        schemas = {d.schema.id: d.schema for d in definitions.values() if d.schema}
        channels = dict.fromkeys(definitions)
        made = []
        for topic in (t.topic for t in self._about.topics if t.topic.name not in names):
            empty = schema_of(replace(topic, definition=None), _free(schemas))
            channel_id = _free(channels)
            channel = channel_of(topic, channel_id, empty.id)
            schema = filled(channel, empty) or empty
            same = [s for s in schemas.values() if replace(s, id=schema.id) == schema]
            schema = same[0] if same else schema
            schemas[schema.id] = schema
            channels[channel_id] = None
            made.append(Definition.of(replace(channel, schema_id=schema.id), schema))
        return made

    def _copy_messages(
        self, contents: Contents, file: McapFile, definitions: dict[int, Definition]
    ) -> None:
        ids = frozenset(definitions)
        repeats = repeated_chunk(contents)
        with contents.data_path.open('rb') as source:
            for chunk in contents.chunks:
                try:
                    data = chunk_bytes(source, chunk)
                except DamageError as error:  # it was readable a moment ago
                    why = f'{error}, which it was not when it was read first'
                    self.losses.append(Loss(contents.path, chunk.offset, chunk.length, why))
                    continue
                for m in messages(data, ids):
                    size = file.write(
                        definitions[m.channel_id], m.data, m.log_time, m.publish_time, m.sequence
                    )
                    if size >= CHUNK_SIZE and chunk != repeats:
                        with _writing():
                            file.end_chunk()
                if chunk == repeats:  # they have a chunk of their own
                    with _writing():
                        file.end_chunk()
        with _writing():
            file.end_chunk()

    def _copy_others(self, contents: Contents, file: McapFile) -> None:
        """Copy attachments, metadata that is not rosbag2's own, records of other programs."""
        with contents.data_path.open('rb') as source:
            for offset in contents.attachments:
                try:
                    a = attachment_at(source, offset)
                except DamageError as error:
                    self.losses.append(Loss(contents.path, offset, 0, str(error)))
                    continue
                copied = new_attachment(a.name, a.media_type, a.data, a.log_time, a.create_time)
                with _writing():
                    file.add_attachment(copied)
                self.attachments += 1
            for offset, length in contents.private:
                source.seek(offset)
                packed = source.read(length)
                with _writing():
                    file.add_record(packed)
        for m in contents.metadata:
            if m.name != metadata.RECORD:
                with _writing():
                    file.add_metadata(m.name, m.metadata)

    def _add_record(self, file: McapFile, path: Path, open_file: McapFile | None = None) -> None:
        """Write the metadata record of rosbag2, about the bag as far as it is written."""
        info = FileInfo(path=path.name)
        if open_file is not None:
            info = replace(
                info,
                message_count=open_file.message_count,
                start=open_file.start,
                end=open_file.end,
            )
        topics = {t.name: t for w in self._written for t in w.topics}
        about = replace(
            self._about,
            files=(*(w.info for w in self._written), info),
            topics=tuple(topics.values()) or self._about.topics,
        )
        content = metadata.record_of(about)
        with _writing():
            file.add_metadata(metadata.RECORD, content)

    def _metadata(self) -> BagMetadata:
        """Return the content of metadata.yaml, from the files as they can be read now."""
        counts: dict[str, int] = {}
        topics: dict[str, Topic] = {}
        for info in (t for w in self._written for t in w.topics):
            topics.setdefault(info.name, info.topic)
            counts[info.name] = counts.get(info.name, 0) + info.message_count
        for topic in (t.topic for t in self._about.topics):
            known = topics.setdefault(topic.name, topic)
            topics[topic.name] = replace(
                known, type=known.type or topic.type, qos=topic.qos or known.qos
            )
        return replace(
            self._about,
            topics=tuple(
                TopicInfo(topic=t, message_count=counts.get(n, 0)) for n, t in topics.items()
            ),
            files=tuple(w.info for w in self._written),
        )


@contextmanager
def _writing() -> Iterator[None]:
    """Tell an error of the disk to which the bag is written from one of the source."""
    try:
        yield
    except OSError as error:
        why = reason(error)
        raise WriteError(f'cannot be written ({why})', why) from None


def _copy_file(source: Path, target: Path) -> None:
    with source.open('rb') as file, _writing(), target.open('xb') as copy:
        shutil.copyfileobj(file, copy, _BLOCK)
        copy.flush()
        os.fsync(copy.fileno())


def _read_back(path: Path) -> _Written:
    """Return what a new file holds, by its index."""
    contents = indexed(path)
    if contents is None:
        raise WriteError(f'{path.name} cannot be read back', 'what was written cannot be read')
    topics = tuple(
        TopicInfo(
            topic=topic_of(channel, contents.schemas.get(channel.schema_id)),
            message_count=contents.counts.get(channel_id, 0),
        )
        for channel_id, channel in contents.channels.items()
    )
    info = FileInfo(
        path=path.name,
        message_count=contents.message_count,
        start=contents.start,
        end=contents.end,
    )
    return _Written(info, topics)


def _own_compression(about: BagMetadata, found: Iterable[Contents]) -> BagMetadata:
    """Return metadata with the compression that the messages have; files are never compressed."""
    if any(_has_compressed_messages(contents) for contents in found):
        return replace(about, compression_format='zstd', compression_mode='MESSAGE')
    return replace(about, compression_format='', compression_mode='')


def _has_compressed_messages(contents: Contents) -> bool:
    cdr = frozenset(i for i, c in contents.channels.items() if c.message_encoding == 'cdr')
    with contents.data_path.open('rb') as file:
        for chunk in contents.chunks:
            try:
                first = next(messages(chunk_bytes(file, chunk), cdr), None)
            except DamageError:
                continue
            if first is not None:
                return first.data.startswith(ZSTD_MAGIC)
    return False


def _free(used: Collection[int]) -> int:
    """Return an id that is not in use."""
    number = max(used, default=0) + 1
    if number <= _LARGEST_ID:
        return number
    return next(n for n in range(1, _LARGEST_ID + 1) if n not in used)
