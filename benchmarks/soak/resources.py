"""What a process holds: memory, threads and open files, from /proc, over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import re
import statistics

SETTLED = 0.25  # of the samples: what comes before is warming up
MOST_GROWTH = 4.0  # MiB from there to the end; an allocator may still take a little


@dataclass(frozen=True, slots=True)
class Sample:
    """What a process holds at a time.

    Attributes:
        time: Since the beginning [s].
        memory: Resident set [MiB].
        threads: Number of threads.
        files: Number of open files and sockets.
    """

    time: float
    memory: float
    threads: int
    files: int


def sample(pid: int, time: float) -> Sample:
    """Return what a process holds now.

    Raises:
        OSError: There is no such process.
    """
    status = Path(f'/proc/{pid}/status').read_text(encoding='ascii', errors='replace')
    found = {name: re.search(rf'^{name}:\s+(\d+)', status, re.M) for name in ('VmRSS', 'Threads')}
    memory, threads = (int(match[1]) if match else 0 for match in found.values())
    return Sample(time, memory / 1024, threads, sum(1 for _ in Path(f'/proc/{pid}/fd').iterdir()))


def growth(samples: Sequence[Sample]) -> float:
    """Return how much the memory grew once settled [MiB]: medians of the first and last eighth."""
    settled = samples[round(SETTLED * len(samples)) :]
    part = max(len(settled) // 8, 1)
    first, last = (
        statistics.median(s.memory for s in some) for some in (settled[:part], settled[-part:])
    )
    return last - first


def problems(name: str, samples: Sequence[Sample]) -> list[str]:
    """Return what grew that should not."""
    settled = samples[round(SETTLED * len(samples)) :]
    found = []
    if growth(samples) > MOST_GROWTH:
        found.append(f'{name}: memory grew by {growth(samples):.1f} MiB')
    for what in ('threads', 'files'):
        numbers = [getattr(s, what) for s in settled]
        if numbers[-1] > numbers[0]:
            found.append(f'{name}: {what} grew from {numbers[0]} to {numbers[-1]}')
    return found
