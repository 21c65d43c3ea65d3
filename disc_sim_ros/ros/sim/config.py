"""The configuration of sim_node: its parameters checked together, without ROS."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
import math
from pathlib import Path
from typing import Any

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file, frames
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.launch import Launch, require_above_ground
from disc_sim_ros.quantities import STEP
from disc_sim_ros.ros.parameter_spec import checked
from disc_sim_ros.ros.sim.parameters import PARAMETER_OF, TABLE
from disc_sim_ros.topics import Frames

_INTEGER_RATIO = 1e-9  # relative; how far physics_rate / publish_rate may be from a whole number


@dataclass(frozen=True, kw_only=True, slots=True)
class ImuConfig:
    """Position and errors of the IMU, in the axes of `disc_body`."""

    offset: tuple[float, ...]  # m, shape (3,), from the centre of mass
    accelerometer_noise: float  # m/s^2, standard deviation of a sample
    gyroscope_noise: float  # rad/s, standard deviation of a sample
    accelerometer_bias: tuple[float, ...]  # m/s^2, shape (3,)
    gyroscope_bias: tuple[float, ...]  # rad/s, shape (3,)
    accelerometer_noise_density: tuple[float, ...]  # m/s^2/sqrt(Hz), shape (3,)
    gyroscope_noise_density: tuple[float, ...]  # rad/s/sqrt(Hz), shape (3,)
    accelerometer_bias_walk: tuple[float, ...]  # m/s^2/sqrt(s), shape (3,)
    gyroscope_bias_walk: tuple[float, ...]  # rad/s/sqrt(s), shape (3,)
    accelerometer_range: tuple[float, ...]  # m/s^2, shape (3,); 0 is no limit
    gyroscope_range: tuple[float, ...]  # rad/s, shape (3,); 0 is no limit
    accelerometer_bandwidth: float  # Hz; 0 is no filter
    gyroscope_bandwidth: float  # Hz; 0 is no filter
    seed: int


@dataclass(frozen=True, kw_only=True, slots=True)
class SimConfig:
    """All parameters of sim_node, checked together. Rates are in Hz, times in s.

    Attributes:
        setup: The disc, the model, the air and the step 1 / `physics_rate`.
        launch: The release.
        physics_rate: Integration steps a second.
        publish_rate: Messages of a state topic a second.
        steps_per_publish: `physics_rate` / `publish_rate`.
        real_time_factor: Simulated seconds a second; 0 is as fast as possible.
        publish_clock: Whether the node supplies `/clock`.
        start_time: First stamp; negative for the wall clock, or for 0 with `publish_clock`.
        command_timeout: Simulated time after which a command falls to zero.
        auto_throw: Whether the node throws as soon as it is ready.
        throw_period: Time from release to release; 0 is one throw.
        ground: Whether a flight ends on the ground.
        frame_prefix: Prefix of the names of the frames.
        path_rate: Points of `path` a second; 0 is none.
        realtime_priority: SCHED_FIFO priority of the simulation thread; 0 is none.
        imu: The IMU.
    """

    setup: Setup
    launch: Launch
    physics_rate: float
    publish_rate: float
    steps_per_publish: int
    real_time_factor: float
    publish_clock: bool
    start_time: float
    command_timeout: float
    auto_throw: bool
    throw_period: float
    ground: bool
    frame_prefix: str
    path_rate: float
    realtime_priority: int
    imu: ImuConfig

    @property
    def publish_period(self) -> float:
        """Return the time from message to message of a state topic [s]."""
        return self.steps_per_publish / self.physics_rate


def configuration(values: Mapping[str, object]) -> SimConfig:
    """Return the configuration from the values of parameters, with defaults for the others.

    Raises:
        ConfigError: A value is not allowed, or not together with the others; its `thing` is the
            name of the parameter.
    """
    v = checked(values, TABLE)
    try:
        return _configuration(v)
    except ConfigError as error:
        raise _of_parameter(error, v) from None


def _of_parameter(error: ConfigError, v: Mapping[str, Any]) -> ConfigError:
    """Return an error about a quantity with the name and the value of its parameter."""
    if error.quantity == STEP.name:
        allowed = f'its step is {error.value:g} s, and {error.allowed}'
        return ConfigError('physics_rate', v['physics_rate'], allowed, 'physics_rate')
    name = PARAMETER_OF.get(error.quantity, error.thing)
    return ConfigError(name, v.get(name, error.value), error.allowed, error.quantity)


def _configuration(v: Mapping[str, Any]) -> SimConfig:
    setup = Setup(
        disc=_disc(v['disc']),
        model=v['model'],
        aero=v['aero'] or None,
        moment_axes=v['moment_axes'],
        air=Air(density=v['air_density'], gravity=v['gravity']),
        wind=_wind_of(**_group(v, 'wind')),
        step=1.0 / v['physics_rate'],
        ground_contact=v['ground_contact'] or None,
    )
    launch = Launch(**_group(v, 'launch'))
    setup.check_step(launch.spin, launch.speed)
    if v['ground']:
        require_above_ground(launch.height)
    Frames.prefixed(v['frame_prefix'])
    if 0.0 < v['throw_period'] < setup.fixed_step:
        allowed = f'give 0 or at least one step, {setup.fixed_step:g} s'
        raise ConfigError('throw_period', v['throw_period'], allowed, 'throw_period')
    return SimConfig(
        setup=setup,
        launch=launch,
        steps_per_publish=_steps_per_publish(v['physics_rate'], v['publish_rate']),
        imu=ImuConfig(**_group(v, 'imu')),
        **{field.name: v[field.name] for field in fields(SimConfig) if field.name in v},
    )


def _group(v: Mapping[str, Any], group: str) -> dict[str, Any]:
    """Return the parameters `group.NAME` by NAME."""
    prefix = f'{group}.'
    return {name.removeprefix(prefix): x for name, x in v.items() if name.startswith(prefix)}


def _wind_of(*, x: float, y: float, z: float, **profile_and_gusts: Any) -> Wind:
    forward, right, down = (frames.paper_from_map((x, y, z)) + 0.0).tolist()  # no minus zeros
    return Wind(mean=(forward, right, down), **profile_and_gusts)


def _steps_per_publish(physics_rate: float, publish_rate: float) -> int:
    ratio = physics_rate / publish_rate
    steps = round(ratio)
    if abs(ratio - steps) <= _INTEGER_RATIO * ratio:
        return steps
    near = (physics_rate / n for n in (math.ceil(ratio), math.floor(ratio)) if n > 0)
    allowed = (
        f'physics_rate {physics_rate:g} Hz must be a whole multiple of it; '
        f'near are {" and ".join(f"{rate:.12g}" for rate in near)}'
    )
    raise ConfigError('publish_rate', publish_rate, allowed, 'publish_rate')


def _disc(name: str) -> Disc:
    try:
        return _loaded(name, _version(name))
    except ConfigError as error:
        if error.thing == 'disc':
            raise
        raise ConfigError('disc', name, str(error)) from None  # names the file and the key


@lru_cache(maxsize=8)
def _loaded(name: str, version: tuple[int, int] | None) -> Disc:
    """Load a disc once: reading the YAML takes milliseconds, in which other threads wait."""
    return disc_file.load_disc(name)


def _version(name: str) -> tuple[int, int] | None:
    """Return time and size of a file, which change when the file changes; None without one."""
    try:
        status = Path(name).stat()
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size
