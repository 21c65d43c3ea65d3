"""Throw the disc from another node, as a robot arm would, and print the events of the flight.

Start a simulator that waits, then throw:

    .venv/bin/sim_node --ros-args -p auto_throw:=false
    .venv/bin/python examples/throw.py --speed 18 --pitch 12
"""

import argparse
from collections.abc import Callable
import math
import sys
import time

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args, try_shutdown

PATIENCE = 30.0  # s, for the discovery of the simulator
TO_THROW = 10.0  # s, for the throw
TO_BE_FOUND = 0.2  # s, for the simulator to discover this subscription, which cannot be observed
ENDS = {'landed', 'failed', 'reset', 'thrown'}  # events that end a flight


class Thrower(Node):
    """Publishes a launch state on `throw` and follows `flight_events`.

    Attributes:
        events: Names of the events since the throw of this node, which is the first.
    """

    def __init__(self) -> None:
        super().__init__('thrower')
        self.events: list[str] = []
        self._throw = self.create_publisher(Odometry, 'throw', 10)
        self.create_subscription(DiagnosticStatus, 'flight_events', self._on_event, 100)

    def simulator_is_there(self) -> bool:
        """Return True if a simulator takes throws and publishes events."""
        takes_throws = self._throw.get_subscription_count() > 0
        return takes_throws and self.count_publishers('flight_events') > 0

    def throw(self, release: Odometry) -> None:
        """Release the disc now: the stamp 0 does not delay the throw."""
        self._throw.publish(release)

    def end_of_flight(self) -> str:
        """Return the event that ended the flight; empty while the disc flies."""
        return next((event for event in self.events[1:] if event in ENDS), '')

    def spin_until(self, condition: Callable[[], object], patience: float = math.inf) -> bool:
        """Take messages until a condition holds; return False after `patience` [s]."""
        end = time.monotonic() + patience
        while not condition() and time.monotonic() < end:
            rclpy.spin_once(self, timeout_sec=0.1)
        return bool(condition())

    def _on_event(self, event: DiagnosticStatus) -> None:
        name = event.name.rpartition(': ')[2]  # of, say, 'red/sim_node: landed'
        values = {pair.key: pair.value for pair in event.values}
        ours = name == 'thrown' and values['from'] == 'throw'  # not auto_throw, nor a service
        if self.events or ours:
            print(f'{name}: {event.message}', flush=True)
            self.events.append(name)


def release(options: argparse.Namespace) -> Odometry:
    """Return the launch state, in the axes of REP-103: x forward, y left, z up."""
    message = Odometry(child_frame_id='disc')
    message.header.frame_id = 'map'
    message.pose.pose.position.z = options.height
    q = message.pose.pose.orientation
    # About y left, nose up is negative; about z up, so is a turn to the right.
    q.x, q.y, q.z, q.w = quaternion(options.roll, -options.pitch, -options.yaw)
    # In axes that tilt with the disc and do not spin: the disc flies along its x axis.
    message.twist.twist.linear.x = options.speed
    message.twist.twist.angular.z = -options.spin
    return message


def quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Return x, y, z, w of a turn by yaw, then pitch, then roll [degrees]."""
    half = [math.radians(angle) / 2 for angle in (roll, pitch, yaw)]
    (sr, sp, sy), (cr, cp, cy) = map(math.sin, half), map(math.cos, half)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def parse(arguments: list[str]) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description='Throw the disc of a running sim_node.')
    for name, default, text in (
        ('speed', 15.0, 'm/s'),
        ('pitch', 15.0, 'degrees, nose up'),
        ('roll', 0.0, 'degrees, right edge down'),
        ('yaw', 0.0, 'degrees, to the right'),
        ('spin', 31.416, 'rad/s, clockwise from above'),
        ('height', 0.0, 'm above the ground'),
    ):
        help_ = f'{text} (default {default:g})'
        parser.add_argument(f'--{name}', type=float, default=default, help=help_)
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Throw once; return 0 after the landing, 1 if there is none."""
    arguments = sys.argv[1:] if arguments is None else arguments
    options = parse(remove_ros_args(['throw', *arguments])[1:])
    # Python's handling of Ctrl-C: that of rclpy shuts down the context during spin_once.
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    node = Thrower()
    try:
        if not node.spin_until(node.simulator_is_there, PATIENCE):
            print('there is no simulator, or it is in another namespace', file=sys.stderr)
            return 1
        node.spin_until(lambda: False, TO_BE_FOUND)
        node.throw(release(options))
        if not node.spin_until(lambda: node.events, TO_THROW):
            print('it did not throw: it is paused, or its log has the reason', file=sys.stderr)
            return 1
        node.spin_until(node.end_of_flight)
        return 0 if node.end_of_flight() == 'landed' else 1
    except KeyboardInterrupt:
        return 1
    finally:
        node.destroy_node()
        try_shutdown()


if __name__ == '__main__':
    sys.exit(main())
