"""Measure `fly` from its start to its answer, next to Python that only imports numba.

Wall time of whole processes, the best of a few. The first time on a machine is measured with an
empty cache of machine code.

usage: benchmarks/startup.py
"""

import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time

from lines import Line, print_lines

ROUNDS = 5
MOST = 1.3  # times the import of numpy and numba
FLY = [str(Path(sys.executable).with_name('fly')), '--json']
IMPORTS = [sys.executable, '-c', 'import numpy, numba']


def main() -> None:
    """Print the measurements."""
    print_lines(lines())


def lines() -> tuple[Line, ...]:
    """Measure both starts alternately."""
    seconds(FLY)  # compiles if necessary
    pairs = [(seconds(FLY), seconds(IMPORTS)) for _ in range(ROUNDS)]
    warm, imports = (min(times) for times in zip(*pairs, strict=True))
    with tempfile.TemporaryDirectory() as empty:
        cold = seconds(FLY, XDG_CACHE_HOME=empty, NUMBA_CACHE_DIR='')
    return (
        Line(
            what='`fly`, start to answer',
            ours=f'{warm:.2f} s',
            beside=f'Python that imports numpy and numba {imports:.2f} s',
            ratio=warm / imports,
            bound=f'at most {MOST:g} times',
            kept=warm <= MOST * imports,
        ),
        Line(
            what='the same, first time on a machine',
            ours=f'{cold:.1f} s',
            beside=f'later {warm:.2f} s',
            ratio=cold / warm,
        ),
    )


def seconds(command: list[str], **environment: str) -> float:
    """Return the time that a process takes [s]."""
    start = time.perf_counter()
    subprocess.run(
        command, env={**os.environ, **environment}, stdout=subprocess.DEVNULL, check=True
    )
    return time.perf_counter() - start


if __name__ == '__main__':
    main()
