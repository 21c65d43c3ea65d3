"""What the vector environments share: resets, seeds, ends of episodes and their infos."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

from gymnasium import Env
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
import numpy as np
from numpy.typing import NDArray

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray, IntArray
from disc_sim_ros.envs.components import Component, Float32Array, bounds
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.batch_simulator import BatchSimulator
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.quantities import LAUNCH, MEAN_WIND, POSITION

Mask = NDArray[np.bool_]
Arrays = dict[str, Any]
_DEFAULT_LAUNCH = np.array([quantity.default for quantity in LAUNCH.values()], dtype=float)
_AT = {name: j for j, name in enumerate(LAUNCH)}
_NONE = np.zeros(1, dtype=bool)
_FURTHEST = (POSITION.lowest, POSITION.highest)


class DiscVectorEnv(VectorEnv[Any, Any, Any]):
    """Many discs, each with a target and a wind, in the compiled loop over flights.

    An episode is one throw. It ends with the landing, whose reward is minus the distance from the
    target [m]. `options` of `reset`: 'target' (x, y of `map` [m]), 'wind' (x, y, z of `map`
    [m/s]) and 'launch' (fields of Launch by name) fix what is drawn otherwise, for all discs;
    'reset_mask' (shape (num_envs,)) names the discs to reset.

    Attributes:
        simulator: The flights.
        targets: Points on the ground in `map` [m], shape (2, num_envs).
        winds: Mean winds in `map` [m/s], shape (num_envs, 3).
        launches: Fields of Launch, shape (num_envs, 10).
    """

    def __init__(
        self,
        num_envs: int,
        observation: tuple[Component, ...],
        action: tuple[Component, ...],
        *,
        disc: str,
        step: float,
        largest_wind: float,
        autoreset_mode: AutoresetMode | str,
        threads: int | None,
    ) -> None:
        """Prepare the flights; see the classes for the arguments."""
        validation.number('largest_wind', largest_wind, 0.0, 20.0)
        mode = AutoresetMode(autoreset_mode)
        self.metadata = {'render_modes': [], 'autoreset_mode': mode}
        self.num_envs = num_envs
        self.simulator = BatchSimulator(
            Setup(disc=disc_file.load_disc(disc), step=step), num_envs, threads=threads
        )
        self.single_observation_space = Box(*bounds(observation), dtype=np.float32)
        self.single_action_space = Box(*bounds(action), dtype=np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.targets = np.zeros((2, num_envs))
        self.winds = np.zeros((num_envs, 3))
        self.launches = np.tile(_DEFAULT_LAUNCH, (num_envs, 1))
        self._mode = mode
        self._largest_wind = largest_wind
        self._ended = np.ones(num_envs, dtype=bool)  # which need a reset
        self._observed = np.zeros(self.observation_space.shape or (), dtype=np.float32)
        self._fixed: dict[str, FloatArray] = {}

    # ---- gymnasium ----

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32Array, Arrays]:
        """Begin an episode with every disc, or with those of a mask.

        Args:
            seed: Of all that is drawn from now on; the same seed gives the same episodes.
            options: See the class. What they fix stays fixed until the next `reset`.

        Returns:
            Observations, shape (num_envs, n), and the winds, targets and launches.

        Raises:
            ConfigError: An option is unknown or out of range.
        """
        super().reset(seed=seed)
        options = dict(options or {})
        mask = _checked_mask(options.pop('reset_mask', None), self.num_envs)
        self._fixed = _checked_options(options)
        flights = np.flatnonzero(mask)
        self._begin(flights)
        return self._observed.copy(), self._begin_info()

    def step(self, actions: Any) -> tuple[Float32Array, FloatArray, Mask, Mask, Arrays]:
        """Act with every disc once.

        Args:
            actions: Shape (num_envs, n); values beyond the bounds count as the bounds.

        Returns:
            Observations, rewards, terminations, truncations and infos. The infos of an episode
            that ends have the landing; with AutoresetMode.SAME_STEP they are in 'final_info', and
            the last observations in 'final_obs'.

        Raises:
            ConfigError: An action is not a number, or their shape is wrong.
        """
        given = np.asarray(actions, dtype=float)
        shape = self.action_space.shape
        if given.shape != shape:
            raise ConfigError('actions', given.shape, f'give shape {shape}')
        if not np.isfinite(given).all():
            raise ConfigError('actions', 'nan or inf', 'give finite numbers')
        waiting = self._ended
        time_is_up = self._advance(given, ~waiting)
        terminated = (self.simulator.landed | self.simulator.lost) & ~waiting
        truncated = time_is_up & ~terminated & ~waiting
        ended = terminated | truncated
        rewards, infos = np.zeros(self.num_envs), {}
        self._observed = self._observe()
        if ended.any():
            infos = self._end_info(ended)
            rewards[ended] = -infos['miss'][ended]
        again = waiting if self._mode is AutoresetMode.NEXT_STEP else _NONE
        if self._mode is AutoresetMode.SAME_STEP and ended.any():
            infos = self._final(ended, infos)
            again = ended
        self._ended = waiting | ended
        if again.any():
            self._begin(np.flatnonzero(again))
        return self._observed.copy(), rewards, terminated, truncated, infos

    def _final(self, ended: Mask, info: Arrays) -> Arrays:
        """Return the infos of AutoresetMode.SAME_STEP."""
        last = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(ended):
            last[i] = self._observed[i].copy()
        return {
            'final_obs': last,
            '_final_obs': ended,
            'final_info': info,
            '_final_info': ended,
        }

    def close_extras(self, **_: Any) -> None:
        """End the threads."""
        self.simulator.close()

    # ---- for the environments ----

    @abstractmethod
    def _draw(self, flights: IntArray) -> None:
        """Draw targets, winds and launches of some flights."""

    @abstractmethod
    def _advance(self, actions: FloatArray, acting: Mask) -> Mask:
        """Act, fly on, and return whose time is up."""

    @abstractmethod
    def _observe(self) -> Float32Array:
        """Return the observations of all discs, shape (num_envs, n)."""

    @abstractmethod
    def _observe_first(self, flights: IntArray) -> Float32Array:
        """Return the observations of some discs that begin, shape (m, n)."""

    def _uniform(self, low: float, high: float, count: int) -> FloatArray:
        return self.np_random.uniform(low, high, count)

    def _begin(self, flights: IntArray) -> None:
        """Begin episodes with some flights."""
        self._draw(flights)
        self.winds[flights, :2] = self._uniform(
            -self._largest_wind, self._largest_wind, 2 * len(flights)
        ).reshape(-1, 2)
        if 'target' in self._fixed:
            self.targets[:, flights] = self._fixed['target'][:, np.newaxis]
        if 'wind' in self._fixed:
            self.winds[flights] = self._fixed['wind']
        if 'launch' in self._fixed:
            self.launches[flights] = self._fixed['launch']
        self._ended[flights] = False
        self._observed[flights] = self._observe_first(flights)

    def _begin_info(self) -> Arrays:
        return {
            'target': self.targets.T.copy(),
            'wind': self.winds.copy(),
            'launch': self.launches.copy(),
        }

    def _end_info(self, ended: Mask) -> Arrays:
        """Return landings, misses, times and winds of the episodes that end, with their masks."""
        n = self.num_envs
        flights = np.flatnonzero(ended)
        columns = self.simulator.present(flights)
        at = np.stack([columns[0], frames.flip(columns[1])], axis=1)
        step = self.simulator.setup.fixed_step
        info = {
            'landing': np.zeros((n, 2)),
            'miss': np.zeros(n),
            'flight_time': np.zeros(n),
            'landed': np.zeros(n, dtype=bool),
            'wind': np.zeros((n, 3)),
            'target': np.zeros((n, 2)),
        }
        miss = at - self.targets.T[ended]
        info['landing'][ended] = at
        info['miss'][ended] = np.hypot(miss[:, 0], miss[:, 1])
        info['landed'][ended] = self.simulator.landed[ended]
        info['flight_time'][ended] = np.where(
            self.simulator.flying, self.simulator.steps * step, self.simulator.end_times
        )[ended]
        info['wind'][ended] = self.winds[ended]
        info['target'][ended] = self.targets.T[ended]
        return info | {f'_{key}': ended for key in info}


class DiscEnv(Env[Any, Any]):
    """One disc: the environment of a vector of length 1, with the same numbers.

    Attributes:
        vector: The vector environment.
    """

    def __init__(self, vector: DiscVectorEnv) -> None:
        """Take a vector of length 1 that does not reset itself."""
        self.metadata = {'render_modes': []}
        self.vector = vector
        self.observation_space = vector.single_observation_space
        self.action_space = vector.single_action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32Array, Arrays]:
        """Begin an episode; see `DiscVectorEnv.reset`."""
        super().reset(seed=seed)
        observed, infos = self.vector.reset(seed=seed, options=options)
        return observed[0], _single(infos)

    def step(self, action: Any) -> tuple[Float32Array, float, bool, bool, Arrays]:
        """Act once; see `DiscVectorEnv.step`."""
        observed, rewards, terminated, truncated, infos = self.vector.step(
            np.asarray(action)[np.newaxis]
        )
        end = bool(terminated[0]), bool(truncated[0])
        return observed[0], float(rewards[0]), *end, _single(infos)

    def close(self) -> None:
        """End the threads."""
        self.vector.close()


def _single(infos: Arrays) -> Arrays:
    """Return the infos of the only disc, without masks."""
    return {key: value[0] for key, value in infos.items() if not key.startswith('_')}


def _checked_mask(mask: Any, n: int) -> Mask:
    if mask is None:
        return np.ones(n, dtype=bool)
    given = np.asarray(mask)
    if given.shape != (n,) or given.dtype != np.bool_:
        raise ConfigError('reset_mask', given.shape, f'give truth values of shape ({n},)')
    return given


def _checked_options(options: Mapping[str, Any]) -> dict[str, FloatArray]:
    """Return the options as arrays.

    Raises:
        ConfigError: One is unknown or out of range.
    """
    for name in options:
        validation.choice('options', name, ('launch', 'reset_mask', 'target', 'wind'))
    fixed = {}
    if 'target' in options:
        values = _listed('target', options['target'], 2)
        fixed['target'] = np.array([validation.number('target', x, *_FURTHEST) for x in values])
    if 'wind' in options:
        values = _listed('wind', options['wind'], 3)
        pairs = zip(MEAN_WIND.values(), values, strict=True)
        fixed['wind'] = np.array([quantity.check(x) for quantity, x in pairs])
    if 'launch' in options:
        fixed['launch'] = _DEFAULT_LAUNCH.copy()
        for name, value in options['launch'].items():
            validation.choice('launch', name, LAUNCH)
            fixed['launch'][_AT[name]] = LAUNCH[name].check(value)
    return fixed


def _listed(name: str, values: Any, count: int) -> list[Any]:
    listed = np.asarray(values, dtype=object).tolist()
    if not isinstance(listed, list) or len(listed) != count:
        raise ConfigError(name, values, f'give {count} numbers')
    return listed
