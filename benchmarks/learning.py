"""Measure the environment Steer-v0: steps per second of many discs, and the trained policy.

A step of the environment is five integration steps of 10 ms, the observations, the rewards and
the new throws of discs that landed. The first line is of the time that passes, the best of a few
rounds, on all cores; the second of the CPU time of all threads, which other programs change less.
The policy flies new throws in wind that it is not told.

usage: benchmarks/learning.py [DISCS] (default 4096)
"""

import os
import sys
import time

import numpy as np

from disc_sim_ros.envs.policy import trained_policy
from disc_sim_ros.envs.steer import SteerVectorEnv
from flights import cpu_name
from lines import Line, number, print_lines

GOAL = 1e6  # steps of the environment a second, on two cores
STEPS = 200  # of each disc in a round
ROUNDS = 7
THROWS = 4096
NEAR = 1.0  # m


def main() -> None:
    """Print the measurements."""
    print(f'{cpu_name()}, {os.cpu_count()} cores')
    print_lines(lines(*map(int, sys.argv[1:2])))


def lines(discs: int = 4096) -> tuple[Line, ...]:
    """Measure the environment with some discs, and the policy."""
    passing, busy = rates(discs)
    distances = misses()
    median, share = float(np.median(distances)), float(np.mean(distances < NEAR))
    return (
        Line(
            what=f'Steer-v0, {discs} discs',
            ours=f'{number(passing)} environment steps/s',
            bound=f'at least {GOAL:,.0f}',
            kept=passing >= GOAL,
        ),
        Line(what='the same for each second of CPU time', ours=f'{number(busy)} steps'),
        Line(
            what=f'trained policy, {THROWS} throws in unknown wind',
            ours=f'median miss {median:.2f} m, {share:.0%} within {NEAR:g} m',
            bound=f'median at most {NEAR:g} m',
            kept=median <= NEAR,
        ),
    )


def rates(discs: int) -> tuple[float, float]:
    """Return the steps per second of the best round, by the clock and by CPU time."""
    vector = SteerVectorEnv(discs)
    vector.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = [rng.uniform(-1, 1, (discs, 3)).astype(np.float32) for _ in range(8)]
    passing, busy = [], []
    for _ in range(ROUNDS):
        start, cpu = time.perf_counter(), time.process_time()
        for k in range(STEPS):
            vector.step(actions[k % len(actions)])
        passing.append(time.perf_counter() - start)
        busy.append(time.process_time() - cpu)
    vector.close()
    return discs * STEPS / min(passing), discs * STEPS / min(busy)


def misses() -> np.ndarray:
    """Return how far new throws land from their targets [m], shape (THROWS,)."""
    vector, policy = SteerVectorEnv(THROWS, autoreset_mode='Disabled'), trained_policy()
    rows, _ = vector.reset(seed=10**6)
    distances, flying = np.zeros(THROWS), np.ones(THROWS, dtype=bool)
    while flying.any():
        rows, _, terminated, truncated, infos = vector.step(policy(rows))
        ended = (terminated | truncated) & flying
        if ended.any():
            distances[ended] = infos['miss'][ended]
        flying &= ~ended
    vector.close()
    return distances


if __name__ == '__main__':
    main()
