"""What recorder_node reports: losses, its diagnostic status, its last line."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
import shutil

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.ros.recorder.topic_recorder import TopicRecorder
from disc_sim_ros.topics import Loss

_MOST_NAMED = 3  # topics in a part of the last line
LITTLE_SPACE = 1024**3  # bytes free on the disk, below which there is a warning


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """The state of a recording, beside that of the bag.

    Attributes:
        paused: Whether messages are not recorded.
        topics: Number of topics subscribed to.
        backlog: Bytes that wait for the disk.
        lateness: Longest time that a message waited to be taken [s].
        losses: Numbers of lost messages, of `losses`.
        refused: Why types of topics are not recorded, by name and type.
        stall: Longest time that the recorder did not run [s]; 0 if it always did.
    """

    paused: bool
    topics: int
    backlog: int
    lateness: float
    losses: Mapping[str, int]
    refused: Mapping[tuple[str, str], str]
    stall: float


def losses(recorders: Iterable[TopicRecorder]) -> dict[str, int]:
    """Return the numbers of lost messages by the kind of loss and the topic, if not 0."""
    return {
        f'{kind} {recorder.label}': count
        for recorder in recorders
        for kind, count in (
            (Loss.DROPPED, recorder.dropped),
            (Loss.LOST, recorder.lost),
            (Loss.GAPS, recorder.missing),
            (Loss.ENDED, recorder.ended),
        )
        if count
    }


def diagnostic(name: str, writer: BagWriter, progress: Progress) -> DiagnosticStatus:
    """Return the diagnostic status of a recorder.

    Args:
        name: Full name of the node.
        writer: The bag.
        progress: The state of the recording.
    """
    free = _free(writer.folder)
    problems = [
        *(f'{loss}: {count}' for loss, count in progress.losses.items()),
        *_without_number(progress.refused, progress.stall),
    ]
    if free < LITTLE_SPACE:
        problems.append(f'{free / 1e6:.0f} MB left on the disk')
    values: dict[str, object] = {
        'bag': writer.folder,
        'paused': progress.paused,
        'topics': progress.topics,
        'messages': writer.message_count,
        'bytes': writer.bytes,
        'waiting_bytes': progress.backlog,
        'worst_lateness_s': f'{progress.lateness:.6f}',
        'free_bytes': free,
        **progress.losses,
    }
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if problems else DiagnosticStatus.OK,
        name=f'{name[1:]}: recording',
        message=', '.join(problems) or ('paused' if progress.paused else 'recording'),
        hardware_id=str(writer.folder),
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
    )


def summary(
    writer: BagWriter,
    recorders: Sequence[TopicRecorder],
    not_recorded: Mapping[tuple[str, str], str],
    *,
    stall: float,
    skipped: int,
) -> str:
    """Return the last line of a recorder: what its closed bag holds, and how to open it.

    Args:
        writer: The closed bag.
        recorders: The recorded topics.
        not_recorded: Why the types of topics are missing, by name and type.
        stall: Longest time that the recorder did not run [s]; 0 if it always did.
        skipped: Messages that came while it was paused.
    """
    filled = sum(count > 0 for count in writer.counts.values())
    known = [f'{loss}: {count}' for loss, count in losses(recorders).items()]
    known += _without_number(not_recorded, stall)
    lost = f'known losses: {", ".join(known)}' if known else 'nothing lost'
    if not recorders and not known:
        lost = 'no topic came'
    return (
        f'recorded {_plural(writer.message_count, "message")} of {_plural(filled, "topic")}, '
        f'{writer.bytes / 1e6:.1f} MB, {lost}{_left_out(recorders, skipped)}, in {writer.folder} '
        '(open it with analyse_bag, Foxglove or ros2 bag play)'
    )


def _without_number(refused: Iterable[tuple[str, str]], stall: float) -> list[str]:
    """Return the losses of unknown size: topics that are not recorded, and a stall [s]."""
    texts = [f'{Loss.NOT_RECORDED} {name} ({kind})' for name, kind in refused]
    return texts + [f'{Loss.STALL} for {stall:.1f} s'] * bool(stall)


def _left_out(recorders: Iterable[TopicRecorder], skipped: int) -> str:
    """Return a part of a sentence about messages from before a subscription and from a pause."""
    parts = []
    early = sorted((r for r in recorders if r.before), key=lambda r: (-r.before, r.label))
    if early:
        names = [f'{r.label} {r.before}' for r in early[:_MOST_NAMED]]
        rest = len(early) - len(names)
        more = f' and {_plural(rest, "more topic")}' if rest else ''
        parts.append(f'what was sent before its subscriptions ({", ".join(names)}{more})')
    if skipped:
        parts.append(f'{_plural(skipped, "message")} that came while it was paused')
    return f' but {" and ".join(parts)}' if parts else ''


def duplicate_names(nodes: Sequence[tuple[str, str]]) -> set[str]:
    """Return the full names that several nodes have.

    Args:
        nodes: Name and namespace of each node of the graph.
    """
    names = [f'{namespace.rstrip("/")}/{name}' for name, namespace in nodes]
    return {name for name in names if names.count(name) > 1}


def _plural(count: int, noun: str) -> str:
    return f'{count} {noun}' if count == 1 else f'{count} {noun}s'


def _free(folder: Path) -> int:
    """Return the bytes free on the disk of a folder; 0 if the folder is gone."""
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return 0
