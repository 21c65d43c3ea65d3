"""The topics of the graph: discovered, subscribed to, and kept up to date in the bag."""

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from disc_sim_ros import topics
from disc_sim_ros.bags import transforms
from disc_sim_ros.ros.recorder.delivery import Delivery
from disc_sim_ros.ros.recorder.extra_nodes import ExtraNodes
from disc_sim_ros.ros.recorder.options import Selection
from disc_sim_ros.ros.recorder.qos import adapt_request_to_offers, bag_topic
from disc_sim_ros.ros.recorder.topic_recorder import TopicRecorder
from disc_sim_ros.ros.recorder.writer_thread import BagTopic, WriterThread


class TopicDiscovery:
    """Records the selected topics of the graph.

    Attributes:
        recorders: The recorded topics by name and type; only `update` changes it.
        refused: Why a type of a topic is not recorded.
    """

    def __init__(
        self, node: Node, selection: Selection, thread: WriterThread, delivery: Delivery
    ) -> None:
        """Prepare; `update` discovers topics.

        Args:
            node: The node that subscribes.
            selection: Which topics to record.
            thread: The thread that writes the bag.
            delivery: What becomes of the messages; its lock is held meanwhile.
        """
        self.recorders: dict[tuple[str, str], TopicRecorder] = {}
        self._node = node
        self._extra_nodes = ExtraNodes(node)
        self._log = node.get_logger()
        self._selection = selection
        self._thread = thread
        self._delivery = delivery
        self._tf: BagTopic | None = None
        self._graph: list[tuple[str, list[str]]] = []
        self._warned: set[str] = set()
        self.refused: dict[tuple[str, str], str] = {}

    def update(self) -> None:
        """Subscribe to topics that are new, and follow changes of the others."""
        with self._delivery.lock:
            graph = self._node.get_topic_names_and_types()
            new: list[str] = []
            if graph != self._graph:
                settled = [self._consider(name, types, new) for name, types in graph]
                self._graph = graph if all(settled) else []  # otherwise consider all again
            if new:
                self._log.info(f'recording {", ".join(new)}')
            for recorder in self.recorders.values():
                recorder.update()
                if recorder.is_outdated(self._node.count_publishers(recorder.name)):
                    self._follow(recorder)

    def take(self) -> bool:
        """Take messages that have arrived; return True if more wait."""
        with self._delivery.lock:
            more = False
            for recorder in self.recorders.values():
                more = recorder.take() or more
            return more

    def drain(self) -> None:
        """Take all messages that have arrived."""
        with self._delivery.lock:
            for recorder in self.recorders.values():
                recorder.drain()

    def close(self) -> None:
        """Unsubscribe from all topics."""
        with self._delivery.lock:
            for recorder in self.recorders.values():
                recorder.close()
            self._extra_nodes.close()

    def warn_once(self, text: str, about: str = '') -> None:
        """Log a warning, once for each `about`."""
        if (about or text) not in self._warned:
            self._warned.add(about or text)
            self._log.warning(text)

    def _consider(self, name: str, types: list[str], new: list[str]) -> bool:
        """Record a topic if it is selected; return False to consider it again later."""
        known = self.recorders.keys() | self.refused.keys()
        missing = [kind for kind in types if (name, kind) not in known]
        if not missing or not self._selection.takes(name):
            return True
        publishers = self._node.get_publishers_info_by_topic(name)
        others = [p for p in publishers if not self._is_own(p)]
        if not others and (self._selection.everything or not publishers):
            return False
        published = list(dict.fromkeys(p.topic_type for p in others or publishers))
        new += [
            self.recorders[name, kind].label
            for kind in published
            if kind in missing and self._record(name, kind, publishers)
        ]
        return all(kind in published for kind in missing)

    def _record(self, name: str, type_name: str, publishers: list[TopicEndpointInfo]) -> bool:
        """Begin to record a type of a topic; return False if that is impossible."""
        before = [known for known, _ in self.recorders].count(name)
        publishers = [p for p in publishers if p.topic_type == type_name]
        try:
            recorder = self._subscribed(before, name, type_name, publishers)
        except ImportError as error:
            self._refuse(name, type_name, f'no type {type_name} here ({error})')
            return False
        except RuntimeError:  # rclpy's, whose text is about parts of ROS
            self._refuse(name, type_name, f'ROS refuses to subscribe to it as {type_name}')
            return False
        if before:
            recorder.label, recorder.is_late = f'{name} ({type_name})', True
            text = f'{name} has another type, {type_name}: it is recorded as a channel of its own'
            self.warn_once(text, about=recorder.label)
        description = bag_topic(name, type_name, publishers)
        if description.definition is None:
            self.warn_once(f'{name}: no definition of {type_name} here, so that few can read it')
        self._thread.add_topic(recorder.topic, description)
        recorder.set_described(self._node.count_publishers(name))
        self.recorders[name, type_name] = recorder
        self._make_tf(recorder)
        return True

    def _subscribed(
        self, before: int, name: str, type_name: str, publishers: list[TopicEndpointInfo]
    ) -> TopicRecorder:
        """Return the recorder of a type of a topic, of which `before` types are recorded.

        Where a publisher of this node has another type, a further node takes the topic.
        """
        for number in (before, before + 1):
            recorder = TopicRecorder(
                self._extra_nodes.of(number),
                name,
                type_name,
                self._delivery.deliver,
                clock=self._delivery.clock,
                stalls=self._delivery.stalls,
            )
            try:
                self._subscribe(recorder, publishers)
            except RuntimeError:
                if number > before:
                    raise
            else:
                break
        return recorder

    def _make_tf(self, recorder: TopicRecorder) -> None:
        """Let `/tf` be made from the transforms of a simulator if no tf2_msgs is installed."""
        is_transform = recorder.name.rpartition('/')[2] == topics.TRANSFORM
        if not (is_transform and recorder.type_name == transforms.TRANSFORM):
            return
        if not transforms.is_needed() or not self._selection.takes(topics.TF):
            return
        if self._tf is None:
            self._tf = BagTopic()
            self._thread.add_topic(self._tf, transforms.tf_topic())
        recorder.tf_topic = self._tf
        made_from = [r.name for r in self.recorders.values() if r.tf_topic is not None]
        self._thread.call(lambda writer: writer.custom(*transforms.note(made_from)))

    def _refuse(self, name: str, type_name: str, why: str) -> None:
        """Leave out a type of a topic, and let the bag and the last line say so."""
        self.refused[name, type_name] = why
        self._log.warning(f'{name} is not recorded: {why}')
        key = f'{topics.Loss.NOT_RECORDED} {name}'
        self._thread.call(lambda writer: writer.custom(key, why))

    def _is_own(self, publisher: TopicEndpointInfo) -> bool:
        own = self._node.get_name(), self._node.get_namespace()
        return (publisher.node_name, publisher.node_namespace) == own

    def _subscribe(self, recorder: TopicRecorder, publishers: list[TopicEndpointInfo]) -> None:
        offers = [p.qos_profile for p in publishers if p.topic_type == recorder.type_name]
        repeats = any(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
        recorder.subscribe(adapt_request_to_offers(offers), repeats=repeats)

    def _follow(self, recorder: TopicRecorder) -> None:
        """Describe the present publishers in the bag, and request what all of them offer."""
        publishers = self._node.get_publishers_info_by_topic(recorder.name)
        recorder.set_described(len(publishers))
        publishers = [p for p in publishers if p.topic_type == recorder.type_name]
        if not publishers:
            return
        description = bag_topic(recorder.name, recorder.type_name, publishers)
        self._thread.update_topic(recorder.topic, description)
        self._subscribe(recorder, publishers)
