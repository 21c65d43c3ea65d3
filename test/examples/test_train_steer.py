"""The training example, where the extra `learn` is installed."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('stable_baselines3')

from disc_sim_ros.envs import policy, steering

EXAMPLE = Path(__file__).parents[2] / 'examples' / 'train_steer.py'


def test_a_short_training_writes_a_policy_that_acts(tmp_path, capsys):
    spec = importlib.util.spec_from_file_location('train_steer', EXAMPLE)
    train_steer = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(train_steer)
    out = tmp_path / 'p.npz'
    assert train_steer.main(['--minutes', '0.2', '--throws', '64', '--out', str(out)]) == 0
    assert '64 new throws miss by' in capsys.readouterr().out
    trained = policy.load_policy(out, len(steering.OBSERVATION), len(steering.ACTION))
    actions = trained(np.zeros((1, len(steering.OBSERVATION)), np.float32))
    assert (actions != 0.0).all()
