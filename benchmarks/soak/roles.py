"""Who else is in the domain of a soak, each a process of its own.

usage: benchmarks/soak/roles.py pilot | listener | guests
"""

import math
import signal
import sys
import time

from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry, Path
import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64

from disc_sim_ros import topics
from disc_sim_ros.ros import qos

COMMAND_RATE = 50.0  # Hz
SWAY = (0.004, 0.003)  # C_L, C_M at most
EVERY, STAY = 10.0, 0.2  # s from guest to guest, and how long each listens
HEARD = {
    'odom': Odometry, 'pose': PoseStamped, 'transform': TransformStamped, 'imu': Imu,
    'joint_states': JointState, 'aero_wrench': WrenchStamped, 'airspeed': Float64, 'path': Path,
}  # fmt: skip


def pilot() -> None:
    """Send coefficients that sway, 50 times a second."""
    rclpy.init()
    node = rclpy.create_node('pilot')
    send = node.create_publisher(Vector3Stamped, topics.CMD_COEFFICIENTS, qos.COMMAND_QOS)
    message, begun, sent = Vector3Stamped(), time.monotonic(), 0
    while True:
        now = time.monotonic() - begun
        message.vector.x = SWAY[0] * math.sin(now)
        message.vector.y = SWAY[1] * math.cos(0.7 * now)
        send.publish(message)
        sent += 1
        time.sleep(max(begun + sent / COMMAND_RATE - time.monotonic(), 0.0))


def listener() -> None:
    """Hear every state topic, as a node with callbacks does."""
    rclpy.init()
    node = rclpy.create_node('listener')
    for name, kind in HEARD.items():
        node.create_subscription(kind, name, lambda _: None, qos.STATE_QOS)
    rclpy.spin(node)


def guests() -> None:
    """Join the domain, hear odom for a moment and leave it, every 10 s."""
    while True:
        rclpy.init()
        node = rclpy.create_node('guest')
        node.create_subscription(Odometry, topics.ODOM, lambda _: None, qos.STATE_QOS)
        end = time.monotonic() + STAY
        while time.monotonic() < end:
            rclpy.spin_once(node, timeout_sec=STAY)
        node.destroy_node()
        rclpy.shutdown()
        time.sleep(EVERY - STAY)


if __name__ == '__main__':
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        {'pilot': pilot, 'listener': listener, 'guests': guests}[sys.argv[1]]()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
