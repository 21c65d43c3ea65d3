"""Throw-v0: choose a launch that lands on a target, in a wind that is told."""

from typing import Any

from gymnasium.vector import AutoresetMode
import numpy as np

from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.envs.components import Component, Float32Array, bounds
from disc_sim_ros.envs.disc_vector_env import DiscEnv, DiscVectorEnv, Mask
from disc_sim_ros.quantities import LAUNCH

LONGEST = 20.0  # s of flight, then the episode is truncated
STEP = 0.01  # s, integration step
HEIGHT = 1.0  # m, of the release
DISTANCE = Component('distance', 'm', 10.0, 30.0, 'Distance of the target')
BEARING = Component('bearing', 'degrees', -30.0, 30.0, 'Direction of the target, left positive')
MOST_WIND = 20.0  # m/s
OBSERVATION = (
    Component('target_x', 'm', -30.0, 30.0, 'Target, x of `map`'),
    Component('target_y', 'm', -30.0, 30.0, 'Target, y of `map`'),
    Component('wind_x', 'm/s', -MOST_WIND, MOST_WIND, 'Mean wind, x of `map`'),
    Component('wind_y', 'm/s', -MOST_WIND, MOST_WIND, 'Mean wind, y of `map`'),
)
LAUNCHES = (
    Component('speed', 'm/s', 8.0, 22.0, 'Speed over the ground'),
    Component('pitch', 'degrees', -5.0, 35.0, 'Pitch of the disc, nose up positive'),
    Component('roll', 'degrees', -40.0, 40.0, 'Roll of the disc, right edge down positive'),
    Component('yaw', 'degrees', -45.0, 45.0, 'Heading of the disc, right positive'),
    Component('spin', 'rad/s', 20.0, 70.0, 'Spin rate, clockwise from above positive'),
)
ACTION = tuple(
    Component(c.name, '', -1.0, 1.0, f'{c.meaning}: from {c.lowest:g} to {c.highest:g} {c.unit}')
    for c in LAUNCHES
)
_LOW, _HIGH = (x.astype(float) for x in bounds(LAUNCHES))
_COLUMNS = [list(LAUNCH).index(c.name) for c in LAUNCHES]
_HEIGHT = list(LAUNCH).index('height')
_OBSERVED_LOW, _OBSERVED_HIGH = bounds(OBSERVATION)


class ThrowVectorEnv(DiscVectorEnv):
    """Many discs that are thrown at targets; an episode is one action.

    The action sets the launch, the observation is the target and the mean wind. The reward is
    minus the distance of the landing from the target [m].
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
        """Prepare the discs; see `SteerVectorEnv` for the arguments."""
        super().__init__(
            num_envs,
            OBSERVATION,
            ACTION,
            disc=disc,
            step=STEP,
            largest_wind=largest_wind,
            autoreset_mode=autoreset_mode,
            threads=threads,
        )
        self.launches[:, _HEIGHT] = HEIGHT

    def _draw(self, flights: IntArray) -> None:
        distance = self._uniform(DISTANCE.lowest, DISTANCE.highest, len(flights))
        bearing = np.radians(self._uniform(BEARING.lowest, BEARING.highest, len(flights)))
        self.targets[0, flights] = distance * np.cos(bearing)
        self.targets[1, flights] = distance * np.sin(bearing)

    def _advance(self, actions: FloatArray, acting: Mask) -> Mask:
        shares = 0.5 + 0.5 * actions.clip(-1.0, 1.0)
        self.launches[:, _COLUMNS] = _LOW + shares * (_HIGH - _LOW)
        flights = np.flatnonzero(acting)
        self.simulator.release(flights, self.launches[flights], self.winds[flights])
        self.simulator.advance(round(LONGEST / STEP))
        return self.simulator.flying

    def _observe(self) -> Float32Array:
        return self._observed_of(slice(None))

    def _observe_first(self, flights: IntArray) -> Float32Array:
        return self._observed_of(flights)

    def _observed_of(self, flights: Any) -> Float32Array:
        targets, winds = self.targets[:, flights].T, self.winds[flights, :2]
        observed: Float32Array = np.hstack([targets, winds]).astype(np.float32)
        return observed.clip(_OBSERVED_LOW, _OBSERVED_HIGH)


class ThrowEnv(DiscEnv):
    """One disc that is thrown at a target; see `ThrowVectorEnv`."""

    def __init__(self, **arguments: Any) -> None:
        """Prepare the disc; the arguments are those of `ThrowVectorEnv` without its first."""
        super().__init__(ThrowVectorEnv(1, autoreset_mode=AutoresetMode.DISABLED, **arguments))
