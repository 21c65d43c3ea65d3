"""Bags of another recorder, written by rosbags: a body that flies a parabola."""

from pathlib import Path

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

STORE = get_typestore(Stores.ROS2_JAZZY)
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
GRAVITY = 9.81


def message(kind, **fields):
    return STORE.types[kind](**fields)


def header(stamp, frame):
    sec, nanosec = divmod(int(stamp), SECOND)
    time = message('builtin_interfaces/msg/Time', sec=sec, nanosec=nanosec)
    return message('std_msgs/msg/Header', stamp=time, frame_id=frame)


def vector(values, kind='Vector3'):
    x, y, z = (float(v) for v in values)
    return message(f'geometry_msgs/msg/{kind}', x=x, y=y, z=z)


def pose(position, quaternion):
    x, y, z, w = (float(v) for v in quaternion)
    turn = message('geometry_msgs/msg/Quaternion', x=x, y=y, z=z, w=w)
    at = vector(position, 'Point')
    return message('geometry_msgs/msg/Pose', position=at, orientation=turn)


def odometry(stamp, position, quaternion, linear, angular, *, frame='map', child='body'):
    none = np.zeros(36)
    twist = message('geometry_msgs/msg/Twist', linear=vector(linear), angular=vector(angular))
    return message(
        'nav_msgs/msg/Odometry',
        header=header(stamp, frame),
        child_frame_id=child,
        pose=message(
            'geometry_msgs/msg/PoseWithCovariance',
            pose=pose(position, quaternion),
            covariance=none,
        ),
        twist=message('geometry_msgs/msg/TwistWithCovariance', twist=twist, covariance=none),
    )


def pose_stamped(stamp, position, quaternion, frame='map'):
    return message(
        'geometry_msgs/msg/PoseStamped',
        header=header(stamp, frame),
        pose=pose(position, quaternion),
    )


def text(data):
    return message('std_msgs/msg/String', data=data)


def write(folder: Path, topics):
    """Write a bag: {topic: [(log time, message), ...]}, or {topic: type} without messages."""
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {
            name: writer.add_connection(
                name,
                messages if isinstance(messages, str) else messages[0][1].__msgtype__,
                typestore=STORE,
            )
            for name, messages in topics.items()
        }
        every = [
            (at, name, m)
            for name, messages in topics.items()
            if not isinstance(messages, str)
            for at, m in messages
        ]
        for at, name, m in sorted(every, key=lambda row: row[0]):
            data = STORE.serialize_cdr(m, m.__msgtype__)
            writer.write(connections[name], at, bytes(data))
    return folder


class Parabola:
    """A body thrown at 12 m/s under 30 degrees to the left by 20 degrees from 2 m, spinning.

    Attributes:
        t: Times [s].
        position: In `map` [m].
        velocity: In `map` [m/s].
        rotation: Attitude; it turns with the spin.
    """

    speed, climb, heading, height, spin = 12.0, 30.0, 20.0, 2.0, 8.0

    def __init__(self, rate=100.0):
        climb, heading = np.radians([self.climb, self.heading])
        v0 = self.speed * np.array(
            [
                np.cos(climb) * np.cos(heading),
                np.cos(climb) * np.sin(heading),
                np.sin(climb),
            ]
        )
        self.time = (v0[2] + np.sqrt(v0[2] ** 2 + 2 * GRAVITY * self.height)) / GRAVITY
        self.landing = v0[:2] * self.time
        self.apex = self.height + v0[2] ** 2 / (2 * GRAVITY)
        n = int(np.ceil(self.time * rate)) + 1
        self.t = np.arange(n) / rate
        down = np.array([0.0, 0.0, GRAVITY])
        self.velocity = v0 - self.t[:, None] * down
        self.position = (
            [0.0, 0.0, self.height] + self.t[:, None] * v0 - 0.5 * self.t[:, None] ** 2 * down
        )
        # Clockwise from above: about z down, which is -z up.
        self.rotation = Rotation.from_rotvec(np.outer(self.t, [0.0, 0.0, -self.spin]))

    def odometry(self, start=START, *, in_map=False, child='body', skip=(), norm=1.0):
        """Return messages with their log times; the twist is in `body`, or, wrong, in `map`."""
        linear = self.velocity if in_map else self.rotation.apply(self.velocity, inverse=True)
        turns = self.rotation.as_quat() * norm
        messages = []
        for i, t in enumerate(self.t):
            if i not in skip:
                at = start + round(t * SECOND)
                m = odometry(
                    at, self.position[i], turns[i], linear[i], (0, 0, -self.spin), child=child
                )
                messages.append((at + 1_000_000, m))
        return messages

    def poses(self, start=START):
        turns = self.rotation.as_quat()
        return [
            (start + round(t * SECOND), pose_stamped(start + round(t * SECOND), p, q))
            for t, p, q in zip(self.t, self.position, turns, strict=True)
        ]
