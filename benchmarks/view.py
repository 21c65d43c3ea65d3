"""Measure pages: the time and size of `fly --html`, and the CPU of live_view.

The time is that of whole processes, the best of a few, beside `fly` without a page. live_view
shows one disc that flies at 200 Hz to one viewer, which takes the states as a browser does.

usage: benchmarks/view.py [SECONDS]
"""

from collections.abc import Callable
import json
import os
from pathlib import Path
import re
import subprocess
import sys
import tempfile
import time

from websockets.sync.client import connect

from disc_sim_ros.ros.processes import own_domain
from lines import Line, print_lines
from startup import seconds as seconds_of

ROUNDS = 5
FLY = str(Path(sys.executable).with_name('fly'))
HIGH = 1000.0  # m: a disc thrown from here flies for minutes
LARGEST = 6e6  # bytes
CPU_BOUND = 0.05  # of a core
PATIENCE = 60.0  # s


def main() -> None:
    """Print the measurements."""
    print_lines(lines(*map(float, sys.argv[1:2])))


def lines(seconds: float = 10.0) -> tuple[Line, ...]:
    """Measure pages and live_view, the latter for some seconds."""
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder, 'throw.html')
        seconds_of([FLY])  # compiles if necessary
        pairs = [
            (seconds_of([FLY, '--html', str(page)]), seconds_of([FLY])) for _ in range(ROUNDS)
        ]
        size = page.stat().st_size
    html, alone = (min(times) for times in zip(*pairs, strict=True))
    watched, unwatched, rate = live_cpu(seconds)
    return (
        Line(
            what='`fly --html`, start to a finished page',
            ours=f'{html:.2f} s',
            beside=f'`fly` without a page {alone:.2f} s',
            ratio=html / alone,
        ),
        Line(
            what='the page of that flight',
            ours=f'{size / 1e6:.2f} MB',
            bound=f'at most {LARGEST / 1e6:g} MB',
            kept=size <= LARGEST,
        ),
        Line(
            what=f'`live_view`, one disc, one viewer, {rate:.0f} states/s',
            ours=f'{watched:.1%} of a core',
            beside=f'without a viewer {unwatched:.1%}',
            ratio=watched / unwatched if unwatched else None,
            bound=f'at most {CPU_BOUND:.0%}',
            kept=watched <= CPU_BOUND,
        ),
    )


def live_cpu(seconds: float) -> tuple[float, float, float]:
    """Return the CPU of live_view [cores] with and without a viewer, and its states a second."""
    sim = ('-p', f'launch.height:={HIGH}')
    with own_domain(), tempfile.TemporaryDirectory() as folder:
        log = Path(folder, 'log.txt')
        with log.open('wb') as file:
            processes = [
                subprocess.Popen(
                    [sys.executable, '-m', f'disc_sim_ros.ros.{name}', '--ros-args', *words],
                    stdout=file, stderr=file,
                )
                for name, words in (('live', ('-p', 'port:=0')), ('sim', sim))
            ]  # fmt: skip
        try:
            address = re.sub('/#.*', '/live', address_of(log)).replace('http', 'ws')
            with connect(address) as viewer:
                viewer.recv(PATIENCE)  # the disc is discovered and flies
                watched, count = cpu(processes[0].pid, seconds, viewer.recv)
            unwatched, _ = cpu(processes[0].pid, seconds, time.sleep)
        finally:
            for process in processes:
                process.terminate()
            for process in processes:
                process.wait(PATIENCE)
    return watched, unwatched, count / seconds


def address_of(log: Path) -> str:
    """Return the address that live_view has printed."""
    end = time.monotonic() + PATIENCE
    while (match := re.search(r'http://\S+', log.read_text(encoding='utf-8'))) is None:
        if time.monotonic() > end:
            raise TimeoutError(f'live_view has printed no address:\n{log.read_text()}')
        time.sleep(0.05)
    return match[0]


def cpu(
    pid: int, seconds: float, wait: Callable[[float], str | bytes | None]
) -> tuple[float, int]:
    """Return the CPU of a process [cores] over some seconds, and how many states came."""
    count, before, start = 0, ticks(pid), time.monotonic()
    while (left := start + seconds - time.monotonic()) > 0.0:
        try:
            text = wait(left)
        except TimeoutError:
            break
        count += bool(text) and 'discs' in json.loads(text)
    return (ticks(pid) - before) / (time.monotonic() - start), count


def ticks(pid: int) -> float:
    """Return the CPU time of a process [s]."""
    fields = Path(f'/proc/{pid}/stat').read_text(encoding='utf-8').rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


if __name__ == '__main__':
    main()
