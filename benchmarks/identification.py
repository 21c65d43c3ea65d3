"""Identify discs from synthetic sessions, and count how often the truth lies within the errors.

python benchmarks/identification.py --kinds position,gyro --sessions 20
"""

import argparse
from dataclasses import replace
from pathlib import Path
import sys
import time

import numpy as np

from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.estimation.coefficients import NAMES, base_of
from disc_sim_ros.estimation.identification import identify
from disc_sim_ros.estimation.observations import GYRO
from disc_sim_ros.estimation.throws import Throw
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.frames import flip_yz
from disc_sim_ros.quantities import COEFFICIENT_SPREAD, COEFFICIENTS

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from estimation import synthetic_sessions

BASE = Setup(disc=load_disc('ultrastar'))
SHARE = 0.3  # of the spread of discs: how far the true disc lies from the base, one deviation
SPIN_ERROR = 3.0  # rad/s, of the spin that is told where no gyro measures it


def truth(generator: np.random.Generator) -> np.ndarray:
    """Draw the coefficients of a disc."""
    base = base_of(BASE)
    spread = np.array([COEFFICIENT_SPREAD[name] for name in NAMES])
    values = base.values + SHARE * spread * generator.standard_normal(len(NAMES))
    low = [COEFFICIENTS[name].lowest for name in NAMES]
    high = [COEFFICIENTS[name].highest for name in NAMES]
    low[NAMES.index('damping')] = 0.2  # a factor near 0 wobbles for ever
    return np.clip(values, low, high)


def session(
    seed: int, count: int, kinds: tuple[str, ...]
) -> tuple[np.ndarray, np.ndarray, list[Throw]]:
    """Return the true coefficients, the true wind and the throws of a session."""
    generator = np.random.default_rng(seed)
    values = truth(generator)
    wind = generator.normal(0.0, 2.0, 2)
    setup = replace(BASE, step=5e-4, wind=Wind(mean=flip_yz((*wind, 0.0))))
    error = None if GYRO in kinds else SPIN_ERROR
    throws = synthetic_sessions.session(
        values, setup, kinds, generator, count=count, spin_error=error
    )
    return values, wind, throws


def main() -> None:
    """Print a line for each session, and the shares."""
    p = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    p.add_argument('--kinds', default='position,gyro')
    p.add_argument('--sessions', type=int, default=20)
    p.add_argument('--first', type=int, default=0, help='seed of the first session')
    p.add_argument('--throws', type=int, default=5)
    chosen = p.parse_args()
    kinds = tuple(chosen.kinds.split(','))
    every: list[np.ndarray] = []
    whole, seconds = 0, []
    for seed in range(chosen.first, chosen.first + chosen.sessions):
        values, _, throws = session(seed, chosen.throws, kinds)
        started, cpu = time.monotonic(), time.process_time()
        try:
            result = identify(throws, BASE)
        except DiscSimError as error:
            print(f'{seed:4} {error}', flush=True)
            continue
        seconds.append(time.monotonic() - started)
        z = (result.values - values) / result.errors
        fitted = z[np.isfinite(z)]
        every.append(np.abs(fitted))
        whole += bool((np.abs(fitted) < 3.0).all())
        print(
            f'{seed:4} {seconds[-1]:6.1f} s, {time.process_time() - cpu:6.1f} s of CPU, errors in '
            f'standard errors {np.array2string(z, precision=1)}',
            flush=True,
        )
    flat = np.concatenate(every)
    print(
        f'{kinds}: {len(every)} of {chosen.sessions} sessions of {chosen.throws} throws; within 3 '
        f'standard errors: {np.mean(flat < 3.0):.1%} of {len(flat)} coefficients, all of them in '
        f'{whole} sessions; median {np.median(seconds):.0f} s a session'
    )


if __name__ == '__main__':
    main()
