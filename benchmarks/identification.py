"""Identify discs from synthetic sessions: is the truth within the errors, how near is the bound.

python benchmarks/identification.py --kinds position,gyro --sessions 20
"""

import argparse
from dataclasses import replace
from pathlib import Path
import sys
import time

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.estimation.coefficients import NAMES, base_of
from disc_sim_ros.estimation.identification import Identification, identify
from disc_sim_ros.estimation.observations import GYRO, NOISE
from disc_sim_ros.estimation.throws import RELEASE_SIZE, Throw
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.frames import flip_yz
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.quantities import COEFFICIENT_SPREAD, COEFFICIENTS

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from estimation import synthetic_sessions

BASE = Setup(disc=load_disc('ultrastar'))
SHARE = 0.3  # of the spread of discs: how far the true disc lies from the base, one deviation
SPIN_ERROR = 3.0  # rad/s, of the spin that is told where no gyro measures it


def truth(generator: np.random.Generator) -> FloatArray:
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
) -> tuple[FloatArray, FloatArray, list[tuple[Throw, Launch]]]:
    """Return the true coefficients, the true wind and the throws with their true releases."""
    generator = np.random.default_rng(seed)
    values = truth(generator)
    wind = generator.normal(0.0, 2.0, 2)
    setup = replace(BASE, step=5e-4, wind=Wind(mean=flip_yz((*wind, 0.0))))
    error = None if GYRO in kinds else SPIN_ERROR
    throws = synthetic_sessions.thrown(
        values, setup, kinds, generator, count=count, spin_error=error
    )
    return values, wind, throws


def bound(
    result: Identification, values: FloatArray, wind: FloatArray, launches: list[Launch]
) -> FloatArray:
    """Return the Cramer-Rao bound of the coefficients, nan where held, shape (9,).

    The inverse of the information of all measurements, at the true parameters, with the true
    noise and with what `identify` is told beforehand.
    """
    problem = result.problem
    throws = zip(problem.throws, launches, strict=True)
    problem = replace(
        problem,
        held=values,
        noise=NOISE,
        throws=tuple(throw.starting_at(np.array(launch.state())) for throw, launch in throws),
    )
    n = problem.shared
    shared = np.array([*values[list(problem.free)], *wind])
    total = np.diag(1.0 / problem.shared_deviations**2)
    for k, throw in enumerate(problem.throws):
        here = np.concatenate([shared, np.zeros(RELEASE_SIZE)])
        _, slopes = problem.linearised(k, here)
        normal = slopes.T @ slopes
        own = normal[n:, n:] + throw.information.T @ throw.information
        total += normal[:n, :n] - normal[:n, n:] @ np.linalg.solve(own, normal[n:, :n])
    errors = np.full(len(NAMES), np.nan)
    scale = 1.0 / np.sqrt(np.diag(total))
    covariance = np.linalg.inv(total * np.outer(scale, scale)) * np.outer(scale, scale)
    errors[list(problem.free)] = np.sqrt(np.diag(covariance))[: len(problem.free)]
    return errors


def main() -> None:
    """Print a line for each session, and the shares."""
    p = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    p.add_argument('--kinds', default='position,gyro')
    p.add_argument('--sessions', type=int, default=20)
    p.add_argument('--first', type=int, default=0, help='seed of the first session')
    p.add_argument('--throws', type=int, default=5)
    chosen = p.parse_args()
    kinds = tuple(chosen.kinds.split(','))
    every: list[FloatArray] = []
    over_bound: list[FloatArray] = []
    whole, seconds = 0, []
    for seed in range(chosen.first, chosen.first + chosen.sessions):
        values, wind, throws = session(seed, chosen.throws, kinds)
        started, cpu = time.monotonic(), time.process_time()
        try:
            result = identify([throw for throw, _ in throws], BASE)
        except DiscSimError as error:
            print(f'{seed:4} {error}', flush=True)
            continue
        seconds.append(time.monotonic() - started)
        z = (result.values - values) / result.errors
        fitted = z[np.isfinite(z)]
        every.append(np.abs(fitted))
        whole += bool((np.abs(fitted) < 3.0).all())
        ratio = result.errors / bound(result, values, wind, [launch for _, launch in throws])
        over_bound.append(ratio[np.isfinite(ratio)])
        print(
            f'{seed:4} {seconds[-1]:6.1f} s, {time.process_time() - cpu:6.1f} s of CPU, errors in '
            f'standard errors {np.array2string(z, precision=1)}, over the bound '
            f'{np.array2string(ratio, precision=2)}',
            flush=True,
        )
    flat, ratios = np.concatenate(every), np.concatenate(over_bound)
    print(
        f'{kinds}: {len(every)} of {chosen.sessions} sessions of {chosen.throws} throws; within 3 '
        f'standard errors: {np.mean(flat < 3.0):.1%} of {len(flat)} coefficients, all of them in '
        f'{whole} sessions; standard errors over the Cramer-Rao bound: median '
        f'{np.median(ratios):.2f}, at most 1.5 in {np.mean(ratios <= 1.5):.1%}; median '
        f'{np.median(seconds):.0f} s a session'
    )


if __name__ == '__main__':
    main()
