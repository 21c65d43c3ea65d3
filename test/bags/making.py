"""Bags for the tests, serialised by `rosbags`, which knows nothing of this package."""

from pathlib import Path

import numpy as np
from rosbags.typesys import Stores, get_typestore

from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.topic import Qos, Topic
from disc_sim_ros.bags.writer import BagWriter

TYPES = get_typestore(Stores.ROS2_JAZZY)
ODOMETRY = 'nav_msgs/msg/Odometry'
STRING = 'std_msgs/msg/String'
START = 1_700_000_000_000_000_000  # ns
STEP = 1_000_000  # ns


def odometry(number: int) -> bytes:
    """A message that carries its number, and numbers that do not compress away."""
    t = TYPES.types
    rng = np.random.default_rng(number)
    x, y, z = rng.normal(size=3)
    stamp = t['builtin_interfaces/msg/Time'](sec=number // 1000, nanosec=number % 1000)
    point = t['geometry_msgs/msg/Point'](x=float(number), y=y, z=z)
    pose = t['geometry_msgs/msg/Pose'](
        position=point, orientation=t['geometry_msgs/msg/Quaternion'](x=x, y=y, z=z, w=1.0)
    )
    vector = t['geometry_msgs/msg/Vector3']
    twist = t['geometry_msgs/msg/Twist'](linear=vector(x=x, y=y, z=z), angular=vector(z, x, y))
    message = t[ODOMETRY](
        header=t['std_msgs/msg/Header'](stamp=stamp, frame_id='map'),
        child_frame_id='disc',
        pose=t['geometry_msgs/msg/PoseWithCovariance'](pose=pose, covariance=rng.normal(size=36)),
        twist=t['geometry_msgs/msg/TwistWithCovariance'](twist=twist, covariance=np.zeros(36)),
    )
    return bytes(TYPES.serialize_cdr(message, ODOMETRY))


ODOMETRIES = [odometry(n) for n in range(500)]  # each takes long to make


def text(content: str) -> bytes:
    """A String message."""
    return bytes(TYPES.serialize_cdr(TYPES.types[STRING](data=content), STRING))


def topic(name: str, type_name: str, *profiles: Qos) -> Topic:
    """A topic as the recorder describes it."""
    return Topic(
        name=name,
        type=type_name,
        definition=schemas.definition(type_name),
        type_hash=schemas.type_hash(type_name) or '',
        qos=profiles,
    )


def write_bag(folder: Path, count: int, *, split_at: tuple[int, ...] = (), **options) -> BagWriter:
    """Write `count` messages on /odom and a tenth as many on /log; return the writer."""
    with BagWriter(folder, **options) as bag:
        odom = bag.add(topic('/odom', ODOMETRY, Qos(depth=1000)))
        log = bag.add(topic('/log', STRING, Qos(durability='transient_local', depth=1)))
        bag.add(topic('/silent', STRING))
        for n in range(count):
            if n in split_at:
                bag.split()
            at = START + n * STEP
            bag.write(odom, ODOMETRIES[n % len(ODOMETRIES)], at, at - 5)
            if n % 10 == 0:
                bag.write(log, text(f'message {n}'), at, at - 7)
    return bag


def everything(bag) -> list[tuple]:
    """All messages of an opened bag."""
    return [(m.topic, m.log_time, m.publish_time, m.data) for m in bag.raw()]
