"""Rotations of messages are those of scipy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from disc_sim_ros.analysis.rotations import rotated, rotated_back, turns_between


@pytest.fixture(scope='module')
def quaternions() -> np.ndarray:
    """Of any length, with the same rotation twice, as itself and as its negative."""
    drawn = np.random.default_rng(0).normal(0.0, 2.0, (50, 4))
    return np.concatenate([drawn, drawn[-1:], -drawn[-1:], drawn[-1:] + 1e-9])


def test_vectors_turn_there_and_back(quaternions):
    vectors = np.random.default_rng(1).normal(0.0, 10.0, (len(quaternions), 3))
    there = rotated(quaternions, vectors)
    assert there == pytest.approx(Rotation.from_quat(quaternions).apply(vectors), abs=1e-12)
    assert rotated_back(quaternions, there) == pytest.approx(vectors, abs=1e-12)


def test_the_turns_between_are_the_shorter_ones(quaternions):
    of_scipy = Rotation.from_quat(quaternions)
    expected = (of_scipy[:-1].inv() * of_scipy[1:]).as_rotvec()
    turns = turns_between(quaternions)
    assert turns == pytest.approx(expected, abs=1e-12)
    assert turns[-3:-1] == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(turns[:-3], axis=1).max() > 3.0
    assert turns_between(quaternions[:1]).shape == (0, 3)
