"""The cost of a step, and the CPU of sim_node, with numba and without it, in one run.

Without it means that `import numba` fails, as where it is not installed. Each figure is measured
in processes of their own, in turns, and the least of the rounds counts.

usage: benchmarks/without_numba.py [seconds of each measurement of the node]
"""

from collections.abc import Iterator
from contextlib import contextmanager
import json
import os
from pathlib import Path
import subprocess
import sys
import tempfile

from disc_sim_ros.ros import processes
from lines import Line, print_lines
from node import measured

STEPS = 3000  # of the throw of Fig. 5, 1 ms each: before it lands
ROUNDS = 5
SINGLE = """
import json, sys, time
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels import jit
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator, warm_up
steps, size = map(int, sys.argv[1:])
warm_up()
setup = Setup(disc=load_disc('frisbee'), step=1e-3)
sim = FlightSimulator(setup, Launch().state())
start = time.process_time()
for _ in range(steps // size):
    sim.advance(size)
used = time.process_time() - start
assert not sim.landed
print(json.dumps([used / steps, jit.COMPILED]))
"""


def main() -> None:
    """Print the results."""
    print_lines(lines(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0))


def lines(seconds: float = 10.0) -> tuple[Line, ...]:
    """Measure and return the results; `seconds` for each measurement of the node."""
    with no_numba() as without, processes.own_domain():
        steps = []
        for size in (1, STEPS):
            pairs = [(step(size), step(size, **without)) for _ in range(ROUNDS)]
            steps.append(tuple(map(min, zip(*pairs, strict=True))))
        node = []
        for label, topics, commands in (
            ('no subscribers', [], 0),
            ('odom + pose 200 Hz, commands 200 Hz', ['odom', 'pose'], 200),
        ):
            arguments = (1000, 200, topics, commands, seconds)
            fast = measured(f'with numba, {label}', *arguments)
            slow = measured(f'without, {label}', *arguments, **without)
            node.append((label, fast, slow))
    (one, one_plain), (many, many_plain) = steps
    return (
        _steps('one step of 1 ms, one call each', one, one_plain),
        _steps(f'the same, {STEPS} steps in a call', many, many_plain),
        *(
            Line(
                what=f'`sim_node` 1 kHz, {label}',
                ours=_node(fast),
                beside=f'without numba {_node(slow)}',
                ratio=slow[0] / fast[0],
            )
            for label, fast, slow in node
        ),
    )


def _node(results: tuple[float, float, float, float]) -> str:
    cpu, rate, *_ = results  # a node that cannot keep up publishes less
    return f'{cpu:.1f} % of a core' + (f', {rate:.0f} of 200 odom a second' if rate else '')


def _steps(what: str, fast: float, slow: float) -> Line:
    return Line(
        what=what,
        ours=f'{fast * 1e6:.2f} us',
        beside=f'without numba {slow * 1e6:.0f} us',
        ratio=slow / fast,
    )


@contextmanager
def no_numba() -> Iterator[dict[str, str]]:
    """Yield an environment in which `import numba` fails."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, 'numba.py').write_text("raise ImportError('not installed')\n")
        yield {'PYTHONPATH': os.pathsep.join([folder, os.environ.get('PYTHONPATH', '')])}


def step(size: int, **environment: str) -> float:
    """Return the CPU time of a step [s], `size` steps in each call."""
    command = [sys.executable, '-c', SINGLE, str(STEPS), str(size)]
    process = subprocess.run(
        command, env={**os.environ, **environment}, check=True, capture_output=True, text=True
    )
    used, compiled = json.loads(process.stdout)
    if compiled is bool(environment):
        raise RuntimeError(f'compiled: {compiled}, with {environment}')
    return used


if __name__ == '__main__':
    main()
