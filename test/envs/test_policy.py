"""Policies as files: what is written is read again, and other files are refused."""

import zipfile

import numpy as np
import pytest

from disc_sim_ros.envs.policy import Policy, load_policy
from disc_sim_ros.errors import ConfigError


def policy(inputs: int = 4, outputs: int = 2, hidden: int = 3) -> Policy:
    rng = np.random.default_rng(0)

    def layer(m: int, n: int):
        return rng.normal(size=(m, n)).astype('f4'), rng.normal(size=n).astype('f4')

    mean, scale = rng.normal(size=inputs).astype('f4'), np.full(inputs, 0.5, 'f4')
    return Policy(mean, scale, 5.0, (layer(inputs, hidden), layer(hidden, outputs)))


def test_actions_are_those_of_the_network_written_out():
    p = policy()
    rows = np.array([[1.0, -2.0, 30.0, 0.5]], 'f4')
    x = [min(max((a - m) * 0.5, -5.0), 5.0) for a, m in zip(rows[0], p.mean, strict=True)]
    (W, b), (V, c) = ((w.astype(float), bias.astype(float)) for w, bias in p.layers)
    hidden = [max(sum(x[i] * W[i, j] for i in range(4)) + b[j], 0.0) for j in range(3)]
    out = [sum(hidden[j] * V[j, k] for j in range(3)) + c[k] for k in range(2)]
    expected = np.clip(out, -1.0, 1.0)
    assert any(h > 0.0 for h in hidden)
    assert np.allclose(p(rows)[0], expected, atol=1e-5)  # float32 has 7 digits


def test_a_saved_policy_is_read_again(tmp_path):
    p = policy()
    p.save(tmp_path / 'p.npz')
    again = load_policy(tmp_path / 'p.npz', 4, 2)
    rows = np.random.default_rng(1).normal(size=(7, 4)).astype('f4')
    assert np.array_equal(again(rows), p(rows))


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        (lambda a: a | {'biases_1': np.zeros(3, 'f4')}, 'for 4 observed numbers and 2'),
        (lambda a: a | {'mean': np.zeros(5, 'f4')}, 'for 4 observed numbers and 2'),
        (lambda a: a | {'mean': np.full(4, np.nan, 'f4')}, 'finite'),
        (lambda a: a | {'extra': np.zeros(1)}, 'arrays'),
        (lambda a: {k: x for k, x in a.items() if k != 'weights_0'}, 'arrays'),
        (lambda a: a | {'mean': np.array([{}] * 4, object)}, 'npz file of weights'),
    ],
)
def test_another_file_is_refused_in_one_line(tmp_path, change, message):
    path = tmp_path / 'p.npz'
    policy().save(path)
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    np.savez(path, **change(arrays))
    with pytest.raises(ConfigError, match=message) as refusal:
        load_policy(path, 4, 2)
    assert '\n' not in str(refusal.value)


@pytest.mark.parametrize('content', [b'', b'PK\x03\x04 broken', b'text', None])
def test_what_is_no_archive_is_refused(tmp_path, content):
    path = tmp_path / 'p.npz'
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError, match='policy: '):
        load_policy(path, 4, 2)


def test_an_archive_of_other_files_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / 'p.npz', 'w') as archive:
        archive.writestr('a.txt', 'text')
    with pytest.raises(ConfigError, match='policy: '):
        load_policy(tmp_path / 'p.npz', 4, 2)
