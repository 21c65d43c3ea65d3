"""The topics of the graph: found, subscribed to, followed; and the thread that takes messages."""

from collections.abc import Callable
import threading
import time

from rclpy._rclpy_pybind11 import RCLError
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.ros.internals import Polled
from disc_sim_ros.ros.recorder import qos
from disc_sim_ros.ros.recorder.clock import LogClock
from disc_sim_ros.ros.recorder.options import Selection
from disc_sim_ros.ros.recorder.topic_recorder import Deliver, TopicRecorder
from disc_sim_ros.ros.recorder.writer_thread import BagThread

TURN = 0.0005  # s for other threads where there is more to take than one round takes


class TopicDiscovery:
    """Records what is selected of the topics of the graph.

    Attributes:
        lock: Held while messages are delivered and while it changes who hears them.
        tracks: What is recorded, by name; changed by `look` alone.
        clock: By which messages arrive.
    """

    def __init__(
        self, node: Node, selection: Selection, thread: BagThread, deliver: Deliver
    ) -> None:
        """Find nothing yet; `look` does."""
        self.lock = threading.RLock()
        self.tracks: dict[str, TopicRecorder] = {}
        self.clock = LogClock()
        self._node = node
        self._log = node.get_logger()
        self._selection = selection
        self._thread = thread
        self._deliver = deliver
        self._group = Polled()
        self._graph: list[tuple[str, list[str]]] = []
        self._warned: set[str] = set()
        self._refused: set[str] = set()

    def look(self) -> None:
        """Subscribe to topics that are new, and follow changes of those that are not."""
        with self.lock:
            graph = self._node.get_topic_names_and_types()
            new: list[str] = []
            if graph != self._graph:
                settled = [self._find(name, types, new) for name, types in graph]
                self._graph = graph if all(settled) else []  # else look again
            if new:
                self._log.info(f'recording {", ".join(new)}')
            for track in self.tracks.values():
                track.tidy()
                if track.stale or self._node.count_publishers(track.name) != track.known:
                    self._follow(track)

    def take(self) -> bool:
        """Take messages that have come; say whether there are more."""
        with self.lock:
            more = False
            for track in self.tracks.values():
                more = track.take() or more
            return more

    def drain(self) -> None:
        """Take all messages that have come."""
        with self.lock:
            for track in self.tracks.values():
                track.drain()

    def close(self) -> None:
        """Hear no more."""
        with self.lock:
            for track in self.tracks.values():
                track.close()

    def warn_once(self, text: str, about: str = '') -> None:
        """Log a warning, once for what it is about."""
        if (about or text) not in self._warned:
            self._warned.add(about or text)
            self._log.warning(text)

    def _find(self, name: str, types: list[str], new: list[str]) -> bool:
        """Record a topic if it is to be; return whether that is settled."""
        if name in self.tracks:
            if len(types) > 1:
                used = self.tracks[name].type_name
                text = f'{name} has several types, {", ".join(types)}: recorded is {used}'
                self.warn_once(text, about=f'types of {name}')
            return True
        if name in self._refused or not self._selection.takes(name):
            return True
        publishers = self._node.get_publishers_info_by_topic(name)
        others = [p for p in publishers if not self._is_own(p)]
        if not others and (self._selection.everything or not publishers):
            return False
        if self._begin(name, (others or publishers)[0].topic_type, publishers):
            new.append(name)
        return len(types) == 1  # else look again, and warn

    def _begin(self, name: str, type_name: str, publishers: list[TopicEndpointInfo]) -> bool:
        """Subscribe to a topic; return whether that is possible."""
        try:
            track = TopicRecorder(
                self._node, name, type_name, self._group, self._deliver, clock=self.clock
            )
            self._listen(track, publishers)
        except ImportError as error:
            self._refuse(name, f'no type {type_name} here ({error})')
            return False
        except RCLError:  # its text is about ROS's own parts
            self._refuse(name, f'ROS refuses to subscribe to it as {type_name}')
            return False
        topic = qos.topic_of(name, type_name, publishers)
        if not topic.definition:
            self.warn_once(f'{name}: no definition of {type_name} here, so that few can read it')
        track.topic_id = self._number(topic)
        track.known = len(publishers)
        self.tracks[name] = track
        return True

    def _refuse(self, name: str, why: str) -> None:
        self._refused.add(name)
        self._log.warning(f'{name} is not recorded: {why}')

    def _is_own(self, publisher: TopicEndpointInfo) -> bool:
        own = self._node.get_name(), self._node.get_namespace()
        return (publisher.node_name, publisher.node_namespace) == own

    def _listen(self, track: TopicRecorder, publishers: list[TopicEndpointInfo]) -> None:
        profiles = [p.qos_profile for p in publishers if p.topic_type == track.type_name]
        latched = any(q.durability == DurabilityPolicy.TRANSIENT_LOCAL for q in profiles)
        track.listen(qos.adapt_request_to_offers(profiles), repeating=latched)

    def _number(self, topic: Topic) -> int:
        """Return the id that a topic will have in the bag."""
        self._thread.call(lambda writer: writer.add(topic))
        return len(self.tracks) + 1

    def _follow(self, track: TopicRecorder) -> None:
        """Tell the bag of the publishers of today, and hear them all."""
        track.stale = False
        publishers = self._node.get_publishers_info_by_topic(track.name)
        track.known = len(publishers)  # the graph may learn later than the subscription
        publishers = [p for p in publishers if p.topic_type == track.type_name]
        if not publishers:
            return
        topic = qos.topic_of(track.name, track.type_name, publishers)
        self._thread.call(lambda writer: writer.update(track.topic_id, topic))
        self._listen(track, publishers)


class TakingThread(threading.Thread):
    """Takes messages again and again.

    Attributes:
        failure: Why it has ended early; None as long as all is well.
    """

    def __init__(self, take: Callable[[], bool], period: float) -> None:
        """Call `take`, and rest for a period [s] where it says that there is no more."""
        super().__init__(name='listener')
        self.failure: DiscSimError | None = None
        self._take = take
        self._period = period
        self._ending = False

    def run(self) -> None:
        """Take until asked to end."""
        try:
            while not self._ending:
                time.sleep(TURN if self._take() else self._period)
        except Exception as error:  # whatever it is, the bag is closed and somebody told
            self.failure = DiscSimError(f'cannot listen ({type(error).__name__}: {error})')

    def end(self) -> None:
        """End, and wait for it."""
        self._ending = True
        if self.is_alive():
            self.join()
