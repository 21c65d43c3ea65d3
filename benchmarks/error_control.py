"""Errors of landings with error control, over the flights that test_error_control.py draws.

Each disc of the catalogue flies as many throws as are asked for, with wobble, spins up to
130 rad/s (each eighth up to 1300), wind, gusts and commands. The reference is RK4 in steps of
0.025 ms, or of 0.004 ms where steps of 0.05 ms differ from it by more than 4e-7 m. Flights whose
references still differ are left out and counted: such discs tumble, and their landing depends on
every digit.

usage: benchmarks/error_control.py [throws of each disc, 20]; a second for each throw
"""

from dataclasses import replace
import math
from pathlib import Path
import sys
import time

sys.path.insert(0, str(Path(__file__).parents[1] / 'test/physics'))

import numpy as np
from test_error_control import drawn

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import MODELS, Setup, fly
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch

PROMISED = 1e-5  # m
AGREED = 4e-7  # m, between two references
STEPS = ((5e-5, 2.5e-5), (1e-5, 4e-6))  # s, pairs of references


def main() -> None:
    """Print the errors for each rigid-body model."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    errors: dict[str, list[float]] = {model: [] for model in MODELS}
    unknown, worst, seconds = 0, (0.0, ''), 0.0
    for name in disc_file.disc_names():
        for number in range(count):
            launch, setup, control = drawn(name, number)
            landing = reference(launch, setup, control)
            if landing is None:
                unknown += 1
                continue
            start = time.process_time()
            position = fly(launch, setup, control=control, sample_rate=0.0).position
            seconds += time.process_time() - start
            error = math.dist(position, landing)
            errors[setup.model].append(error)
            worst = max(worst, (error, f'{name}, number {number}'))
    print('error, mm        flights    median       99%     99.9%   largest   beyond 0.01')
    for model, its_errors in errors.items():
        e = np.array(its_errors)
        quantiles = ' '.join(f'{1e3 * q:9.2g}' for q in np.quantile(e, [0.5, 0.99, 0.999, 1.0]))
        print(f'{model:14s} {len(e):9d} {quantiles} {(e > PROMISED).sum():13d}')
    print(f'largest: {worst[1]}; {unknown} without a reference; {seconds:.2f} CPU-s')


def reference(launch: Launch, setup: Setup, control: Control) -> list[float] | None:
    """Return the landing in fine steps [m], or None where two step sizes do not agree."""
    for steps in STEPS:
        a, b = (
            fly(launch, replace(setup, step=h), control=control, sample_rate=0.0).position
            for h in steps
        )
        if math.dist(a, b) < AGREED:
            return [float(x) for x in b]
    return None


if __name__ == '__main__':
    main()
