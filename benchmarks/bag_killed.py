"""How much a killed recorder loses, with messages at 1 kHz and a flush every 0.5 s.

Writers are killed (SIGKILL) at random moments; the loss is the time between the last message on
the disk and the last one that the writer had accepted. Then each bag is repaired.

usage: benchmarks/bag_killed.py [FOLDER]   (a folder on the disk to measure with; default: here)
"""

from pathlib import Path
import random
import statistics
import subprocess
import sys
import tempfile
import time

from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from lines import Line, print_lines

CHILD = Path(__file__).parents[1] / 'test/bags/killed.py'
KILLS = 24
AT_ONCE = 3
FLUSH_PERIOD = 0.5  # s
MOST = 1.0  # s lost
RATE = 1000  # Hz
LONGEST = 2.0  # s that a writer lives after its first flush


def main() -> None:
    """Print the results."""
    print_lines(lines(Path(sys.argv[1]) if len(sys.argv) > 1 else Path()))


def lines(parent: Path = Path()) -> tuple[Line, ...]:
    """Kill writers, measure the loss and repair the bags, on the disk of a folder."""
    rng = random.Random(1)  # noqa: S311 - not for secrets
    losses, repairs = [], []
    with tempfile.TemporaryDirectory(dir=parent) as scratch:
        for first in range(0, KILLS, AT_ONCE):
            folders = [Path(scratch, f'bag{first + n}') for n in range(AT_ONCE)]
            kill(folders, rng.uniform(0.0, LONGEST))
            for folder in folders:
                taken = int.from_bytes(folder.with_suffix('.taken').read_bytes(), 'little')
                losses.append(max(0.0, (taken - open_bag(folder).end) * 1e-9))
                start = time.process_time()
                report = repair(folder, folder.with_suffix('.repaired'))
                repairs.append(time.process_time() - start)
                assert report.message_count == open_bag(report.target).message_count  # noqa: S101
    print(f'{KILLS} kills, {RATE} messages a second, flushed every {FLUSH_PERIOD} s')
    print(f'repaired in {statistics.median(repairs):.3f} s of CPU time each (median)')
    worst = max(losses)
    return (
        Line(
            what=f'what {KILLS} killed recorders lost',
            ours=f'median {statistics.median(losses):.2f} s, worst {worst:.2f} s',
            beside=f'flushed every {FLUSH_PERIOD} s',
            ratio=worst / FLUSH_PERIOD,
            bound=f'at most {MOST:g} s',
            kept=worst <= MOST,
        ),
    )


def kill(folders: list[Path], life: float) -> None:
    """Write bags and kill the writers some time [s] after their first flush."""
    options = [str(FLUSH_PERIOD), str(RATE), str(10**9)]
    children = [
        subprocess.Popen([sys.executable, CHILD, folder, *options], stdout=subprocess.PIPE)
        for folder in folders
    ]
    for child in children:
        assert child.stdout is not None  # noqa: S101
        child.stdout.readline()
    time.sleep(life)
    for child in children:
        child.kill()
    for child in children:
        child.communicate()


if __name__ == '__main__':
    main()
