"""`recorder_node`: every topic into a bag, as the bytes that arrived."""

from collections.abc import Callable, Mapping, Sequence
import itertools
import sys
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from std_srvs.srv import Trigger

from disc_sim_ros import topics
from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError, ConfigError
from disc_sim_ros.ros import node_main, parameters
from disc_sim_ros.ros.recorder import diagnostics
from disc_sim_ros.ros.recorder.delivery import Delivery
from disc_sim_ros.ros.recorder.discovery import TopicDiscovery
from disc_sim_ros.ros.recorder.options import RECORDER_TABLE, RecorderConfig, recorder_config
from disc_sim_ros.ros.recorder.polling_thread import PollingThread
from disc_sim_ros.ros.recorder.writer_thread import WriterThread

DISCOVERY_PERIOD = 0.05  # s between two looks at the graph; each takes 6 us
DIAGNOSTIC_PERIOD = 1.0  # s
PATIENCE = 5.0  # s, for the disk to do what a service asks
POLLING_PERIOD = 0.01  # s between two rounds of taking messages
HARMLESS_STALL = 0.5  # s; longer ones are told: a publisher may end or overwrite meanwhile
POLLING_PERIOD_SIM_TIME = 0.001  # s; then a message is recorded at the time of taking it


class RecorderNode(Node):
    """Connects the graph, the threads that take and write messages, services and diagnostics.

    Raises:
        ConfigError: A parameter is misspelt or out of range, or the bag exists.
        BagError: No bag can be written there.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Make the bag; `start` begins to record, while the node spins."""
        super().__init__('recorder_node', **kwargs)
        parameters.declare(self, RECORDER_TABLE)
        config = recorder_config(parameters.values(self, RECORDER_TABLE), self.get_namespace())
        for name, action in (
            ('pause', self._pause),
            ('resume', self._resume),
            ('split', self._split),
            ('flush', self._flush),
        ):
            self.create_service(Trigger, f'~/{name}', _trigger(action))
        parameters.refuse_unused(self)
        self._diagnostics = self.create_publisher(DiagnosticArray, topics.DIAGNOSTICS, 10)
        self.writer = self._new_writer(config)
        self._writer_thread = WriterThread(self.writer, config.flush_period)
        sim_time: bool = self.get_parameter('use_sim_time').value
        self._delivery = Delivery(
            self._writer_thread,
            paused=config.start_paused,
            simulated_time=self._simulated_time if sim_time else None,
        )
        self._discovery = TopicDiscovery(
            self, config.selection, self._writer_thread, self._delivery
        )
        period = POLLING_PERIOD_SIM_TIME if sim_time else POLLING_PERIOD
        self._polling_thread = PollingThread(self._discovery.take, period)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DISCOVERY_PERIOD, self._discover, clock=steady)
        self.create_timer(DIAGNOSTIC_PERIOD, self._publish_diagnostics, clock=steady)
        state = ', paused: ~/resume begins' if config.start_paused else ''
        self.get_logger().info(f'recording {config.selection} to {self.writer.folder}{state}')

    def _new_writer(self, config: RecorderConfig) -> BagWriter:
        """Return the writer of a new bag; a default name that is taken gets a number."""
        folders = (config.bag.with_name(f'{config.bag.name}_{i}') for i in itertools.count(2))
        folder = config.bag
        while True:
            try:
                return BagWriter(
                    folder,
                    compression=config.compression,
                    flush_period=config.flush_period,
                    max_size=config.max_size,
                    max_duration=config.max_duration,
                    custom_data={'recorder': self.get_fully_qualified_name()},
                    ros_distro=schemas.ros_distro(),
                    repeat_latched=config.repeat_latched,
                )
            except ConfigError:
                if not (config.may_rename and folder.exists()):
                    raise
                folder = next(folders)

    def start(self) -> None:
        """Start the threads that take messages and write them."""
        self._writer_thread.start()
        self._polling_thread.start()
        self._delivery.stalls.start()

    @property
    def is_working(self) -> bool:
        """Return True while both threads run."""
        return self._writer_thread.is_alive() and self._polling_thread.is_alive()

    def stop(self) -> str:
        """Write all that has arrived, close the bag and return a line about its contents.

        Raises:
            DiscSimError: The disk refused, or recording ended early; what was flushed is safe.
        """
        writer, polling = self._writer_thread, self._polling_thread
        polling.end()
        self._delivery.stalls.end()
        if writer.failure is None and polling.failure is None:
            self._record_rest()
        self._discovery.close()
        writer.end()
        writer.join()
        failure = writer.failure or polling.failure
        if failure is not None:
            raise failure
        recorders = list(self._discovery.recorders.values())
        return diagnostics.summary(
            self.writer,
            recorders,
            self._discovery.refused,
            stall=self._stall,
            skipped=self._delivery.skipped,
        )

    def _record_rest(self) -> None:
        with self._delivery.lock:
            self._discovery.drain()
            late = self._delivery.release_without_clock()
        if late:
            self.get_logger().warning(
                f'no /clock came: the log times of {late} messages are their times of arrival'
            )
        self._note_losses()

    def _simulated_time(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _discover(self) -> None:
        self._discovery.update()
        with self._delivery.lock:
            self._delivery.release_waiting()

    # ---- services ----

    def _pause(self) -> str:
        with self._delivery.lock:
            self._discovery.drain()
            self._delivery.paused = True
        return 'paused: messages are not recorded'

    def _resume(self) -> str:
        """Go on, with the last messages of each latched topic that arrived meanwhile."""
        with self._delivery.lock:
            self._discovery.drain()
            self._delivery.resume()
        return 'recording'

    def _split(self) -> str:
        self._discovery.drain()
        self._writer_thread.call(BagWriter.split).result(PATIENCE)
        return f'recording to {self.writer.files[-1].name}'

    def _flush(self) -> str:
        self._discovery.drain()
        count = self._writer_thread.call(_flushed).result(PATIENCE)
        return f'{count} messages are on the disk'

    # ---- diagnostics ----

    def _publish_diagnostics(self) -> None:
        """Publish the state of the recording, note losses in the bag and warn of problems."""
        self._note_losses()
        name = self.get_fully_qualified_name()
        self._warn_of_problems(name)
        recorders = self._discovery.recorders.values()
        lateness = [recorder.take_lateness() for recorder in recorders]
        progress = diagnostics.Progress(
            paused=self._delivery.paused,
            topics=len(recorders),
            backlog=self._writer_thread.backlog,
            lateness=max(lateness, default=0) * 1e-9,
            losses=self._losses(),
            refused=self._discovery.refused,
            stall=self._stall,
        )
        message = DiagnosticArray(status=[diagnostics.diagnostic(name, self.writer, progress)])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _warn_of_problems(self, name: str) -> None:
        warn_once = self._discovery.warn_once
        if name in diagnostics.duplicate_names(self.get_node_names_and_namespaces()):
            warn_once(f'there is another node {name}; both go on, each with its own bag')
        waiting = self._delivery.waiting
        if waiting:
            warn_once(f'no /clock has come: {waiting} messages wait for the time', topics.CLOCK)
        shift = self._delivery.clock.shift
        if shift:
            text = f'the wall clock was set by {shift * 1e-9:+.1f} s; log times go on without that'
            warn_once(text)

    @property
    def _stall(self) -> float:
        """Return the longest time that this node did not run [s]; 0 for times without harm."""
        longest = self._delivery.stalls.longest
        return longest if longest > HARMLESS_STALL else 0.0

    def _losses(self) -> dict[str, int]:
        return diagnostics.losses(self._discovery.recorders.values())

    def _note_losses(self) -> None:
        losses, stall = self._losses(), self._stall
        for key, count in losses.items():
            what = '' if key.startswith(topics.Loss.ENDED) else ' messages'
            self._discovery.warn_once(f'{key}: {count}{what}', about=key)
        if stall:
            text = f'for {stall:.1f} s: what was sent meanwhile may be lost'
            self._discovery.warn_once(f'{topics.Loss.STALL} {text}', about=topics.Loss.STALL)
            self._writer_thread.call(lambda writer: writer.custom(topics.Loss.STALL, text))
        if losses:
            self._writer_thread.call(lambda writer: _note(writer, losses))


def _flushed(writer: BagWriter) -> int:
    """Flush; return the messages that are on the disk, without those that come meanwhile."""
    writer.flush()
    return writer.message_count


def _note(writer: BagWriter, losses: Mapping[str, int]) -> None:
    for key, count in losses.items():
        writer.custom(key, str(count))


def _trigger(action: Callable[[], str]) -> Callable[[Any, Any], Any]:
    """Return the callback of a service that calls `action` and answers with its result."""

    def callback(_: Any, response: Any) -> Any:
        try:
            response.message = action()
            response.success = True
        except (BagError, TimeoutError) as error:
            response.message = str(error) or f'the disk did not answer within {PATIENCE:g} s'
        return response

    return callback


def main(args: Sequence[str] | None = None) -> int:
    """Record until Ctrl-C, SIGTERM, SIGHUP or SIGQUIT.

    Returns:
        The exit code: 0, 1 if the disk refused, 2 for bad arguments or parameters.
    """
    return node_main.run('recorder_node', RecorderNode, args)


if __name__ == '__main__':
    sys.exit(main())
