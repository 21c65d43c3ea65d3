"""`recorder_node`: every topic into a bag, as the bytes that arrived."""

from collections.abc import Callable, Mapping, Sequence
import gc
import os
import shutil
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy._rclpy_pybind11 import RCLError
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import ok, try_shutdown
from std_srvs.srv import Trigger

from disc_sim_ros.bags.errors import BagError
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.core.errors import ConfigError, DiscSimError
from disc_sim_ros.nodes import offers, parameters, topics
from disc_sim_ros.nodes.bag_thread import BagThread
from disc_sim_ros.nodes.program import init, on_signal, plainly
from disc_sim_ros.nodes.recorder_config import RECORDER_TABLE, recorder_config
from disc_sim_ros.nodes.track import Track

DISCOVERY_PERIOD = 0.05  # s between two looks at the graph; each takes 6 us
DIAGNOSTIC_PERIOD = 1.0  # s
PATIENCE = 5.0  # s, for the disk to do what a service asks
LITTLE_ROOM = 1024**3  # bytes left on the disk that are worth a warning


class RecorderNode(Node):
    """Finds topics, subscribes, and hands the messages to the thread that writes the bag.

    Raises:
        ConfigError: Parameters that are misspelt or impossible, or a bag that exists.
        BagError: No bag can be written there.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Make the bag; recording begins when the node spins."""
        super().__init__('recorder_node', **kwargs)
        parameters.declare(self, RECORDER_TABLE)
        config = recorder_config(parameters.values(self, RECORDER_TABLE), self.get_namespace())
        self._selection = config.selection
        self._paused = config.start_paused
        self._sim_time: bool = self.get_parameter('use_sim_time').value
        self._tracks: dict[str, Track] = {}
        self._graph: list[tuple[str, list[str]]] = []
        self._warned: set[str] = set()
        self._waiting: list[tuple[Track, bytes, int]] = []  # for the first time, data, sent
        self._held: dict[str, tuple[Track, bytes, int]] = {}  # last latched, while paused
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
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DISCOVERY_PERIOD, self._look, clock=steady)
        self.create_timer(DIAGNOSTIC_PERIOD, self._diagnose, clock=steady)
        state = ', paused: ~/resume begins' if self._paused else ''
        self._logger.info(f'recording {config.selection} to {self.writer.folder}{state}')

    def start(self) -> None:
        """Start the thread that writes."""
        self.thread.start()

    def stop(self) -> str:
        """Write all that has arrived, close the bag and say what is in it.

        Raises:
            BagError: The disk refused; what was flushed is safe.
        """
        if self.thread.failure is None:
            for track in self._tracks.values():
                track.drain()
            self._release(0)
            self._note_losses()
        self.thread.end()
        self.thread.join()
        if self.thread.failure is not None:
            raise self.thread.failure
        return self._summary()

    # ---- topics ----

    def _look(self) -> None:
        """Subscribe to topics that are new, and follow changes of those that are not."""
        graph = self.get_topic_names_and_types()
        new: list[str] = []
        if graph != self._graph:
            settled = [self._find(name, types, new) for name, types in graph]
            self._graph = graph if all(settled) else []  # else look again
        if new:
            self._logger.info(f'recording {", ".join(new)}')
        for track in self._tracks.values():
            if track.stale:
                self._follow(track)
            track.tidy()
        if self._waiting and self._now():
            self._release(self._now())

    def _find(self, name: str, types: list[str], new: list[str]) -> bool:
        """Record a topic if it is to be; return whether that is settled."""
        if name in self._tracks:
            if len(types) > 1:
                used = self._tracks[name].type_name
                self._warn_once(
                    f'{name} has several types, {", ".join(types)}: recorded is {used}'
                )
            return True
        if name in self._warned or not self._selection.takes(name):
            return True
        publishers = self.get_publishers_info_by_topic(name)
        if not publishers:
            return False
        type_name = publishers[0].topic_type
        try:
            track = Track(self, name, type_name, self._deliver)
        except ImportError as error:
            self._warned.add(name)
            self._logger.warning(f'{name} is not recorded: no type {type_name} here ({error})')
            return True
        topic = offers.topic_of(name, type_name, publishers)
        if not topic.definition:
            self._warn_once(f'{name}: no definition of {type_name} here, so that few can read it')
        track.topic_id = self._number(topic)
        self._tracks[name] = track
        track.listen(offers.requested([p.qos_profile for p in publishers]))
        new.append(name)
        return True

    def _number(self, topic: Topic) -> int:
        """Return the id that a topic will have in the bag."""
        self.thread.call(lambda writer: writer.add(topic))
        return len(self._tracks) + 1

    def _follow(self, track: Track) -> None:
        """Tell the bag of the publishers of today, and hear them all."""
        track.stale = False
        publishers = self.get_publishers_info_by_topic(track.name)
        publishers = [p for p in publishers if p.topic_type == track.type_name]
        if not publishers:
            return
        topic = offers.topic_of(track.name, track.type_name, publishers)
        self.thread.call(lambda writer: writer.update(track.topic_id, topic))
        track.listen(offers.requested([p.qos_profile for p in publishers]))

    # ---- messages ----

    def _deliver(self, track: Track, data: bytes, received: int, sent: int) -> None:
        if self._paused:
            if track.latched:
                self._held[track.name] = (track, data, sent)
            return
        if self._sim_time:
            received = self._now()
            if received == 0:
                self._waiting.append((track, data, sent))
                return
            if self._waiting:
                self._release(received)
        if not self.thread.put(track.topic_id, data, received, sent or received):
            track.dropped += 1

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _release(self, now: int) -> None:
        """Record what waited for the first time of the simulation."""
        waiting, self._waiting = self._waiting, []
        for track, data, sent in waiting:
            if not self.thread.put(track.topic_id, data, now, sent or now):
                track.dropped += 1

    # ---- services ----

    def _pause(self) -> str:
        self._paused = True
        return 'paused: messages are not recorded'

    def _resume(self) -> str:
        """Go on, with the last message of each latched topic that came meanwhile."""
        self._paused = False
        held, self._held = self._held, {}
        for track, data, sent in held.values():
            self._deliver(track, data, time.time_ns(), sent)
        return 'recording'

    def _split(self) -> str:
        self.thread.call(BagWriter.split).result(PATIENCE)
        return f'recording to {self.writer.files[-1].name}'

    def _flush(self) -> str:
        self.thread.call(BagWriter.flush).result(PATIENCE)
        return f'{self.writer.message_count} messages are on the disk'

    # ---- what it says ----

    def _diagnose(self) -> None:
        """Publish how recording goes, and note losses in the bag, once a second."""
        self._note_losses()
        losses = self._losses()
        name = self.get_fully_qualified_name()
        if self.get_fully_qualified_name() in _doubled(self.get_node_names_and_namespaces()):
            self._warn_once(f'there is another node {name}; both go on, each with its own bag')
        free = _free(self.writer.folder)
        problems = [f'{what}: {count}' for what, count in losses.items()]
        if free < LITTLE_ROOM:
            problems.append(f'{free / 1e6:.0f} MB left on the disk')
        values: dict[str, object] = {
            'bag': self.writer.folder,
            'paused': self._paused,
            'topics': len(self._tracks),
            'messages': self.writer.message_count,
            'bytes': self.writer.bytes,
            'waiting_bytes': self.thread.backlog,
            'free_bytes': free,
            **losses,
        }
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if problems else DiagnosticStatus.OK,
            name=f'{name[1:]}: recording',
            message=', '.join(problems) or ('paused' if self._paused else 'recording'),
            hardware_id=str(self.writer.folder),
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _losses(self) -> dict[str, int]:
        found = {}
        for track in self._tracks.values():
            for what, count in (
                ('dropped', track.dropped),
                ('lost', track.lost),
                ('gaps', track.missed),
            ):
                if count:
                    found[f'{what} {track.name}'] = count
        return found

    def _note_losses(self) -> None:
        losses = self._losses()
        if losses:
            self.thread.call(lambda writer: _note(writer, losses))
            for key, count in losses.items():
                self._warn_once(f'{key}: {count} messages', about=key)

    def _summary(self) -> str:
        w = self.writer
        filled = sum(count > 0 for count in w.counts.values())
        losses = ', '.join(f'{key}: {count}' for key, count in self._losses().items())
        return (
            f'recorded {w.message_count} messages of {filled} topics, {w.bytes / 1e6:.1f} MB, '
            f'{losses or "nothing lost"}: {w.folder}'
        )

    def _warn_once(self, text: str, about: str = '') -> None:
        if (about or text) not in self._warned:
            self._warned.add(about or text)
            self._logger.warning(text)


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


def _doubled(nodes: Sequence[tuple[str, str]]) -> set[str]:
    """Return the full names that several nodes have."""
    names = [f'{namespace.rstrip("/")}/{name}' for name, namespace in nodes]
    return {name for name in names if names.count(name) > 1}


def _free(folder: Any) -> int:
    """Return the bytes free where a folder is; 0 where it is gone."""
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return 0


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
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    gc.collect()
    gc.freeze()  # a full collection would stall for tens of milliseconds
    node.start()
    try:
        while not signals and node.thread.is_alive():
            executor.spin_once(0.5)
    except RCLError:
        if ok():
            raise
    finally:
        code = _finish(node)
        executor.shutdown()
        node.destroy_node()
        try_shutdown()
    return code


def _finish(node: RecorderNode) -> int:
    try:
        sys.stderr.write(f'recorder_node: {node.stop()}\n')
    except BagError as error:
        sys.stderr.write(f'recorder_node: error: {error}\n')
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
