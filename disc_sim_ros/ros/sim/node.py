"""`sim_node`: the disc in real time on ROS 2."""

from collections.abc import Callable, Sequence
import math
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter

from disc_sim_ros import topics
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.ros import node_main, parameters
from disc_sim_ros.ros.line_limit import LineLimit
from disc_sim_ros.ros.signals import exit_on_signal
from disc_sim_ros.ros.sim import compiled_loop
from disc_sim_ros.ros.sim.commands import Commands
from disc_sim_ros.ros.sim.config import SimConfig, configuration
from disc_sim_ros.ros.sim.diagnostics import SimDiagnostics
from disc_sim_ros.ros.sim.loop import SimLoop
from disc_sim_ros.ros.sim.parameters import TABLE
from disc_sim_ros.ros.sim.publishers import Publishers
from disc_sim_ros.ros.sim.services import create_services
from disc_sim_ros.ros.sim.standard.services import offer_standard_services
from disc_sim_ros.ros.sinks import PublisherSinkFactory
from disc_sim_ros.units import NANOSECONDS

DIAGNOSTIC_PERIOD = 1.0  # s
WARNING_PERIOD = 1.0  # s, between two warnings about the same thing
INFORMATION_BURST = 10  # lines about one kind of event that may follow one another at once


class SimNode(Node):
    """The ROS side of a simulation loop; holds no physics.

    Raises:
        ConfigError: A parameter is misspelt or out of range, or some do not go together.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Declare parameters, make publishers and subscriptions; `start` starts the loop."""
        super().__init__('sim_node', **kwargs)
        parameters.declare(self, TABLE)
        config = configuration(parameters.values(self, TABLE))
        frames = topics.Frames.prefixed(config.frame_prefix)
        factory = PublisherSinkFactory(self)
        publishers = Publishers(factory, frames, with_clock=config.publish_clock)
        commands = Commands(self, frames)
        self._warnings: dict[str, LineLimit] = {}  # by what they are about
        self._events: dict[str, LineLimit] = {}
        self.loop = SimLoop(
            config,
            publishers,
            commands,
            first_stamp(config, self),
            self._warn,
            wall=wall_clock(config, self),
            inform=self._inform,
        )
        factory.on_change = self.loop.interrupt
        create_services(self, self.loop)
        self._standard = offer_standard_services(self, self.loop, frames)
        parameters.refuse_unused(self)
        self.add_pre_set_parameters_callback(lambda new: parameters.widened(new, TABLE))
        self.add_on_set_parameters_callback(self._on_set)
        self.add_post_set_parameters_callback(self._after_set)
        self._is_alone = True
        self._diagnostics = SimDiagnostics(self.loop, factory.node_name, frames.disc)
        self._diagnostics_publisher = self.create_publisher(
            DiagnosticArray, topics.DIAGNOSTICS, 10
        )
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSTIC_PERIOD, self._publish_diagnostics, clock=steady)

    def start(self) -> None:
        """Start the simulation thread."""
        config = self.loop.config
        throw = 'throwing' if config.auto_throw else 'waiting for ~/throw or throw'
        self.get_logger().info(
            f'ready: {config.setup.disc.name}, {config.physics_rate:g} Hz, {throw}'
        )
        self.loop.start()

    @property
    def is_working(self) -> bool:
        """Return True while the simulation thread runs, and no client has asked to quit."""
        end = math.inf if self._standard is None else self._standard.end
        return self.loop.is_alive() and time.monotonic() < end

    def stop(self) -> str:
        """End the simulation thread and wait for it; return nothing to say.

        Raises:
            DiscSimError: The thread was started and has ended by itself.
        """
        broken = self.loop.ident is not None and not self.loop.is_alive()
        self.loop.end()
        if broken:
            raise DiscSimError('the simulation thread ended, see above')
        if self.loop.is_alive():
            self.loop.join()
        return ''

    def _on_set(self, changes: list[Parameter]) -> SetParametersResult:
        reason = parameters.refusal(self, changes, TABLE, configuration)
        return SetParametersResult(successful=not reason, reason=reason)

    def _after_set(self, _: list[Parameter]) -> None:
        config = configuration(parameters.values(self, TABLE))
        self.loop.submit(lambda: self.loop.configure(config))

    def _publish_diagnostics(self) -> None:
        self._warn_of_namesake()
        message = DiagnosticArray(status=[self._diagnostics.end_period()])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics_publisher.publish(message)

    def _warn_of_namesake(self) -> None:
        """Warn once if another node has this name: they share services and mix their topics."""
        own = (self.get_name(), self.get_namespace())
        if self._is_alone and self.get_node_names_and_namespaces().count(own) > 1:
            self._is_alone = False
            name = self.get_fully_qualified_name()
            self.get_logger().warning(
                f'another node is named {name}: give each disc a namespace, -r __ns:=/red'
            )

    def _warn(self, text: str, about: str) -> None:
        """Log a warning, at most one in WARNING_PERIOD `about` the same thing."""
        limit = self._warnings.setdefault(about, LineLimit(1, WARNING_PERIOD))
        if line := limit.admit(text, time.monotonic()):
            self.get_logger().warning(line)

    def _inform(self, text: str, about: str) -> None:
        """Log what happens; a flood of events `about` the same thing is one line a period."""
        limit = self._events.setdefault(about, LineLimit(INFORMATION_BURST, WARNING_PERIOD))
        if line := limit.admit(text, time.monotonic()):
            self.get_logger().info(line)


def first_stamp(config: SimConfig, node: Node) -> int:
    """Return the first stamp [ns]: `start_time`; or 0 with `publish_clock`; or the time now."""
    if config.start_time >= 0.0:
        return round(config.start_time * NANOSECONDS)
    return 0 if config.publish_clock else int(node.get_clock().now().nanoseconds)


def wall_clock(config: SimConfig, node: Node) -> Callable[[], int] | None:
    """Return a function that reads the wall clock [ns]; None if stamps count from another time."""
    simulated = node.get_parameter('use_sim_time').value
    if config.start_time >= 0.0 or config.publish_clock or simulated:
        return None
    return time.time_ns


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM.

    Returns:
        The exit code: 0, 1 if the simulation broke down, 2 for bad arguments or parameters.
    """
    exit_on_signal()  # also while compiling
    if text := compiled_loop.first_call_note():
        sys.stderr.write(f'sim_node: {text}\n')
    compiled_loop.warm_up()
    return node_main.run('sim_node', SimNode, args)


if __name__ == '__main__':
    sys.exit(main())
