"""Measurements from messages: numbers checked, in `map`."""

import math
from typing import Any

from disc_sim_ros.arrays import Vector
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.prediction.predictor import Measurement
from disc_sim_ros.physics.frames import earth_from_body
from disc_sim_ros.quantities import PREDICTION
from disc_sim_ros.ros.predictor.options import NodeConfig, is_plain
from disc_sim_ros.units import NANOSECONDS

_SHORTEST_QUATERNION = 1e-6
_SIGMA = PREDICTION['position_sigma']  # the range of a covariance that is used


def stamp_of(source: str, message: Any) -> int:
    """Return the stamp of a message [ns].

    Raises:
        ConfigError: It is 0, that of a publisher that states no time.
    """
    stamp = message.header.stamp
    nanoseconds = int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)
    if nanoseconds == 0:
        raise ConfigError(f'{source} header.stamp', 0, 'give the time of the measurement')
    return nanoseconds


def measurement(source: str, message: Any, config: NodeConfig, time: float) -> Measurement:
    """Return a measurement from a message.

    Args:
        source: One of `options.SOURCES`.
        message: PointStamped, PoseStamped, PoseWithCovarianceStamped or Odometry.
        config: Of the node.
        time: Of the message [s].

    Raises:
        ConfigError: Another frame, numbers that are not finite, or a covariance of a position that
            may be anywhere.
    """
    frame = message.header.frame_id or config.frame
    if frame != config.frame:
        raise ConfigError(
            f'{source} header.frame_id', frame, f'give {config.frame}, the measurement_frame'
        )
    if source == 'point':
        return Measurement(time, _in_map(message.point, config))
    with_covariance = source != 'pose'
    pose = message.pose.pose if with_covariance else message.pose
    sigma = _sigma(source, message.pose.covariance) if with_covariance else None
    axis = _axis(source, pose.orientation, config)
    return Measurement(time, _in_map(pose.position, config), axis, sigma)


def _in_map(point: Any, config: NodeConfig) -> Vector:
    at = (float(point.x), float(point.y), float(point.z))
    if is_plain(config):
        return at
    x, y, z = earth_from_body(config.rotation, at)
    a, b, c = config.position
    return x + a, y + b, z + c


def _axis(source: str, q: Any, config: NodeConfig) -> Vector | None:
    """Return the direction of z of an orientation in `map`; None for a quaternion of length 0."""
    norm = math.hypot(q.x, q.y, q.z, q.w)
    if not math.isfinite(norm):
        allowed = 'give finite numbers, or four times 0 where there is no attitude'
        raise ConfigError(f'{source} orientation', [q.x, q.y, q.z, q.w], allowed)
    if norm < _SHORTEST_QUATERNION:
        return None
    e = (q.w / norm, q.x / norm, q.y / norm, q.z / norm)
    up = earth_from_body(e, (0.0, 0.0, 1.0))
    return up if is_plain(config) else earth_from_body(config.rotation, up)


def _sigma(source: str, covariance: Any) -> float | None:
    """Return the standard deviation of a position; None where the message gives none."""
    mean = float(covariance[0] + covariance[7] + covariance[14]) / 3.0
    if mean > _SIGMA.highest**2:
        allowed = f'give variances up to {_SIGMA.highest**2:g} m^2, or 0 for position_sigma'
        raise ConfigError(f'{source} covariance', mean, allowed)
    return max(mean**0.5, _SIGMA.lowest) if mean > 0.0 else None
