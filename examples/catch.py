"""Catch a thrown disc with a simulated robot that runs to where `predictor_node` expects it.

    .venv/bin/sim_node --ros-args -p disc:=ultrastar -p launch.speed:=17 -p launch.height:=1.3 \
        -p launch.spin:=60 -p auto_throw:=false
    .venv/bin/predictor_node --ros-args -p sources:=odom -p added_noise:=0.02
    .venv/bin/python examples/catch.py --at 20 -5

The robot is a point on the ground with a largest speed and acceleration. It calls for the throw,
runs to each new `predicted_landing`, and has caught the disc if it is within its reach at the
landing.
"""

import argparse
from collections.abc import Callable
import math
import sys
import time

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.utilities import try_shutdown
from std_srvs.srv import Trigger

from disc_sim_ros.cli.arguments import Parser
from disc_sim_ros.ros.qos import STATE_QOS
from disc_sim_ros.topics import ODOM, PredictorTopic

PERIOD = 0.01  # s, between two movements
PATIENCE = 60.0  # s, for the nodes and for the flight


class Robot:
    """A point on the ground that runs to a target.

    Attributes:
        x: Position in `map` [m].
        y: The same.
    """

    def __init__(self, x: float, y: float, speed: float, acceleration: float) -> None:
        """Stand at a place; limits in m/s and m/s^2."""
        self.x, self.y = x, y
        self._speed, self._acceleration = speed, acceleration
        self._u = self._v = 0.0

    def run(self, target: tuple[float, float], seconds: float) -> None:
        """Run towards a target, as fast as it can still stop there."""
        dx, dy = target[0] - self.x, target[1] - self.y
        distance = math.hypot(dx, dy)
        wanted = min(self._speed, math.sqrt(2.0 * self._acceleration * distance))
        u, v = (wanted * dx / distance, wanted * dy / distance) if distance else (0.0, 0.0)
        change = math.hypot(u - self._u, v - self._v)
        share = min(1.0, self._acceleration * seconds / change) if change else 1.0
        self._u += share * (u - self._u)
        self._v += share * (v - self._v)
        self.x += self._u * seconds
        self.y += self._v * seconds


class Catcher(Node):
    """The robot as a node: it publishes `robot_pose`."""

    def __init__(self, robot: Robot) -> None:
        """Subscribe to the predictor and, to know the end, to the simulator."""
        super().__init__('catcher')
        self.robot = robot
        self.target: tuple[float, float] | None = None
        self.disc: tuple[float, float, float] | None = None
        self.is_down = False
        self._has_flown = False
        self._pose = self.create_publisher(PoseStamped, 'robot_pose', STATE_QOS)
        self.throw = self.create_client(Trigger, 'sim_node/throw')
        self.create_subscription(
            PoseWithCovarianceStamped, PredictorTopic.LANDING, self._on_landing, STATE_QOS
        )
        self.create_subscription(Odometry, ODOM, self._on_odometry, STATE_QOS)
        self.create_timer(PERIOD, self._move)

    def _on_landing(self, message: PoseWithCovarianceStamped) -> None:
        at = message.pose.pose.position
        self.target = (at.x, at.y)

    def _on_odometry(self, message: Odometry) -> None:
        at, speed = message.pose.pose.position, message.twist.twist.linear
        self.disc = (at.x, at.y, at.z)
        moving = bool(speed.x or speed.y or speed.z)
        self._has_flown = self._has_flown or moving
        self.is_down = self._has_flown and not moving

    def _move(self) -> None:
        if self.target is None or self.is_down:
            return
        self.robot.run(self.target, PERIOD)
        pose = PoseStamped()
        pose.header.frame_id = 'map'
        pose.header.stamp = self.get_clock().now().to_msg()
        pose.pose.position.x, pose.pose.position.y = self.robot.x, self.robot.y
        pose.pose.orientation.w = 1.0
        self._pose.publish(pose)

    def is_ready(self) -> bool:
        """Return True if the simulator is there, and a predictor that measures its disc."""
        predictors = self.get_publishers_info_by_topic(PredictorTopic.LANDING)
        measuring = {end.node_name for end in self.get_subscriptions_info_by_topic(ODOM)}
        return (
            self.disc is not None
            and self.throw.service_is_ready()
            and any(end.node_name in measuring for end in predictors)
        )


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Return the options of the command line."""
    p = Parser(prog='catch', description='Catch a thrown disc with a simulated robot.')
    p.add_argument('--at', nargs=2, type=float, default=(20.0, -5.0), metavar=('X', 'Y'))
    p.add_argument('--speed', type=float, default=6.0, help='largest speed of the robot, m/s')
    p.add_argument('--acceleration', type=float, default=5.0, help='largest, m/s^2')
    p.add_argument('--reach', type=float, default=0.4, help='reach of the robot, m')
    return p.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Catch one throw; return 0 if it was caught, 1 if not."""
    options = parse(arguments)
    rclpy.init()
    node = Catcher(Robot(*options.at, options.speed, options.acceleration))
    try:
        if not spin_until(node, node.is_ready):
            print('catch: no sim_node or no predictor_node', file=sys.stderr)
            return 1
        node.throw.call_async(Trigger.Request())
        if not spin_until(node, lambda: node.is_down):
            print('catch: the disc did not land', file=sys.stderr)
            return 1
    except (KeyboardInterrupt, ExternalShutdownException):
        return 130
    finally:
        node.destroy_node()
        try_shutdown()
    x, y, _ = node.disc
    away = math.dist((x, y), (node.robot.x, node.robot.y))
    print(f'the disc lies at x {x:.2f} m, y {y:.2f} m, the robot is {away:.2f} m away', end=': ')
    print('caught' if away <= options.reach else 'missed')
    return 0 if away <= options.reach else 1


def spin_until(node: Catcher, condition: Callable[[], bool]) -> bool:
    """Take messages until a condition holds; return False after PATIENCE."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            return False
        rclpy.spin_once(node, timeout_sec=0.1)
    return True


if __name__ == '__main__':
    sys.exit(main())
