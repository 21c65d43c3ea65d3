"""Resources of a process over time: memory, threads and open files, from /proc."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import re
import statistics

SETTLED = 0.25  # of the samples: those before are the warm-up
MOST_GROWTH = 4.0  # MiB from there to the end; an allocator may still take a little
MOST_FILES = 0.0  # in the median: one left open for each throw or guest would be hundreds


@dataclass(frozen=True, slots=True)
class Sample:
    """Resources of a process at a time.

    Attributes:
        time: Since the beginning [s].
        memory: Resident set [MiB].
        threads: Number of threads.
        files: Number of open files and sockets.
        waited: How long all its threads together were ready and had no core [s].
    """

    time: float
    memory: float
    threads: int
    files: int
    waited: float


def sample(pid: int, time: float) -> Sample:
    """Return the present resources of a process.

    Raises:
        OSError: There is no such process.
    """
    status = Path(f'/proc/{pid}/status').read_text(encoding='ascii', errors='replace')
    matches = (re.search(rf'^{name}:\s+(\d+)', status, re.M) for name in ('VmRSS', 'Threads'))
    memory, threads = (int(match[1]) if match else 0 for match in matches)
    files = sum(1 for _ in Path(f'/proc/{pid}/fd').iterdir())
    return Sample(time, memory / 1024, threads, files, _waited(pid))


def settled(samples: Sequence[Sample]) -> Sequence[Sample]:
    """Return the samples after the warm-up."""
    return samples[round(SETTLED * len(samples)) :]


def growth(samples: Sequence[Sample], what: str) -> float:
    """Return the growth of a resource after the warm-up: medians of the last and first eighth."""
    values = [getattr(s, what) for s in settled(samples)]
    part = max(len(values) // 8, 1)
    return statistics.median(values[-part:]) - statistics.median(values[:part])


def _waited(pid: int) -> float:
    """Return the time on the run queue of all threads [s]; 0 where the kernel does not count."""
    total = 0
    for thread in Path(f'/proc/{pid}/task').iterdir():
        try:
            total += int((thread / 'schedstat').read_text(encoding='ascii').split()[1])
        except (OSError, IndexError):  # it has just ended
            continue
    return total * 1e-9
