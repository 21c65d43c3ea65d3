"""`recorder_node`: every topic into a bag, as the bytes that arrived."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
import gc
import os
import sys
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.utilities import try_shutdown
from std_srvs.srv import Trigger

from disc_sim_ros import topics
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError, ConfigError, DiscSimError
from disc_sim_ros.ros import parameters
from disc_sim_ros.ros.node_main import init, on_signal, plainly, serve
from disc_sim_ros.ros.recorder import diagnostics
from disc_sim_ros.ros.recorder.discovery import TakingThread, TopicDiscovery
from disc_sim_ros.ros.recorder.options import RECORDER_TABLE, recorder_config
from disc_sim_ros.ros.recorder.topic_recorder import TopicRecorder
from disc_sim_ros.ros.recorder.writer_thread import LARGEST_BACKLOG, BagThread

DISCOVERY_PERIOD = 0.05  # s between two looks at the graph; each takes 6 us
DIAGNOSTIC_PERIOD = 1.0  # s
PATIENCE = 5.0  # s, for the disk to do what a service asks
TAKE_PERIOD = 0.01  # s between two rounds of taking messages
TAKE_PERIOD_SIM_TIME = 0.001  # s; then the time of taking is what is recorded

_Message = tuple[TopicRecorder, bytes, int, int]  # data, received, sent [ns]


class RecorderNode(Node):
    """Hands messages to the thread that writes the bag, and says how that goes.

    The executor serves the graph, services and diagnostics; `Listener` takes the messages.

    Raises:
        ConfigError: Parameters that are misspelt or impossible, or a bag that exists.
        BagError: No bag can be written there.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Make the bag; recording begins with `start`, while the node spins."""
        super().__init__('recorder_node', **kwargs)
        parameters.declare(self, RECORDER_TABLE)
        config = recorder_config(parameters.values(self, RECORDER_TABLE), self.get_namespace())
        self._paused = config.start_paused
        self._sim_time: bool = self.get_parameter('use_sim_time').value
        self._waiting: list[_Message] = []  # for the first time of the simulation
        self._waiting_bytes = 0
        self._held: dict[str, deque[_Message]] = {}  # what is latched, while paused
        for name, act in (
            ('pause', self._pause),
            ('resume', self._resume),
            ('split', self._split),
            ('flush', self._flush),
        ):
            self.create_service(Trigger, f'~/{name}', _answering(act))
        parameters.refuse_unused(self)
        self._diagnostics = self.create_publisher(DiagnosticArray, topics.DIAGNOSTICS, 10)
        self.writer = BagWriter(
            config.bag,
            compression=config.compression,
            flush_period=config.flush_period,
            max_size=config.max_size,
            max_duration=config.max_duration,
            custom_data={'recorder': self.get_fully_qualified_name()},
            ros_distro=os.environ.get('ROS_DISTRO', 'jazzy'),
        )
        self.thread = BagThread(self.writer, config.flush_period)
        self._topics = TopicDiscovery(self, config.selection, self.thread, self._deliver)
        period = TAKE_PERIOD_SIM_TIME if self._sim_time else TAKE_PERIOD
        self.listener = TakingThread(self._topics.take, period)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DISCOVERY_PERIOD, self._look, clock=steady)
        self.create_timer(DIAGNOSTIC_PERIOD, self._diagnose, clock=steady)
        state = ', paused: ~/resume begins' if self._paused else ''
        self._logger.info(f'recording {config.selection} to {self.writer.folder}{state}')

    def start(self) -> None:
        """Start the threads that take messages and write them."""
        self.thread.start()
        self.listener.start()

    @property
    def is_working(self) -> bool:
        """Whether both threads are at work."""
        return self.thread.is_alive() and self.listener.is_alive()

    def stop(self) -> str:
        """Write all that has arrived, close the bag and say what is in it.

        Raises:
            DiscSimError: The disk refused, or recording ended early; what was flushed is safe.
        """
        self.listener.end()
        if self.thread.failure is None and self.listener.failure is None:
            self._topics.drain()
            self._release(0)
            self._note_losses()
        self._topics.close()
        self.thread.end()
        self.thread.join()
        failure = self.thread.failure or self.listener.failure
        if failure is not None:
            raise failure
        return diagnostics.summary(self.writer, self._losses())

    def _look(self) -> None:
        self._topics.look()
        if self._waiting:
            now = self._now()
            if now > 0:
                self._release(now)

    # ---- messages ----

    def _deliver(self, track: TopicRecorder, data: bytes, received: int, sent: int) -> None:
        """Take a message; called with the lock of the topics held."""
        if self._paused:
            if track.latched:
                self._hold(track, data, received, sent)
            return
        if self._sim_time:
            now = self._now()
            if now <= 0:
                self._wait(track, data, received, sent)
                return
            if self._waiting:
                self._release(now)
            received = now
        if not self.thread.put(track.topic_id, data, received, sent or received):
            track.dropped += 1

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _hold(self, track: TopicRecorder, data: bytes, received: int, sent: int) -> None:
        """Keep the last messages of a latched topic for the end of the pause."""
        held = self._held.get(track.name, ())
        most = max(track.publishers, 1)
        self._held[track.name] = deque([*held, (track, data, received, sent)], maxlen=most)

    def _wait(self, track: TopicRecorder, data: bytes, received: int, sent: int) -> None:
        """Keep a message until there is a time of the simulation."""
        if self._waiting_bytes > LARGEST_BACKLOG:
            track.dropped += 1
            return
        self._waiting.append((track, data, received, sent))
        self._waiting_bytes += len(data) + 200

    def _release(self, now: int) -> None:
        """Record what waited for a time [ns]; 0: there will be none, arrival it is."""
        with self._topics.lock:
            waiting, self._waiting = self._waiting, []
            for track, data, received, sent in waiting:
                if not self.thread.put(track.topic_id, data, now or received, sent or received):
                    track.dropped += 1
        if waiting and not now:
            self._logger.warning(
                f'no /clock came: the log times of {len(waiting)} messages are not of it'
            )

    # ---- services ----

    def _pause(self) -> str:
        with self._topics.lock:
            self._topics.drain()
            self._paused = True
        return 'paused: messages are not recorded'

    def _resume(self) -> str:
        """Go on, with the last messages of each latched topic that came meanwhile."""
        with self._topics.lock:
            self._topics.drain()
            self._paused = False
            held, self._held = self._held, {}
            for messages in held.values():
                for track, data, _, sent in messages:
                    self._deliver(track, data, self._topics.clock.now(), sent)
        return 'recording'

    def _split(self) -> str:
        self._topics.drain()
        self.thread.call(BagWriter.split).result(PATIENCE)
        return f'recording to {self.writer.files[-1].name}'

    def _flush(self) -> str:
        self._topics.drain()
        self.thread.call(BagWriter.flush).result(PATIENCE)
        return f'{self.writer.message_count} messages are on the disk'

    # ---- what it says ----

    def _diagnose(self) -> None:
        """Publish how recording goes, and note losses in the bag, once a second."""
        self._note_losses()
        name = self.get_fully_qualified_name()
        if name in diagnostics.doubled(self.get_node_names_and_namespaces()):
            self._topics.warn_once(
                f'there is another node {name}; both go on, each with its own bag'
            )
        if self._waiting:
            self._topics.warn_once(
                f'no /clock has come: {len(self._waiting)} messages wait for the time'
            )
        shift = self._topics.clock.shift
        if shift:
            self._topics.warn_once(
                f'the wall clock was set by {shift * 1e-9:+.1f} s; log times go on without that'
            )
        tracks = self._topics.tracks.values()
        progress = diagnostics.Progress(
            paused=self._paused,
            topics=len(tracks),
            backlog=self.thread.backlog,
            lateness=max((track.lateness for track in tracks), default=0) * 1e-9,
            losses=self._losses(),
        )
        for track in tracks:
            track.lateness = 0
        status = diagnostics.diagnostic(name, self.writer, progress)
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _losses(self) -> dict[str, int]:
        return diagnostics.losses(self._topics.tracks.values())

    def _note_losses(self) -> None:
        losses = self._losses()
        if losses:
            self.thread.call(lambda writer: _note(writer, losses))
            for key, count in losses.items():
                self._topics.warn_once(f'{key}: {count} messages', about=key)


def _note(writer: BagWriter, losses: Mapping[str, int]) -> None:
    for key, count in losses.items():
        writer.custom(key, str(count))


def _answering(act: Callable[[], str]) -> Callable[[Any, Any], Any]:
    """Return the callback of a service that does something and says what."""

    def answer(_: Any, response: Any) -> Any:
        try:
            response.message = act()
            response.success = True
        except (BagError, TimeoutError) as error:
            response.message = str(error) or f'the disk did not answer within {PATIENCE:g} s'
        return response

    return answer


def main(args: Sequence[str] | None = None) -> int:
    """Record until Ctrl-C or SIGTERM.

    Returns:
        The exit code: 0, 1 if the disk refused, 2 for bad arguments or parameters.
    """
    on_signal(lambda *_: os._exit(0))  # nothing is open yet
    signals: list[int] = []
    try:
        init(list(sys.argv if args is None else args))
        on_signal(lambda number, _: signals.append(number))
        node = RecorderNode()
    except (DiscSimError, ParameterException, RuntimeError) as error:  # RuntimeError: of ROS
        sys.stderr.write(f'recorder_node: error: {plainly(error)}\n')
        try_shutdown()
        return 1 if isinstance(error, BagError) and not isinstance(error, ConfigError) else 2
    gc.collect()
    gc.freeze()  # a full collection would stall for tens of milliseconds
    node.start()
    try:
        serve(node, lambda: not signals and node.is_working)
    finally:
        code = _finish(node)
        node.destroy_node()
        try_shutdown()
    return code


def _finish(node: RecorderNode) -> int:
    try:
        sys.stderr.write(f'recorder_node: {node.stop()}\n')
    except DiscSimError as error:
        sys.stderr.write(f'recorder_node: error: {error}\n')
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
