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
from disc_sim_ros.estimation.identification.coefficients import NAMES
from disc_sim_ros.estimation.identification.identify import Identification, identify
from disc_sim_ros.estimation.identification.observations import NOISE
from disc_sim_ros.estimation.identification.throws import RELEASE_SIZE
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.launch import Launch

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from estimation import synthetic_sessions

BASE = Setup(disc=load_disc('ultrastar'))


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
        values, wind, throws = synthetic_sessions.drawn(seed, BASE, kinds, count=chosen.throws)
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
