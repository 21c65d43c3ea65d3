"""Measure how fast `fly --bag` writes a bag, next to `analyse_bag`, which reads it.

Each is a whole process, from its start to its end. The disc flies for a while high above the
ground, with all topics at their usual rates.

usage: benchmarks/fly_bag.py [SECONDS] (of flight, default 60)
"""

from pathlib import Path
import subprocess
import sys
import tempfile
import time

from disc_sim_ros.bags.reader import open_bag
from lines import Line, number, print_lines

FLIGHT_S = 60.0
ROUNDS = 3
PROGRAMS = Path(sys.executable).parent


def main() -> None:
    """Print the measurements."""
    print_lines(lines(*map(float, sys.argv[1:2])))


def lines(flight_s: float = FLIGHT_S) -> tuple[Line, ...]:
    """Write and read a bag alternately."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(folder / 'first', 0.1)  # compiles
        pairs = []
        for k in range(ROUNDS):
            bag = folder / str(k)
            pairs.append((write(bag, flight_s), seconds('analyse_bag', str(bag))))
        count = sum(topic.message_count for topic in open_bag(bag).topics)
    written, read = (min(times) for times in zip(*pairs, strict=True))
    return (
        Line(
            what=f'`fly --bag` of {flight_s:g} s of flight',
            ours=f'{number(count / written)} messages a second, '
            f'{number(written / count * 1e6)} us each, with the start',
            beside=f'`analyse_bag` reads {number(count / read)} a second',
            ratio=read / written,
        ),
    )


def write(bag: Path, flight_s: float) -> float:
    """Return the time in which `fly` writes the bag of a flight [s]."""
    words = ('--height', '5000', '--no-ground', '--duration', f'{flight_s:g}')
    return seconds('fly', '--bag', str(bag), *words)


def seconds(program: str, *words: str) -> float:
    """Return the time that a process takes [s]."""
    start = time.perf_counter()
    command = [str(PROGRAMS / program), *words]
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start


if __name__ == '__main__':
    main()
