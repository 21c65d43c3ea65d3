"""Train a policy that steers a thrown disc to a target in unknown wind, by PPO.

    .venv/bin/pip install -e '.[learn]'      # stable-baselines3 with PyTorch; a CPU is enough
    .venv/bin/python examples/train_steer.py --minutes 9 --out steer.npz

It prints the misses of new throws and writes the weights, which fly without PyTorch. The policy
in the repository, disc_sim_ros/envs/policies/steer.npz, comes from `--minutes 9`.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys
import time
from typing import Any

from gymnasium.vector import AutoresetMode
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv, VecNormalize
import torch

from disc_sim_ros import BatchSimulator, Setup
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.envs.policy import Policy
from disc_sim_ros.envs.steer import SteerVectorEnv
from disc_sim_ros.physics.frames import flip

DISCS = 1024
STEPS = 40  # of each disc between two updates; a flight has twice as many
REWARD_SCALE = 0.5  # of a metre


class Discs(VecEnv):
    """The vector environment in the interface of stable-baselines3."""

    render_mode = None

    def __init__(self, count: int) -> None:
        self.discs = SteerVectorEnv(count, autoreset_mode=AutoresetMode.SAME_STEP)
        super().__init__(
            count, self.discs.single_observation_space, self.discs.single_action_space
        )
        self._length = np.zeros(count, dtype=int)
        self._ahead = BatchSimulator(Setup(disc=self.discs.simulator.setup.disc, step=0.02), count)
        self._expected = np.zeros(count)

    def reset(self) -> Any:
        """Throw all discs."""
        observed, _ = self.discs.reset(seed=self._seeds[0])
        self._expected = self._expected_misses()
        return observed

    def _expected_misses(self) -> FloatArray:
        """Return how far from the target each disc would land without further control [m]."""
        everyone = np.arange(self.num_envs)
        self._ahead.place(everyone, self.discs.simulator.columns, self.discs.winds)
        self._ahead.advance(500)
        X, Y = self._ahead.present(everyone)[:2]
        return np.hypot(X - self.discs.targets[0], flip(Y) - self.discs.targets[1])

    def step_async(self, actions: Any) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> Any:
        """Fly one step; the reward is how much closer the disc would land.

        Over a flight these rewards add up to that of the environment and a constant.
        """
        observed, rewards, terminated, truncated, given = self.discs.step(self._actions)
        ended = terminated | truncated
        self._length += 1
        infos: list[dict[str, Any]] = [{}] * self.num_envs
        for i in np.flatnonzero(ended):
            infos[i] = {
                'terminal_observation': given['final_obs'][i],
                'TimeLimit.truncated': bool(truncated[i]),
                'episode': {'r': rewards[i], 'l': self._length[i], 't': 0.0},
            }
        self._length[ended] = 0
        before, self._expected = self._expected, self._expected_misses()
        gained = before - np.where(ended, -rewards, self._expected)
        return observed, REWARD_SCALE * gained, ended, infos

    def close(self) -> None:
        """End the threads."""
        self.discs.close()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the next reset."""
        self._seeds = [seed] * self.num_envs
        return self._seeds

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute once for each disc."""
        return [getattr(self, attr_name)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refuse: the discs have no attributes of their own."""
        raise NotImplementedError(attr_name)

    def env_method(self, method_name: str, *_: Any, **__: Any) -> list[Any]:
        """Refuse: the discs have no methods of their own."""
        raise NotImplementedError(method_name)

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Return that no disc is wrapped."""
        return [False] * self.num_envs


class Deadline(BaseCallback):
    """Ends the training after a time, lowers the learning rate on the way, and reports."""

    def __init__(self, seconds: float) -> None:
        super().__init__()
        self._start = time.monotonic()
        self._seconds = seconds

    @property
    def left(self) -> float:
        """Return the share of the time that is left."""
        return max(1.0 - (time.monotonic() - self._start) / self._seconds, 0.0)

    def _on_step(self) -> bool:
        return self.left > 0.0

    def _on_rollout_end(self) -> None:
        misses = [-float(episode['r']) for episode in self.model.ep_info_buffer]
        spent = time.monotonic() - self._start
        print(
            f'{spent:5.0f} s  {self.num_timesteps / 1e6:6.2f} million steps  '
            f'median miss {np.median(misses):.2f} m'
        )


def policy_of(model: PPO, scaling: VecNormalize) -> Policy:
    """Return the weights of a trained model."""
    net = model.policy.mlp_extractor.policy_net
    layers = [layer for layer in net if isinstance(layer, torch.nn.Linear)]
    layers.append(model.policy.action_net)
    weights = tuple(
        (layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy().copy())
        for layer in layers
    )
    rms = scaling.obs_rms
    scale = 1.0 / np.sqrt(rms.var + scaling.epsilon)
    return Policy(
        rms.mean.astype(np.float32), scale.astype(np.float32), float(scaling.clip_obs), weights
    )


def train(minutes: float, seed: int) -> Policy:
    """Train for a time and return the policy."""
    torch.set_num_threads(1)  # with networks this small, two are no faster
    discs = Discs(DISCS)
    discs.seed(seed)
    scaling = VecNormalize(discs, norm_reward=False, clip_obs=5.0)
    deadline = Deadline(60.0 * minutes)
    model = PPO(
        'MlpPolicy',
        scaling,
        n_steps=STEPS,
        batch_size=DISCS * STEPS // 8,
        n_epochs=5,
        gamma=0.97,
        gae_lambda=0.9,
        learning_rate=lambda _: 1e-5 + 1e-3 * deadline.left,
        clip_range=0.2,
        ent_coef=0.0,
        vf_coef=0.5,
        policy_kwargs={
            'net_arch': {'pi': [64, 64], 'vf': [64, 64]},
            'log_std_init': -0.7,
            'activation_fn': torch.nn.ReLU,
        },
        seed=seed,
        device='cpu',
    )
    model.ep_info_buffer.__init__(maxlen=2000)
    model.learn(10**9, callback=deadline)
    discs.close()
    return policy_of(model, scaling)


def misses(policy: Policy, throws: int, seed: int) -> np.ndarray:
    """Return the misses of new throws [m], shape (throws,)."""
    discs = SteerVectorEnv(throws, autoreset_mode=AutoresetMode.DISABLED)
    observed, _ = discs.reset(seed=seed)
    result = np.full(throws, np.nan)
    flying = np.ones(throws, dtype=bool)
    while flying.any():
        observed, _, terminated, truncated, infos = discs.step(policy(observed))
        ended = (terminated | truncated) & flying
        if ended.any():
            result[ended] = infos['miss'][ended]
        flying &= ~ended
    discs.close()
    return result


def main(arguments: list[str] | None = None) -> int:
    """Train, test and save a policy."""
    parser = argparse.ArgumentParser(prog='train_steer', description=__doc__.splitlines()[0])
    parser.add_argument('--minutes', type=float, default=9.0)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--throws', type=int, default=4096, help='new throws that test it')
    parser.add_argument('--out', type=Path, default=Path('steer.npz'))
    options = parser.parse_args(arguments)
    policy = train(options.minutes, options.seed)
    policy.save(options.out)
    distances = misses(policy, options.throws, seed=10**6 + options.seed)
    low, half, high = np.percentile(distances, [25, 50, 90])
    print(
        f'{options.throws} new throws miss by {half:.2f} m in the median '
        f'(a quarter by less than {low:.2f} m, a tenth by more than {high:.2f} m); '
        f'{np.mean(distances < 1.0):.0%} land within 1 m'
    )
    print(f'{options.out}: {options.out.stat().st_size / 1000:.0f} kB')
    return 0


if __name__ == '__main__':
    sys.exit(main())
