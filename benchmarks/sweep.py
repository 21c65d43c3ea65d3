"""Measure `sweep`: time, CPU and peak memory over the number of flights.

Usage: python benchmarks/sweep.py [--longest SECONDS] [--short] [COUNT ...]

Each count is one run of the program: a Monte Carlo study of the Fig. 5 throw with six scattered
quantities, into a Parquet file, with its summary. The system reports its time and memory. With
--short each flight is one step of 20 ms: the cost of sampling, writing, joining and statistics.
With --parts one run in this process, with one worker, tells the CPU time of each part.
`make bench` compares one worker with two.
"""

import argparse
from contextlib import redirect_stdout
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time
from typing import Any

from lines import Line, number

COUNT = 300_000
ROUNDS = 3
LEAST = 1.9  # times the rate of one worker
SCATTER = ('speed=1', 'pitch=2', 'roll=3', 'yaw=2', 'spin=1', 'lift_factor=0.03')
PROGRAM = Path(sys.executable).with_name('sweep')


def lines(count: int = COUNT) -> tuple[Line, ...]:
    """Measure a study with one worker and with two, alternately."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        measure(2, folder, short=False)  # compiles
        pairs = [
            [measure(count, folder, short=False, workers=n)[0] for n in (1, 2)]
            for _ in range(ROUNDS)
        ]
    one, two = (min(seconds) for seconds in zip(*pairs, strict=True))
    return (
        Line(
            what=f'`sweep` of {count:,} throws in 20 ms steps, 2 workers',
            ours=f'{number(count / two)} flights a second, with start, file and summary',
            beside=f'1 worker {number(count / one)}',
            ratio=one / two,
            bound=f'at least {LEAST:g} times',
            kept=one >= LEAST * two,
        ),
    )


def measure(
    count: int, folder: Path, *, short: bool, workers: int = 0
) -> tuple[float, float, int, int]:
    """Return wall time [s], CPU time [s], peak memory [bytes] and size of the file [bytes]."""
    words = [str(PROGRAM), '--count', str(count), '--step', '0.02', '--output', 'a.parquet']
    words += ['--force', *(word for text in SCATTER for word in ('--scatter', text))]
    words += ['--no-ground', '--duration', '0.02'] if short else []
    words += ['--workers', str(workers)] if workers else []
    started = time.perf_counter()
    with subprocess.Popen(
        words, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    seconds = time.perf_counter() - started
    if process.returncode:
        raise SystemExit(f'sweep ended with code {process.returncode}')
    size = (folder / 'a.parquet').stat().st_size
    return seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * _unit(), size


def measure_parts(count: int) -> None:
    """Print the CPU time of the parts of one sweep, each of its own thread [s]."""
    start = time.process_time()
    from disc_sim_ros.cli import sweep as program  # noqa: PLC0415 - the import is measured
    from disc_sim_ros.studies import runner, storage, summary  # noqa: PLC0415

    seconds: dict[str, float] = {}

    def timed(place: Any, name: str) -> None:
        function = getattr(place, name)

        def measured(*arguments: Any, **named: Any) -> Any:
            before = time.thread_time()
            try:
                return function(*arguments, **named)
            finally:
                seconds[name] = seconds.get(name, 0.0) + time.thread_time() - before

        setattr(place, name, measured)

    timed(runner, 'fly_batch')
    timed(storage.Parts, 'keep')
    timed(storage.Parts, 'join')
    timed(summary, 'summarise')
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(None):
        file = str(Path(folder, 'a.parquet'))
        words = ['--count', str(count), '--step', '0.02', '--output', file, '--workers', '1']
        program.main([*words, *(word for text in SCATTER for word in ('--scatter', text))])
    text = ', '.join(f'{name} {value:.2f} s' for name, value in seconds.items())
    print(f'{count} flights: {text}; all {time.process_time() - start:.2f} s')


def _unit() -> int:
    return 1 if sys.platform == 'darwin' else 1024


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('counts', metavar='COUNT', nargs='*', type=int)
    parser.add_argument('--longest', type=float, default=360.0, help='stop before a longer run')
    parser.add_argument('--short', action='store_true', help='flights of one step')
    parser.add_argument('--parts', action='store_true', help='the CPU time of each part')
    chosen = parser.parse_args()
    if chosen.parts:
        measure_parts(chosen.counts[0] if chosen.counts else COUNT)
        return
    cores = len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count()
    print(f'{cores} cores, load {os.getloadavg()[0]:.1f}', flush=True)
    print('    flights   wall s    CPU s  flights/s  flights/CPU-s  peak MiB  file MB', flush=True)
    rate = 0.0
    with tempfile.TemporaryDirectory() as name:
        measure(2, Path(name), short=chosen.short)  # compiles
        start = measure(2, Path(name), short=chosen.short)[0]
        for count in chosen.counts or [10**3, 10**4, 10**5, 10**6, 10**7]:
            if rate and count / rate > chosen.longest:
                print(f'{count:11d}   would take {count / rate:.0f} s: not flown')
                continue
            wall, cpu, memory, size = measure(count, Path(name), short=chosen.short)
            rate = count / max(wall - start, 0.1)
            print(
                f'{count:11d} {wall:8.2f} {cpu:8.2f} {count / wall:10.0f} {count / cpu:14.0f} '
                f'{memory / 2**20:9.0f} {size / 1e6:8.1f}',
                flush=True,
            )


if __name__ == '__main__':
    main()
