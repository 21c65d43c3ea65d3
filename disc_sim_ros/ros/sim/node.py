"""`sim_node`: the disc in real time on ROS 2."""

from collections.abc import Sequence
from concurrent.futures import TimeoutError as FutureTimeoutError
import os
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.utilities import try_shutdown
from std_srvs.srv import SetBool, Trigger

from disc_sim_ros import topics
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.physics import simulator
from disc_sim_ros.ros import parameters
from disc_sim_ros.ros.node_main import init, on_signal, plainly, serve
from disc_sim_ros.ros.sim.clock import NANOSECONDS
from disc_sim_ros.ros.sim.commands import Commands
from disc_sim_ros.ros.sim.config import SimConfig, configuration
from disc_sim_ros.ros.sim.loop import SimLoop
from disc_sim_ros.ros.sim.parameters import TABLE
from disc_sim_ros.ros.sim.publishers import Outputs
from disc_sim_ros.ros.sinks import PublisherSinkFactory

SERVICE_PATIENCE = 5.0  # s, for the simulation thread to do what a service asks
DIAGNOSTIC_PERIOD = 1.0  # s
LATE = 0.01  # s; a worse lateness in a second is a warning


class SimNode(Node):
    """Speaks ROS for a simulation loop; holds no physics.

    Raises:
        ConfigError: Parameters that are misspelt or impossible together.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Declare parameters, make publishers and subscriptions; `start` starts the loop."""
        super().__init__('sim_node', **kwargs)
        parameters.declare(self, TABLE)
        config = configuration(parameters.values(self, TABLE))
        frames = topics.Frames.prefixed(config.frame_prefix)
        self._disc = frames.disc
        outputs = Outputs(PublisherSinkFactory(self), frames, with_clock=config.publish_clock)
        commands = Commands(self, frames)
        self._silent_until: dict[str, float] = {}  # by what it is about
        self.loop = SimLoop(config, outputs, commands, first_stamp(config, self), self._warn)
        self.create_service(Trigger, '~/throw', self._on_throw)
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.create_service(Trigger, '~/step', self._on_step)
        self.create_service(SetBool, '~/pause', self._on_pause)
        parameters.refuse_unused(self)
        self.add_pre_set_parameters_callback(lambda new: parameters.widened(new, TABLE))
        self.add_on_set_parameters_callback(self._on_set)
        self.add_post_set_parameters_callback(self._after_set)
        self._diagnostics = self.create_publisher(DiagnosticArray, topics.DIAGNOSTICS, 10)
        self._since = (time.monotonic(), self.loop.timeline.now)
        self._dropped_before = 0
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSTIC_PERIOD, self._diagnose, clock=steady)

    def start(self) -> None:
        """Start the simulation thread."""
        self.loop.start()

    def stop(self) -> None:
        """End the simulation thread and wait for it."""
        self.loop.end()
        if self.loop.is_alive():
            self.loop.join()

    # ---- services ----

    def _on_throw(self, _: Any, response: Any) -> Any:
        return self._do(self.loop.throw, response)

    def _on_reset(self, _: Any, response: Any) -> Any:
        return self._do(self.loop.reset, response)

    def _on_step(self, _: Any, response: Any) -> Any:
        return self._do(self.loop.step, response)

    def _on_pause(self, request: Any, response: Any) -> Any:
        return self._do(self.loop.pause if request.data else self.loop.resume, response)

    def _do(self, action: Any, response: Any) -> Any:
        """Have the simulation thread act, and tell the caller what came of it."""
        answer = self.loop.submit(action)
        try:
            response.message = answer.result(SERVICE_PATIENCE)
            response.success = True
        except FutureTimeoutError:
            answer.cancel()
            response.message = f'the simulation did not answer within {SERVICE_PATIENCE:g} s'
        except DiscSimError as error:
            response.message = str(error)
        return response

    # ---- parameters ----

    def _on_set(self, changes: list[Parameter]) -> SetParametersResult:
        reason = parameters.refusal(self, changes, TABLE, configuration)
        return SetParametersResult(successful=not reason, reason=reason)

    def _after_set(self, _: list[Parameter]) -> None:
        config = configuration(parameters.values(self, TABLE))
        self.loop.submit(lambda: self.loop.configure(config))

    # ---- diagnostics ----

    def _diagnose(self) -> None:
        """Publish how the simulation keeps up with the clock, once a second."""
        loop = self.loop
        before, stamp_before = self._since
        now, stamp = time.monotonic(), loop.timeline.now
        self._since = now, stamp
        factor = (stamp - stamp_before) / NANOSECONDS / (now - before)
        worst = loop.pacer.take_worst()
        dropped = sum(topic.dropped for topic in loop.commands.all)
        problems = []
        if worst > LATE:
            problems.append(f'up to {worst * 1e3:.1f} ms late')
        if dropped > self._dropped_before:
            problems.append(f'{dropped - self._dropped_before} commands dropped')
        self._dropped_before = dropped
        values = {
            'paused': loop.paused,
            'real_time_factor': f'{factor:.4f}',
            'worst_lateness_s': f'{worst:.6f}',
            'lateness_p50_s': f'{loop.pacer.quantile(0.5):.6f}',
            'lateness_p99_s': f'{loop.pacer.quantile(0.99):.6f}',
            'missed_deadlines': loop.pacer.missed,
            'slips': loop.pacer.slips,
            'slipped_s': f'{loop.pacer.slipped:.6f}',
            'throws': loop.counts.throws,
            'landings': loop.counts.landings,
            'failed_flights': loop.counts.failures,
            'expired_commands': loop.counts.expired,
            'dropped_commands': dropped,
        }
        for topic in loop.commands.all:
            values[f'{topic.name} accepted'] = topic.accepted
            values[f'{topic.name} dropped'] = topic.dropped
            if topic.dropped:
                values[f'{topic.name} last reason'] = topic.reason
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if problems else DiagnosticStatus.OK,
            name=f'{self.get_fully_qualified_name()[1:]}: simulation',
            message=', '.join(problems) or ('paused' if loop.paused else 'in time'),
            hardware_id=self._disc,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _warn(self, text: str, about: str = '') -> None:
        """Log a line, at most one a second `about` the same thing."""
        now = time.monotonic()
        if now >= self._silent_until.get(about, 0.0):
            self._silent_until[about] = now + 1.0
            self._logger.warning(text)


