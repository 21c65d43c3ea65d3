"""A day of throws through the predictor: beginnings and ends, and what the process holds.

    .venv/bin/python benchmarks/predictor_stream.py --hours 24

A disc is held still, a hand accelerates it with 100 m/s^2, it flies by the exact model, and lies
where it landed; a throw every 30 s, measured 60 times a second to 2 cm, without attitude. What
lies still is measured twice a second between the throws.
"""

import argparse
from collections.abc import Iterator
import math
from pathlib import Path
import resource
import sys
import time

import numpy as np

from disc_sim_ros.estimation.prediction.predictor import Measurement, Predictor, PredictorConfig
from disc_sim_ros.estimation.prediction.prior import ThrowPrior, disc_offsets
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from estimation.synthetic_throws import Throw, throw

PERIOD = 30.0  # s, of the throws
RATE = 60.0  # Hz
HAND = 100.0  # m/s^2
SIGMA = 0.02  # m
OFTEN = 0.4  # s after a release, and around a landing, with an update for each measurement
UPDATE = 0.05  # s between two updates elsewhere


def main() -> int:
    """Print a row each simulated hour, and a summary."""
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument('--hours', type=float, default=24.0)
    o = p.parse_args()
    disc = load_disc('ultrastar')
    prior = ThrowPrior(offsets=disc_offsets(disc))
    setup = Setup(disc=disc)
    predictor = Predictor(PredictorConfig(setup=setup, prior=prior))
    rng = np.random.default_rng(0)
    begins, ends, misses, began = [], [], [], time.process_time()
    count = round(o.hours * 3600.0 / PERIOD)
    for k in range(count):
        flown = throw(setup, prior, k, rate=RATE, sigma=SIGMA, least=0.9)
        first, last, miss, number = follow(predictor, flown, k * PERIOD, rng)
        begins.append(first)
        ends.append(last)
        misses.append(miss if number == 1 else math.nan)
        if (k + 1) % round(3600.0 / PERIOD) == 0:
            hour = round((k + 1) * PERIOD / 3600.0)
            held = memory()
            print(f'hour {hour}: {predictor.throws} throws, {held:.1f} MB', flush=True)
    print(
        f'{count} throws, {predictor.throws} recognised, {np.isnan(misses).sum()} not once each; '
        f'{time.process_time() - began:.0f} s of CPU\n'
        f'begin after the release: {quantiles(begins)}\nend after the landing: {quantiles(ends)}\n'
        f'miss of the last prediction: median {np.nanmedian(misses):.3f} m'
    )
    return 0


def follow(
    predictor: Predictor, flown: Throw, start: float, rng: np.random.Generator
) -> tuple[float, float, float, int]:
    """Return when a throw began and ended, its last miss, and how many were recognised."""
    before = predictor.throws
    first = last = miss = math.nan
    newest = -math.inf
    for m, t in measurements(flown, start, rng):
        predictor.add(m)
        critical = -OFTEN < t < OFTEN or t > flown.landing[2] - OFTEN
        if not critical and t - newest < UPDATE:
            continue
        newest = t
        was = predictor.is_following
        prediction = predictor.update(ellipse=False)
        if prediction is not None:
            miss = math.dist(prediction.landing, flown.landing[:2])
        if predictor.is_following and math.isnan(first):
            first = t
        if was and not predictor.is_following:
            last = t - float(flown.landing[2])
    return first, last, miss, predictor.throws - before


def measurements(
    flown: Throw, start: float, rng: np.random.Generator
) -> Iterator[tuple[Measurement, float]]:
    """Yield measurements and their times since the release, from rest to rest."""
    x0 = flown.exact[0]
    velocity = (flown.exact[1] - flown.exact[0]) * RATE
    speed = float(np.linalg.norm(velocity))
    for tau in np.concatenate([np.arange(-8.0, -0.6, 0.5), np.arange(-36, 0) / RATE]):
        moved = max(float(tau), -speed / HAND)
        at = x0 + velocity * moved + 0.5 * HAND * velocity / speed * moved**2
        yield Measurement(start + float(tau), tuple(at + rng.normal(0.0, SIGMA, 3))), float(tau)
    for t, at in zip(flown.time, flown.position, strict=True):
        yield Measurement(start + float(t), tuple(at)), float(t)
    x, y, end = (float(v) for v in flown.landing)
    for after in np.concatenate([np.arange(1, 60) / RATE, np.arange(1.5, 12.0, 0.5)]):
        at = np.array([x, y, 0.0]) + rng.normal(0.0, SIGMA, 3)
        yield Measurement(start + end + float(after), tuple(at)), end + float(after)


def quantiles(values: list[float]) -> str:
    """Return median, 99 % and largest of times [s], and how many there are not."""
    known = np.array(values)[np.isfinite(values)]
    middle, high, most = np.quantile(known, [0.5, 0.99, 1.0])
    missing = len(values) - len(known)
    return f'median {middle:.3f} s, p99 {high:.3f} s, most {most:.3f} s; {missing} without'


def memory() -> float:
    """Return the memory that the process holds now [MB], where Linux tells; else its peak."""
    status = Path('/proc/self/statm')
    if status.exists():
        return int(status.read_text().split()[1]) * resource.getpagesize() / 1e6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


if __name__ == '__main__':
    sys.exit(main())
