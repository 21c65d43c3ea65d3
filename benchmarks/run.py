"""Run all benchmarks, one after the other, and collect their results in one table.

Each runs in its own process. Peers need their own environment (benchmarks/peers.py explains how to
make it); without it their lines say so. Takes about 7 minutes on an idle machine.

usage: benchmarks/run.py [--write] [--only NAME ...] [--peers PYTHON]
"""

import argparse
from dataclasses import asdict
import datetime
import importlib
from importlib.metadata import version
import json
import os
from pathlib import Path
import platform
import subprocess
import sys
import tempfile
import time
from typing import Any

from lines import Line, print_lines
import pages
from pages import Machine, Result, Run

# Name, arguments of its lines(), arguments of its command.
BENCHMARKS: dict[str, tuple[dict[str, Any], str]] = {
    'flights': ({}, ''),
    'ensemble': ({'largest': 1e6}, ''),
    'sweep': ({}, ''),
    'learning': ({}, ''),
    'steps': ({}, ''),
    'peers': ({'seconds': 3.0}, ''),
    'startup': ({}, ''),
    'fly_bag': ({}, ''),
    'node': ({'seconds': 5.0}, ' 5'),
    'recorder': ({'seconds': 30.0}, ' 30'),
    'bag_writer': ({}, ''),
    'bag_killed': ({}, ''),
    'view': ({}, ''),
}
PEERS = pages.ROOT / 'peers/bin/python'


def main() -> int:
    """Measure, print and, with --write, write the pages."""
    if sys.argv[1:2] == ['one']:
        return one(*sys.argv[2:])
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('--write', action='store_true', help='write docs/ and README.md')
    parser.add_argument('--only', nargs='+', choices=BENCHMARKS, metavar='NAME',
                        help=f'run only these and write nothing: {", ".join(BENCHMARKS)}',
                        )  # fmt: skip
    parser.add_argument('--peers', type=Path, default=PEERS, metavar='PYTHON',
                        help='Python with the peers installed (default: peers/bin/python)',
                        )  # fmt: skip
    chosen = parser.parse_args()
    if chosen.only and chosen.write:
        parser.error('--write writes whole tables: leave out --only')
    try:
        run, failed = measured(chosen.only or list(BENCHMARKS), chosen.peers, write=chosen.write)
    except KeyboardInterrupt:
        return 130
    print()
    for result in run.results:
        print_lines(result.lines)
    print(pages.described(run.machine))
    if failed:
        print(f'benchmarks: {", ".join(failed)} failed, nothing is written', file=sys.stderr)
        return 1
    if chosen.write:
        pages.write(run)
    return 0


def measured(names: list[str], peers: Path, *, write: bool) -> tuple[Run, list[str]]:
    """Run some benchmarks; return their results and the names of those that failed."""
    load, begun = os.getloadavg()[0], time.monotonic()
    results, failed = [], []
    for name in names:
        try:
            results.append(result(name, peers, write=write))
        except subprocess.CalledProcessError:  # the process has printed the reason
            failed.append(name)
    run = Run(machine=machine(load, time.monotonic() - begun), results=tuple(results))
    return run, failed


def result(name: str, peers: Path, *, write: bool) -> Result:
    """Run one benchmark in its own process.

    Raises:
        CalledProcessError: The benchmark failed.
    """
    arguments, words = BENCHMARKS[name]
    if name == 'steps':
        arguments = {'write': write}
    python = sys.executable
    if name == 'peers' and peers.exists():
        python = str(peers)
    load = os.getloadavg()[0]
    print(f'== benchmarks/{name}.py', flush=True)
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, 'lines.json')
        command = [python, __file__, 'one', name, json.dumps(arguments), str(file)]
        subprocess.run(command, cwd=pages.ROOT, check=True)
        lines = json.loads(file.read_text(encoding='utf-8'))
    return Result(
        command=f'benchmarks/{name}.py{words}',
        load=load,
        lines=tuple(Line(**line) for line in lines),
    )


def one(name: str, arguments: str, file: str) -> int:
    """Run one benchmark in this process and write its lines to a file."""
    lines = importlib.import_module(name).lines(**json.loads(arguments))
    Path(file).write_text(json.dumps([asdict(line) for line in lines]), encoding='utf-8')
    return 0


def machine(load: float, seconds: float) -> Machine:
    """Describe this machine, its load at the start and the duration [s]."""
    from flights import cpu_name  # noqa: PLC0415 - not in the environment of the peers

    return Machine(
        cpu=cpu_name(),
        cores=os.cpu_count() or 1,
        system=f'{platform.system()} {platform.machine()}',
        python=platform.python_version(),
        numba=version('numba'),
        numpy=version('numpy'),
        date=datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        load_at_start=round(load, 2),
        load_at_end=round(os.getloadavg()[0], 2),
        seconds=round(seconds, 1),
    )


if __name__ == '__main__':
    sys.exit(main())