def first_stamp(config: SimConfig, node: Node) -> int:
    """Return the first stamp [ns]: the configured one, 0 for who supplies the clock, or now."""
    if config.start_time >= 0.0:
        return round(config.start_time * NANOSECONDS)
    return 0 if config.publish_clock else int(node.get_clock().now().nanoseconds)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM.

    Returns:
        The exit code: 0, 1 if the simulation broke down, 2 for bad arguments or parameters.
    """
    on_signal(lambda *_: os._exit(0))  # nothing is open yet, and compiling takes its time
    if not simulator.is_ready():
        sys.stderr.write(
            'sim_node: compiling the equations of motion, once on this machine, about 10 s\n'
        )
    simulator.warm_up()
    signals: list[int] = []  # not an Event: a handler may be interrupted by itself
    on_signal(lambda number, _: signals.append(number))
    try:
        init(list(sys.argv if args is None else args))
        node = SimNode()
    except (DiscSimError, ParameterException, RuntimeError) as error:  # RuntimeError: of ROS
        sys.stderr.write(f'sim_node: error: {plainly(error)}\n')
        try_shutdown()
        return 2
    node.start()
    try:
        serve(node, lambda: not signals and node.loop.is_alive())
    finally:
        broken = not node.loop.is_alive()
        node.stop()
        node.destroy_node()
        try_shutdown()
    return 1 if broken else 0


if __name__ == '__main__':
    sys.exit(main())
