"""Throw twice, the second time with a steady command, and print where the disc lands.

    .venv/bin/sim_node --ros-args -p auto_throw:=false
    .venv/bin/python examples/steer.py --command 0 0.005 0

The three numbers are the paper's C_L, C_M, C_N. A spinning disc turns at right angles to a moment:
with clockwise spin, C_M > 0 (nose up) rolls it to the left.
"""

import argparse
from collections.abc import Callable
import math
import sys
import time

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Vector3, Vector3Stamped
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args, try_shutdown
from std_srvs.srv import Trigger

PATIENCE = 30.0  # s, for the discovery of the simulator and for its answer
RATE = 50.0  # Hz; a command that is not renewed for command_timeout, 0.5 s, falls to zero


class Steerer(Node):
    """Throws through a service and renews a command until the disc lands."""

    def __init__(self) -> None:
        super().__init__('steerer')
        self._ends: list[DiagnosticStatus] = []
        self._command = self.create_publisher(Vector3Stamped, 'cmd_coefficients', 10)
        # Before the client: the simulator discovers both in this order, so that a node with an
        # answer of the service also gets the later events.
        self.create_subscription(DiagnosticStatus, 'flight_events', self._on_event, 100)
        self._throw = self.create_client(Trigger, 'sim_node/throw')

    def simulator_is_there(self) -> bool:
        """Return True if a simulator takes commands, throws and publishes events."""
        return bool(
            self._command.get_subscription_count()
            and self._throw.service_is_ready()
            and self.count_publishers('flight_events')
        )

    def fly(self, command: list[float]) -> dict[str, str]:
        """Throw, hold a command until the end of the flight, and return the landing.

        Raises:
            RuntimeError: The simulator does not throw, or the flight does not end on the ground.
        """
        message = Vector3Stamped(vector=Vector3(**dict(zip('xyz', command, strict=True))))
        self._command.publish(message)  # stamp 0: acts at the next step, before the throw
        timer = self.create_timer(1.0 / RATE, lambda: self._command.publish(message))
        self._ends.clear()
        thrown = self._throw.call_async(Trigger.Request())
        if not self.spin_until(thrown.done, PATIENCE) or not thrown.result().success:
            raise RuntimeError('the simulator did not throw')
        self.spin_until(lambda: self._ends)
        self.destroy_timer(timer)
        if not self._ends[0].name.endswith(': landed'):
            raise RuntimeError(f'the flight did not end on the ground: {self._ends[0].message}')
        return {pair.key: pair.value for pair in self._ends[0].values}

    def spin_until(self, condition: Callable[[], object], patience: float = math.inf) -> bool:
        """Take messages until a condition holds; return False after `patience` [s]."""
        end = time.monotonic() + patience
        while not condition() and time.monotonic() < end:
            rclpy.spin_once(self, timeout_sec=0.1)
        return bool(condition())

    def _on_event(self, event: DiagnosticStatus) -> None:
        if event.name.endswith(': thrown'):
            self._ends.clear()  # the end of an earlier flight
        if event.name.endswith((': landed', ': failed', ': reset')):
            self._ends.append(event)


def parse(arguments: list[str]) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description='Steer the disc of a running sim_node.')
    parser.add_argument(
        '--command',
        type=float,
        nargs=3,
        default=[0.0, 0.005, 0.0],
        metavar=('C_L', 'C_M', 'C_N'),
        help='right edge down, nose up, clockwise (default 0 0.005 0)',
    )
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Fly without and with the command; return 0 after two landings."""
    arguments = sys.argv[1:] if arguments is None else arguments
    options = parse(remove_ros_args(['steer', *arguments])[1:])
    # Python's handling of Ctrl-C: that of rclpy shuts down the context during spin_once.
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    node = Steerer()
    try:
        if not node.spin_until(node.simulator_is_there, PATIENCE):
            print('there is no simulator, or it is in another namespace', file=sys.stderr)
            return 1
        for title, command in (('without', [0.0, 0.0, 0.0]), ('with', options.command)):
            landing = node.fly(command)
            x, y = float(landing['landing_x_m']), float(landing['landing_y_m'])
            print(f'{title} command {command}: landed at x {x:.2f} m, y {y:.2f} m', flush=True)
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 1
    finally:
        node.destroy_node()
        try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
