"""Steer-v0: bring a thrown disc to a target, in a wind that is not told."""

from typing import Any

from gymnasium.vector import AutoresetMode
import numpy as np

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.envs import steering
from disc_sim_ros.envs.components import Component, Float32Array
from disc_sim_ros.envs.disc_vector_env import DiscEnv, DiscVectorEnv, Mask
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.quantities import LAUNCH

LONGEST = 20.0  # s, then the episode is truncated
# What is drawn for each episode, evenly between the bounds.
TARGET = (
    Component('x', 'm', 20.0, 28.0, 'Target, x of `map`'),
    Component('y', 'm', -4.0, 4.0, 'Target, y of `map`'),
)
THROW = (
    Component('speed', 'm/s', 14.5, 15.5, 'Speed over the ground'),
    Component('pitch', 'degrees', 12.0, 18.0, 'Pitch of the disc, nose up positive'),
    Component('roll', 'degrees', -5.0, 5.0, 'Roll of the disc, right edge down positive'),
    Component('yaw', 'degrees', -5.0, 5.0, 'Heading of the disc, right positive'),
    Component('spin', 'rad/s', 28.0, 35.0, 'Spin rate, clockwise from above positive'),
    Component('height', 'm', 1.0, 1.5, 'Height of the release'),
)
_COLUMNS = [list(LAUNCH).index(c.name) for c in THROW]
_MOST_STEPS = round(LONGEST / steering.STEP)


class SteerVectorEnv(DiscVectorEnv):
    """Many discs that are steered by moments, each towards a target on the ground.

    An action sets C_L, C_M and C_N for `steering.PERIOD`; see `steering` for the spaces. The
    reward is 0 until the end, then minus the distance of the landing from the target [m].
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        disc: str = 'frisbee',
        largest_wind: float = 3.0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        threads: int | None = None,
    ) -> None:
        """Prepare the discs.

        Args:
            num_envs: Number of discs.
            disc: Name of a disc, or of a YAML file.
            largest_wind: The wind along x and y of `map` is drawn between minus this and this
                [m/s].
            autoreset_mode: When a disc that has landed is thrown again.
            threads: Number of threads; None for one per core. Results do not depend on it.

        Raises:
            ConfigError: A value is not allowed.
        """
        super().__init__(
            num_envs,
            steering.OBSERVATION,
            steering.ACTION,
            disc=disc,
            step=steering.STEP,
            largest_wind=largest_wind,
            autoreset_mode=autoreset_mode,
            threads=threads,
        )
        self._velocity = np.zeros((3, num_envs))

    def _draw(self, flights: IntArray) -> None:
        for j, c in zip(_COLUMNS, THROW, strict=True):
            self.launches[flights, j] = self._uniform(c.lowest, c.highest, len(flights))
        for j, c in enumerate(TARGET):
            self.targets[j, flights] = self._uniform(c.lowest, c.highest, len(flights))

    def _advance(self, actions: FloatArray, acting: Mask) -> Mask:
        self.simulator.set_control(steering.controls(actions))
        self.simulator.advance(steering.STEPS)
        return self.simulator.steps >= _MOST_STEPS

    def _observe(self) -> Float32Array:
        columns = self.simulator.columns
        ended = np.flatnonzero(self.simulator.landed)
        if ended.size:
            columns[:, ended] = self.simulator.present(ended)
        odometry = frames.odometry(State(*columns))
        observed, self._velocity = steering.observations(odometry, self._velocity, self.targets)
        return observed

    def _observe_first(self, flights: IntArray) -> Float32Array:
        self.simulator.release(flights, self.launches[flights], self.winds[flights])
        odometry = frames.odometry(State(*self.simulator.present(flights)))
        now = steering.velocity(odometry)
        self._velocity[:, flights] = now
        return steering.observations(odometry, now, self.targets[:, flights])[0]


class SteerEnv(DiscEnv):
    """One disc that is steered by moments; see `SteerVectorEnv`."""

    def __init__(self, **arguments: Any) -> None:
        """Prepare the disc; the arguments are those of `SteerVectorEnv` without its first."""
        super().__init__(SteerVectorEnv(1, autoreset_mode=AutoresetMode.DISABLED, **arguments))
