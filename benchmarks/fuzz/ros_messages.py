"""Commands and throws: any bytes that deserialise are refused in one line, or fly on."""

import random
import struct
from typing import Any

import flown
from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import MODELS, Setup
from disc_sim_ros.physics.kernels.equations import Control, State
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.sim.commands import MOST_WAITING, Commands, CommandTopic, pop_due
from disc_sim_ros.topics import Frames

NAME = 'ros_messages'
WORDS = ('map', 'disc', 'disc_body', 'disc_air', 'red/disc', '\x00\x01\x00\x00')
_FRAMES = Frames()
_DISC = disc_file.load_disc('frisbee_roll_moment')
_TYPES = (WrenchStamped, Vector3Stamped, Vector3Stamped, Odometry)
_DOUBLES = (
    0.0, -0.0, 1.0, -1.0, float('nan'), float('inf'), -float('inf'), 1e308, 5e-324, 1e-200, 1e3,
    -1e3, 10.0, 100.0, 200.0, 1e4, 1.0005, 0.70710678118654757,
)  # fmt: skip
_NOW = 1_700_000_000_000_000_000  # ns


def seeds() -> list[bytes]:
    """Return one valid message of each topic and more, each after a byte that names its topic."""
    wrench = WrenchStamped()
    wrench.header.frame_id = 'disc_body'
    wrench.wrench.torque.x = 0.01
    vector = Vector3Stamped()
    vector.vector.y = -0.02
    wind = Vector3Stamped()
    wind.header.frame_id = 'map'
    wind.vector.x = 5.0
    throw = Odometry()
    throw.header.frame_id, throw.child_frame_id = 'map', 'disc'
    throw.twist.twist.linear.x, throw.twist.twist.angular.z = 15.0, -31.4
    throw.pose.pose.position.z = 1.0
    plain = [bytes(serialize_message(m)) for m in (wrench, vector, wind, throw)]
    return [bytes([topic]) + data for topic, data in enumerate(plain)]


def one(data: bytes) -> None:
    """Take one message as `sim_node` takes it, and fly with it."""
    if not data:
        return
    number = data[0] % 4
    try:
        message: Any = deserialize_message(data[1:], _TYPES[number])
    except Exception as error:  # of the middleware, which has types of its own
        if type(error).__name__ not in {'RMWError', 'MemoryError', 'UnicodeDecodeError'}:
            raise
        return
    commands = Commands(None, _FRAMES)
    topic: CommandTopic = (commands.moment, commands.coefficients, commands.wind, commands.throw)[
        number
    ]
    try:
        commands.accept(topic, message, _NOW)
    except ConfigError as error:
        if '\n' in str(error):
            raise AssertionError(f'not one line: {error}') from None
        return
    value = pop_due(topic, 2**63)
    if value is None or len(topic.waiting) > MOST_WAITING:
        raise AssertionError(f'an accepted command never acts: {message}')
    model = tuple(MODELS)[len(data) % 3]
    release, control, wind = Launch(height=2.0).state(), Control(), Wind()
    if number == 0:
        L, M, N, axes = value  # noqa: N806 - the paper's
        control = Control(L=L, M=M, N=N, axes=axes)
    elif number == 1:
        control = Control(*value)
    elif number == 2:
        wind = Wind(mean=value)
    else:
        release = State(*value)
        messages.odometry(release)
    flown.fly_on(Setup(disc=_DISC, model=model, wind=wind), release, control)


def mutate(data: bytes, rng: random.Random) -> bytes | None:
    """Put odd numbers where the doubles of a message are."""
    if len(data) < 30:
        return None
    changed = bytearray(data)
    for _ in range(rng.randint(1, 3)):
        # Doubles lie at multiples of 8 bytes behind the encapsulation and the topic.
        places = range(5, len(changed) - 8, 4)
        at = rng.choice(places)
        value = rng.choice(_DOUBLES) if rng.random() < 0.7 else rng.uniform(-2e3, 2e3)
        struct.pack_into('<d', changed, at, value)
    return bytes(changed)
