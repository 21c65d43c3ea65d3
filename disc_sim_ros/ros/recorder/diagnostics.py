"""What recorder_node says of its work: losses, diagnostics, its last line."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
import shutil

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.ros.recorder.topic_recorder import TopicRecorder

LITTLE_ROOM = 1024**3  # bytes left on the disk that are worth a warning


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How recording goes, beside what the bag itself tells.

    Attributes:
        paused: Nothing is recorded.
        topics: That are subscribed to.
        backlog: Bytes that wait for the disk.
        lateness: Longest time that a message waited to be taken [s].
        losses: Of `losses`.
    """

    paused: bool
    topics: int
    backlog: int
    lateness: float
    losses: Mapping[str, int]


def losses(tracks: Iterable[TopicRecorder]) -> dict[str, int]:
    """Return how many messages of which topic were lost how; nothing where none was."""
    return {
        f'{what} {track.name}': count
        for track in tracks
        for what, count in (
            ('dropped', track.dropped),
            ('lost', track.lost),
            ('gaps', track.missed),
        )
        if count
    }


def diagnostic(name: str, writer: BagWriter, progress: Progress) -> DiagnosticStatus:
    """Return the status of a recorder with this full name."""
    free = _free(writer.folder)
    problems = [f'{what}: {count}' for what, count in progress.losses.items()]
    if free < LITTLE_ROOM:
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


def summary(writer: BagWriter, found: Mapping[str, int]) -> str:
    """Return the last line: what is in a closed bag, and how to open it."""
    filled = sum(count > 0 for count in writer.counts.values())
    lost = ', '.join(f'{key}: {count}' for key, count in found.items())
    return (
        f'recorded {_several(writer.message_count, "message")} of {_several(filled, "topic")}, '
        f'{writer.bytes / 1e6:.1f} MB, {lost or "nothing lost"}, in {writer.folder} '
        '(open it with analyse_bag, Foxglove or ros2 bag play)'
    )


def doubled(nodes: Sequence[tuple[str, str]]) -> set[str]:
    """Return the full names that several nodes have, of their names and namespaces."""
    names = [f'{namespace.rstrip("/")}/{name}' for name, namespace in nodes]
    return {name for name in names if names.count(name) > 1}


def _several(count: int, what: str) -> str:
    return f'{count} {what}' if count == 1 else f'{count} {what}s'


def _free(folder: Path) -> int:
    """Return the bytes free where a folder is; 0 where it is gone."""
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return 0
