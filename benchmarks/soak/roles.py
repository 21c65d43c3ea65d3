"""The other nodes in the domain of a soak, each in its own process.

usage: benchmarks/soak/roles.py pilot | subscriber | guests
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
AMPLITUDE = (0.004, 0.003)  # of C_L, C_M
EVERY, STAY = 10.0, 0.2  # s from guest to guest, and how long each stays
TYPES = {
    'odom': Odometry, 'pose': PoseStamped, 'transform': TransformStamped, 'imu': Imu,
    'joint_states': JointState, 'aero_wrench': WrenchStamped, 'airspeed': Float64, 'path': Path,
}  # fmt: skip


def pilot() -> None:
    """Send varying coefficients, 50 times a second."""
    rclpy.init()
    node = rclpy.create_node('pilot')
    publisher = node.create_publisher(Vector3Stamped, topics.CMD_COEFFICIENTS, qos.COMMAND_QOS)
    message, start, sent = Vector3Stamped(), time.monotonic(), 0
    while True:
        now = time.monotonic() - start
        message.vector.x = AMPLITUDE[0] * math.sin(now)
        message.vector.y = AMPLITUDE[1] * math.cos(0.7 * now)
        publisher.publish(message)
        sent += 1
        time.sleep(max(start + sent / COMMAND_RATE - time.monotonic(), 0.0))


def subscriber() -> None:
    """Subscribe to the state topics, as a node with callbacks does."""
    rclpy.init()
    node = rclpy.create_node('subscriber')
    for name, message_type in TYPES.items():
        node.create_subscription(message_type, name, lambda _: None, qos.STATE_QOS)
    rclpy.spin(node)


def guests() -> None:
    """Join the domain, subscribe to odom for a moment and leave, every 10 s."""
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
        {'pilot': pilot, 'subscriber': subscriber, 'guests': guests}[sys.argv[1]]()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
