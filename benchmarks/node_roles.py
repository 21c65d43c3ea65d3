"""The other processes of benchmarks/node.py: a subscriber, a commander, a sleeper, and peers.

usage: benchmarks/node_roles.py subscribe TOPIC ... | command RATE | sleep RATE | naive RATE |
    rcl LIBRARY RATE
"""

from collections import deque
import ctypes
import os
import sys
import time

from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMessage
import rclpy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64

from disc_sim_ros import topics
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.internals import PolledSubscription

DEEP = QoSProfile(depth=1000)
TYPES = {
    'odom': Odometry, 'pose': PoseStamped, 'transform': TransformStamped, 'imu': Imu,
    'joint_states': JointState, 'aero_wrench': WrenchStamped, 'airspeed': Float64,
    'path': PathMessage,
}  # fmt: skip
HIGH = 1000.0  # m: a disc thrown from here flies for minutes


def subscribe(*names: str) -> None:
    """Print a line when messages of the first topic arrive, and at the end how many a second."""
    rclpy.init()
    node = rclpy.create_node('subscriber')
    subscriptions = [PolledSubscription(node, TYPES[name], name, DEEP, raw=True) for name in names]
    counts = [0] * len(subscriptions)
    first = None
    try:
        while True:
            for k, subscription in enumerate(subscriptions):
                while subscription.take() is not None:
                    counts[k] += 1
            if first is None and counts[0]:
                print('first message', flush=True)
                first, counts[0] = time.monotonic(), 0
            time.sleep(1e-3)
    except KeyboardInterrupt:
        print(counts[0] / (time.monotonic() - (first or 0.0)))


def command(rate: str) -> None:
    """Send coefficients at a rate."""
    rclpy.init()
    node = rclpy.create_node('commander')
    send = node.create_publisher(Vector3Stamped, topics.CMD_COEFFICIENTS, 10)
    message = Vector3Stamped()
    message.vector.x = 1e-6
    epoch, i = time.monotonic(), 0
    try:
        while True:
            send.publish(message)
            i += 1
            time.sleep(max(0.0, epoch + i / float(rate) - time.monotonic()))
    except KeyboardInterrupt:
        pass


def sleep(rate: str) -> None:
    """Sleep to deadlines until SIGINT, then print how late it woke up for the last 4,096 [s]."""
    late: deque[float] = deque(maxlen=4096)
    period = 1.0 / float(rate)
    epoch, i = time.monotonic(), 1
    try:
        while True:
            wait = epoch + i * period - time.monotonic()
            if wait > 0.0:
                time.sleep(wait)
            late.append(time.monotonic() - epoch - i * period)
            i += 1
    except KeyboardInterrupt:
        print(*late, sep='\n')


def naive(rate: str) -> None:
    """Run the node that a first attempt would be."""
    rclpy.init()
    node = rclpy.create_node('naive')
    setup = Setup(disc=disc_file.load_disc('frisbee'), step=1.0 / float(rate))
    sim = FlightSimulator(setup, Launch(height=HIGH).state(), ground=False)
    odom = node.create_publisher(Odometry, 'odom', DEEP)
    pose = node.create_publisher(PoseStamped, 'pose', DEEP)

    def on_command(message: Vector3Stamped) -> None:
        sim.control = Control(message.vector.x, message.vector.y, message.vector.z)

    def on_timer() -> None:
        sim.advance(1)
        stamp = node.get_clock().now().to_msg()
        x, y, z, qx, qy, qz, qw, *twist = messages.odometry(sim.state)
        at = PoseStamped()
        at.header.stamp, at.header.frame_id = stamp, 'map'
        at.pose.position.x, at.pose.position.y, at.pose.position.z = x, y, z
        q = at.pose.orientation
        q.x, q.y, q.z, q.w = qx, qy, qz, qw
        message = Odometry(child_frame_id='disc')
        message.header = at.header
        message.pose.pose = at.pose
        linear, angular = message.twist.twist.linear, message.twist.twist.angular
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = twist
        odom.publish(message)
        pose.publish(at)

    node.create_subscription(Vector3Stamped, topics.CMD_COEFFICIENTS, on_command, DEEP)
    node.create_timer(1.0 / float(rate), on_timer)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass


def rcl(library: str, rate: str) -> None:
    """Run the C++ program of benchmarks/rcl_loop.cpp, which prints its lateness at SIGINT."""
    rclpy.init()
    node = rclpy.create_node('loader')  # loads what the library calls
    for name in ('odom', 'pose'):
        node.create_publisher(TYPES[name], f'loaded_{name}', 1)
    loop = ctypes.CDLL(library).rcl_loop
    loop.argtypes = [ctypes.c_double]
    loop.restype = None
    loop(float(rate))
    sys.stdout.flush()
    os._exit(0)  # rcl of C++ and of rclpy, in one process, cannot both be shut down


if __name__ == '__main__':
    roles = {
        'subscribe': subscribe,
        'command': command,
        'sleep': sleep,
        'naive': naive,
        'rcl': rcl,
    }
    roles[sys.argv[1]](*sys.argv[2:])
