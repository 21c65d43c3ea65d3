"""`live_view`: a page in the browser that shows the discs of the graph while they fly."""

from collections.abc import Sequence
import sys
from typing import Any

from nav_msgs.msg import Odometry
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from disc_sim_ros import topics
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.launch import Launch, require_above_ground
from disc_sim_ros.quantities import LAUNCH
from disc_sim_ros.ros import node_main, parameters
from disc_sim_ros.ros.live.discs import LiveDisc
from disc_sim_ros.ros.live.options import LIVE_TABLE, live_config
from disc_sim_ros.ros.live.server import LiveServer
from disc_sim_ros.ros.recorder.polling_thread import PollingThread
from disc_sim_ros.units import SYSTEMS
from disc_sim_ros.view.page import live_page

SENT = 'sent to the simulator'  # which may still refuse it
DISCOVERY_PERIOD = 0.5  # s between two looks at the graph
_ODOMETRY = 'nav_msgs/msg/Odometry'


class LiveViewNode(Node):
    """Connects the graph and the web server.

    Raises:
        ConfigError: A parameter is not allowed, or the port is in use.
        DiscSimError: A package for the page is missing.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Serve the page; `start` begins to send states, while the node spins."""
        super().__init__('live_view', **kwargs)
        parameters.declare(self, LIVE_TABLE)
        parameters.refuse_unused(self)
        config = live_config(parameters.values(self, LIVE_TABLE))
        self._system = SYSTEMS[config.units]
        self._discs: dict[str, LiveDisc] = {}
        self._server = LiveServer(
            config.address, config.port, live_page(self._system), self._throw
        )
        self.address = self._server.start_serving()
        self._thread = PollingThread(self._send, 1.0 / config.rate)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DISCOVERY_PERIOD, self._discover, clock=steady)
        self.get_logger().info(f'the page is {self.address}')
        if not config.is_local:
            self.get_logger().warning(
                'the page is open to the network, without encryption; '
                'only who has its whole address can throw'
            )

    def start(self) -> None:
        """Start the thread that sends states."""
        self._thread.start()

    @property
    def is_working(self) -> bool:
        """Return True while states are sent and the page is served."""
        return self._thread.is_alive() and self._server.is_alive()

    def stop(self) -> str:
        """End the thread and the server.

        Raises:
            DiscSimError: It ended early.
        """
        self._thread.end()
        self._server.end()
        if self._thread.failure is not None:
            raise self._thread.failure
        return ''

    def _discover(self) -> None:
        for name, types in self.get_topic_names_and_types():
            namespace, _, last = name.rpartition('/')
            if last == topics.ODOM and _ODOMETRY in types and namespace not in self._discs:
                # A new dictionary: other threads read the old one.
                self._discs = {**self._discs, namespace: LiveDisc(self, namespace)}

    def _send(self) -> bool:
        """Send the new states of the discs; messages wait while no browser has the page."""
        if self._server.has_viewers:
            states = {}
            for namespace, disc in self._discs.items():
                state = disc.update(self._system)
                if state is not None:
                    states[namespace] = {**disc.about(), **state}
            if states:
                self._server.send({'discs': states})
        return False

    def _throw(self, values: dict[str, Any]) -> str:
        """Send the launch of a page; whether the simulator takes it, its log and events tell.

        Raises:
            ConfigError: A number is out of range.
            DiscSimError: There is no such disc, or it does not take throws.
        """
        namespace = values.pop('disc', '')
        disc = self._discs.get(namespace) if isinstance(namespace, str) else None
        if disc is None or not disc.throw.get_subscription_count():
            raise DiscSimError('no simulator takes throws for this disc')
        for name, value in values.items():
            if name not in LAUNCH:
                raise ConfigError(name, value, f'choose from {", ".join(LAUNCH)}')
        launch = Launch(**{n: LAUNCH[n].check(x, n) for n, x in values.items()})
        require_above_ground(launch.height)
        disc.throw.publish(_odometry(launch, disc.frame, disc.child_frame))
        return SENT


def _odometry(launch: Launch, frame: str, child: str) -> Odometry:
    message = Odometry(child_frame_id=child)
    message.header.frame_id = frame
    pose, twist = message.pose.pose, message.twist.twist
    numbers = iter(frames.odometry(launch.state()))
    for part, names in (
        (pose.position, 'xyz'),
        (pose.orientation, 'xyzw'),
        (twist.linear, 'xyz'),
        (twist.angular, 'xyz'),
    ):
        for name in names:
            setattr(part, name, float(next(numbers)))
    return message


def main(args: Sequence[str] | None = None) -> int:
    """Serve the page until Ctrl-C or SIGTERM.

    Returns:
        The exit code: 0, 1 if the node failed, 2 for bad arguments or parameters.
    """
    return node_main.run('live_view', LiveViewNode, args)


if __name__ == '__main__':
    sys.exit(main())
