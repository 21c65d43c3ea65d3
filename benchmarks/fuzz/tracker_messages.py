"""Measurements of predictor_node: bytes that deserialise are refused in one line, or predicted."""

import random
import struct
from typing import Any

from geometry_msgs.msg import PointStamped, PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.prediction.predictor import Predictor
from disc_sim_ros.ros.predictor.measured import measurement, stamp_of
from disc_sim_ros.ros.predictor.options import node_config

NAME = 'tracker_messages'
WORDS = ('map', 'camera', '\x00\x01\x00\x00')
_TYPES = {
    'point': PointStamped,
    'pose': PoseStamped,
    'pose_with_covariance': PoseWithCovarianceStamped,
    'odom': Odometry,
}
_DOUBLES = (
    0.0, -0.0, 1.0, -1.0, float('nan'), float('inf'), -float('inf'), 1e308, -1e308, 5e-324, 1e-200,
    1e3, 1e154, 10.0, 0.70710678118654757,
)  # fmt: skip
_CONFIGS = (
    node_config({}),
    node_config({'measurement_frame': 'camera', 'frame_position': (1.0, 2.0, 3.0),
                 'frame_rotation': (10.0, 20.0, 30.0)}),
)  # fmt: skip
_PERIOD = 20_000_000  # ns


def seeds() -> list[bytes]:
    """Return a valid message of each type, each after a byte that names its type."""
    Predictor(_CONFIGS[0].predictor).warm_up()  # compilation is no hang of an input
    plain = []
    for number, kind in enumerate(_TYPES.values()):
        message = kind()
        message.header.frame_id = 'map'
        message.header.stamp.sec = 1
        plain.append(bytes([number]) + bytes(serialize_message(message)))
    return plain


def one(data: bytes) -> None:
    """Take one message amid those of a throw as `predictor_node` takes it, and predict."""
    if not data:
        return
    source = list(_TYPES)[data[0] % 4]
    try:
        message: Any = deserialize_message(data[1:], _TYPES[source])
    except Exception as error:  # of the middleware, which has types of its own
        if type(error).__name__ not in {'RMWError', 'MemoryError', 'UnicodeDecodeError'}:
            raise
        return
    config = _CONFIGS[data[0] // 4 % 2]
    predictor = Predictor(config.predictor)
    strange = data[0] // 8 % 12
    for k in range(12):
        given = message if k == strange else _tracked(k, config.frame)
        kind = source if k == strange else 'point'
        try:
            taken = measurement(kind, given, config, stamp_of(kind, given) / 1e9)
        except ConfigError as error:
            if '\n' in str(error):
                raise AssertionError(f'not one line: {error}') from None
            continue
        if taken.axis is not None and not np.isfinite(taken.axis).all():
            raise AssertionError(f'an accepted axis that is not finite: {taken}')
        predictor.add(taken)
    prediction = predictor.update()
    if prediction is not None and not np.isfinite(prediction.landing).all():
        raise AssertionError(f'a landing that is not finite: {prediction}')


def _tracked(k: int, frame: str) -> PointStamped:
    t = k * _PERIOD
    message = PointStamped()
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(1_000_000_000 + t, 10**9)
    s = t / 1e9
    message.point.x, message.point.y, message.point.z = 14.0 * s, 0.0, 1.0 + 3.0 * s
    return message


def mutate(data: bytes, rng: random.Random) -> bytes | None:
    """Put odd numbers where the doubles of a message are."""
    if len(data) < 30:
        return None
    changed = bytearray(data)
    if rng.random() < 0.3:
        changed[0] = rng.randrange(96)
    for _ in range(rng.randint(1, 3)):
        at = rng.choice(range(5, len(changed) - 8, 4))
        value = rng.choice(_DOUBLES) if rng.random() < 0.7 else rng.uniform(-50.0, 50.0)
        struct.pack_into('<d', changed, at, value)
    return bytes(changed)
