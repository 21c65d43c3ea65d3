"""Making a bag whole again: all that can be read of one, in a new bag with index and metadata."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mcap.records import Channel

from disc_sim_ros.bags import metadata
from disc_sim_ros.bags.mcap_records import Contents, Loss, attachment_at, chunk_bytes, messages
from disc_sim_ros.bags.mcap_recovery import scanned
from disc_sim_ros.bags.metadata import BagMetadata
from disc_sim_ros.bags.reader import contents_of, mcap_files, told_by, topic_of
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError, ConfigError, DamageError, WriteError
from disc_sim_ros.files import check_new_folder, reason, whole_folder

_FLUSH_PERIOD = 30.0  # s: what is made can be made again


@dataclass(frozen=True, slots=True)
class RepairReport:
    """What a repair kept and lost."""

    source: Path
    target: Path
    was_whole: bool  # nothing was wrong with the source
    kept: dict[str, int]  # messages by topic
    attachments: int
    losses: tuple[Loss, ...]

    @property
    def message_count(self) -> int:
        """Messages kept, of all topics."""
        return sum(self.kept.values())

    @property
    def bytes_lost(self) -> int:
        """Bytes of the source that say nothing any more."""
        return sum(loss.length for loss in self.losses)

    def document(self) -> dict[str, Any]:
        """Return the report for programs."""
        return {
            'source': str(self.source),
            'target': str(self.target),
            'was_whole': self.was_whole,
            'message_count': self.message_count,
            'kept': self.kept,
            'attachments': self.attachments,
            'bytes_lost': self.bytes_lost,
            'losses': [
                {
                    'file': str(loss.path),
                    'offset': loss.offset,
                    'length': loss.length,
                    'messages': loss.messages,
                    'reason': loss.reason,
                }
                for loss in self.losses
            ],
        }

    def summary(self) -> str:
        """Return the report to read."""
        width = max(map(len, self.kept), default=0)
        lines = [f'{self.source} -> {self.target}']
        lines += [
            f'  {name:{width}}  {_count(count, "message")}' for name, count in self.kept.items()
        ]
        lines.append(
            f'  kept  {_count(self.message_count, "message")} of '
            f'{_count(len(self.kept), "topic")}, {_count(self.attachments, "attachment")}'
        )
        if self.was_whole:
            lines.append('  the bag was whole')
        elif not self.losses:
            lines.append('  lost  nothing; index or metadata.yaml was missing')
        else:
            lines.append(f'  lost  {_count(self.bytes_lost, "byte")}')
            lines += [f'    {loss}' for loss in self.losses]
        return '\n'.join(lines)


def _count(number: int, thing: str) -> str:
    return f'{number} {thing}{"" if number == 1 else "s"}'


def repair(
    source: Path | str, target: Path | str, progress: Callable[[str], None] = lambda _: None
) -> RepairReport:
    """Write all that can be read of one bag into a new one. The source is only read.

    The new bag appears under its name when it is complete. Log and publish times, definitions,
    QoS, attachments and `custom_data` stay; messages stay in their files and in their order.

    Args:
        source: The folder of a bag, or an .mcap file.
        target: The folder to make.
        progress: Is told of each file.

    Raises:
        ConfigError: There is no source, or the target exists or lies inside of the source.
        BagError: The source is no bag, or the system refuses.
    """
    source, target = Path(source), Path(target)
    _check(source, target)
    try:
        files, told = mcap_files(source)

        def read(file: Path) -> Contents:
            progress(f'reading {file}')
            return scanned(file)

        found = contents_of(files, read)
        return _write(source, target, found, told, progress)
    except OSError as error:
        raise BagError(f'{error.filename or source}: {reason(error)}') from None


def _check(source: Path, target: Path) -> None:
    if not source.exists():
        raise ConfigError('IN', str(source), 'there is no such bag')
    check_new_folder('OUT', target)
    if source.is_dir() and target.resolve().is_relative_to(source.resolve()):
        raise ConfigError('OUT', str(target), f'it must not lie in {source}')


def _write(
    source: Path,
    target: Path,
    found: list[Contents],
    told: BagMetadata | None,
    progress: Callable[[str], None],
) -> RepairReport:
    """Write what was found into a folder beside the target, which then gets its name."""
    about = told_by(found, told)
    try:
        with whole_folder('OUT', target) as made:  # files inside are named after the bag
            kept, attached, losses = _copy(found, about, made, progress)
    except WriteError as error:
        why = f'{target}: cannot be written ({error.reason}); nothing is left of it'
        raise BagError(why) from None
    count = sum(c.message_count for c in found)
    whole = source.is_file() if told is None else told.message_count == count
    return RepairReport(
        source=source,
        target=target,
        was_whole=whole and all(c.complete for c in found),
        kept=kept,
        attachments=attached,
        losses=tuple(losses),
    )


def _copy(
    found: list[Contents], about: BagMetadata, made: Path, progress: Callable[[str], None]
) -> tuple[dict[str, int], int, list[Loss]]:
    attached = 0
    losses = [loss for contents in found for loss in contents.losses]
    with BagWriter(
        made,
        flush_period=_FLUSH_PERIOD,
        custom_data=about.custom_data,
        ros_distro=about.ros_distro or 'jazzy',
    ) as bag:
        ids: dict[Topic, int] = {}
        for contents in found:
            progress(f'writing {contents.message_count} messages of {contents.path}')
            bag.split()
            attached += _copy_others(contents, bag, losses)
            channels = {
                i: _id(bag, ids, contents, channel) for i, channel in contents.channels.items()
            }
            with contents.path.open('rb') as file:
                for piece in contents.pieces:
                    try:
                        data = chunk_bytes(file, piece)
                    except DamageError as error:  # it was readable a moment ago
                        why = f'{error}, which it was not when it was read first'
                        losses.append(Loss(contents.path, piece.offset, piece.length, why))
                        continue
                    for m in messages(data, frozenset(channels)):
                        bag.write(
                            channels[m.channel_id], m.data, m.log_time, m.publish_time, m.sequence
                        )
        for info in about.topics:  # QoS of publishers that came later; topics without messages
            _tell(bag, ids, info.topic)
        kept = bag.counts
    return kept, attached, losses


def _id(bag: BagWriter, ids: dict[Topic, int], contents: Contents, channel: Channel) -> int:
    topic = topic_of(contents, channel)
    if topic not in ids:
        ids[topic] = bag.add(topic)
    return ids[topic]


def _tell(bag: BagWriter, ids: dict[Topic, int], told: Topic) -> None:
    known = [(topic, i) for topic, i in ids.items() if topic.name == told.name]
    if not known:
        ids[told] = bag.add(told)
    elif told.qos and known[0][0].type == told.type and known[0][0].qos != told.qos:
        topic, topic_id = known[0]
        bag.update(topic_id, replace(topic, qos=told.qos))


def _copy_others(contents: Contents, bag: BagWriter, losses: list[Loss]) -> int:
    """Copy attachments and metadata that are not rosbag2's own; return how many attachments."""
    count = 0
    with contents.path.open('rb') as file:
        for offset in contents.attachments:
            try:
                a = attachment_at(file, offset)
            except DamageError as error:
                losses.append(Loss(contents.path, offset, 0, str(error)))
                continue
            bag.attach(
                a.name, a.media_type, a.data, log_time=a.log_time, create_time=a.create_time
            )
            count += 1
    for record in contents.metadata:
        if record.name != metadata.RECORD:
            bag.note(record.name, record.metadata)
    return count
