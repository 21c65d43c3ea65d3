"""The policy in the repository: it lands within 1 m of its target, in wind that it is not told."""

import numpy as np
import pytest

pytest.importorskip('gymnasium')

from gymnasium.vector import AutoresetMode

from disc_sim_ros.envs import policy
from disc_sim_ros.envs.steer import SteerVectorEnv

THROWS = 512


def misses(act) -> np.ndarray:
    """Distances from the target [m] of new throws, each in its own wind."""
    discs = SteerVectorEnv(THROWS, autoreset_mode=AutoresetMode.DISABLED)
    rows, _ = discs.reset(seed=123)
    distances, flying = np.full(THROWS, np.nan), np.ones(THROWS, dtype=bool)
    while flying.any():
        rows, _, terminated, truncated, infos = discs.step(act(rows))
        ended = (terminated | truncated) & flying
        if ended.any():
            distances[ended] = infos['miss'][ended]
        flying &= ~ended
    return distances


def test_the_median_miss_is_below_a_metre():
    """1 m is the goal of the example; without control the same throws miss by some 6 m."""
    steered = misses(policy.trained_policy())
    assert np.median(steered) < 1.0
    assert np.mean(steered < 1.0) > 0.8
    assert np.median(misses(lambda rows: np.zeros((len(rows), 3), np.float32))) > 4.0


def test_the_file_is_small():
    assert policy.TRAINED.stat().st_size < 300_000
