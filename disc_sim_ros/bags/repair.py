"""Repair of a bag: all that can be read of one, in a new bag with index and metadata.

A file in which nothing is wrong is copied byte for byte. Any other is written anew: its messages,
attachments, metadata, schemas and channels as they are, with the definitions that it lacks.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
import os
from pathlib import Path
import shutil

from disc_sim_ros.bags import metadata
from disc_sim_ros.bags.bag_folder import BagFolder, bag_folder, read_files
from disc_sim_ros.bags.contents import Contents, Loss, attachment_at, chunk_bytes
from disc_sim_ros.bags.definitions import Definition, topic_of
from disc_sim_ros.bags.mcap_reader import indexed
from disc_sim_ros.bags.mcap_records import messages
from disc_sim_ros.bags.mcap_recovery import scanned
from disc_sim_ros.bags.mcap_writer import CHUNK_SIZE, McapFile, new_attachment
from disc_sim_ros.bags.metadata import FileInfo, TopicInfo
from disc_sim_ros.bags.metadata_builder import file_info
from disc_sim_ros.bags.reader import is_listed, repeated_chunk, reported
from disc_sim_ros.bags.repair_plan import ROS_PROFILE, RepairPlan
from disc_sim_ros.bags.repair_report import RepairReport
from disc_sim_ros.errors import BagError, ConfigError, DamageError, WriteError
from disc_sim_ros.files import check_new_folder, reason, sync_folder, whole_folder, write_whole

_BLOCK = 1 << 20  # bytes copied at a time
_MOST_NOTED = 10  # losses in the text of the new bag
LOST_BEFORE = 'lost before the repair'  # key in the `custom_data` of the new bag


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

        all_contents = read_files(folder, read)
    except OSError as error:
        raise BagError(f'{error.filename or source}: {reason(error)}') from None
    losses = [*folder.losses, *(loss for c in all_contents for loss in c.losses)]
    sound = not losses and all(c.complete for c in all_contents)
    whole = sound and is_listed(folder, all_contents)
    if not whole and not any(c.message_count for c in all_contents):
        _refuse_nothing(source, all_contents, losses)
    try:
        with whole_folder('OUT', target) as made:
            made.mkdir()
            repairer = _Repairer(folder, all_contents, made, progress)
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
        unknown=tuple(_unknown(folder, all_contents)),
        mended=tuple(repairer.mended),
    )


def _unknown(folder: BagFolder, all_contents: Sequence[Contents]) -> Iterator[str]:
    """Yield what may have been lost without a trace."""
    for c in all_contents:
        if not c.closed and (c.chunks or c.channels):
            yield f'{c.path.name} has no end: what was not on the disk when its recorder ended'
    if folder.metadata is None and folder.path.is_dir():
        yield f'without {metadata.FILE_NAME}: whether files followed the last'


def _noted(losses: Sequence[Loss]) -> str:
    """Return what the new bag says of the losses of the old one."""
    more = len(losses) - _MOST_NOTED
    texts = [str(loss) for loss in losses[:_MOST_NOTED]] + [f'{more} more'] * (more > 0)
    return '; '.join(texts)


def _refuse_nothing(source: Path, all_contents: Sequence[Contents], losses: list[Loss]) -> None:
    """Refuse a bag without messages, but for the attachments of one that never had any."""
    lost = [loss for loss in losses if loss.messages != 0]
    if lost or not any(c.attachments for c in all_contents):
        why = f' ({lost[0]})' if lost else ''
        raise BagError(f'{source}: nothing can be kept, there is no message in it{why}')


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
        all_contents: Sequence[Contents],
        made: Path,
        progress: Callable[[str], None],
    ) -> None:
        self.losses = [*folder.losses, *(loss for c in all_contents for loss in c.losses)]
        self.mended: list[str] = []
        self.kept: dict[str, int] = {}
        self.attachments = 0
        self._contents = all_contents
        self._made = made
        self._progress = progress
        about = reported(all_contents, folder)
        lost = [loss for loss in self.losses if loss.messages != 0]
        if lost:
            about = replace(about, custom_data={**about.custom_data, LOST_BEFORE: _noted(lost)})
        self._plan = RepairPlan(about, all_contents)
        self._written: list[_Written] = []

    def run(self) -> None:
        """Write the files, then metadata.yaml.

        Raises:
            WriteError: The system refuses.
            OSError: A file of the source cannot be read.
        """
        for number, contents in enumerate(self._contents):
            path = self._made / f'{self._made.name}_{number}.mcap'
            self._progress(f'writing {contents.message_count} messages of {contents.path}')
            reasons = self._plan.why_rewrite(contents)
            if reasons:
                self.mended += [f'{contents.path.name}: {text}' for text in reasons]
                self._rewrite(contents, path)
            else:
                _copy_file(contents.data_path, path)
                self.attachments += len(contents.attachments)
            self._written.append(_read_back(path))
        topics = self._plan.topics(t for w in self._written for t in w.topics)
        files = tuple(w.info for w in self._written)
        about = replace(self._plan.about, topics=topics, files=files)
        for info in topics:
            self.kept[info.name] = self.kept.get(info.name, 0) + info.message_count
        text = metadata.text_of(about).encode()
        with _writing():
            write_whole(self._made / metadata.FILE_NAME, text)
            sync_folder(self._made)

    def _rewrite(self, contents: Contents, path: Path) -> None:
        definitions = self._plan.definitions(contents)
        profile = self._plan.profile(contents)
        records = profile == ROS_PROFILE or any(
            m.name == metadata.RECORD for m in contents.metadata
        )
        with _writing():
            file = McapFile(path, 'zstd', profile)
        try:
            if records:
                self._add_record(file)
            self._copy_others(contents, file)
            self._copy_messages(contents, file, definitions)
            with _writing():
                file.define([*definitions.values(), *self._plan.silent(definitions)])
            if records:
                self._add_record(file)
            with _writing():
                file.finish()
                file.sync()
        finally:
            file.close()

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

    def _add_record(self, file: McapFile) -> None:
        """Write the metadata record of rosbag2, about the bag as far as it is written."""
        topics = self._plan.topics(t for w in self._written for t in w.topics)
        files = (*(w.info for w in self._written), file_info(file))
        content = metadata.record_of(replace(self._plan.about, topics=topics, files=files))
        with _writing():
            file.add_metadata(metadata.RECORD, content)


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
