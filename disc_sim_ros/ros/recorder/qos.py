"""Quality of service of a recorded topic: what the recorder requests, what the bag describes."""

from collections.abc import Sequence

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.ros.qos import bag_qos

DEPTH = 5_000  # messages that wait for the recorder; Fast DDS holds no more for a reader


def adapt_request_to_offers(offers: Sequence[QoSProfile]) -> QoSProfile:
    """Return the strictest request that every offer meets, as rosbag2 adapts it.

    It is reliable if all offers are, and transient local if all are: an offer that is less than
    the request would leave its publisher out.
    """
    reliable = all(o.reliability == ReliabilityPolicy.RELIABLE for o in offers)
    latched = all(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def same_request(one: QoSProfile, other: QoSProfile) -> bool:
    """Return True if the same publishers meet two requests."""
    policies = (one.reliability, one.durability)
    return policies == (other.reliability, other.durability)


def bag_topic(name: str, type_name: str, publishers: Sequence[TopicEndpointInfo]) -> Topic:
    """Return a topic as the bag describes it, with the publishers that have its type."""
    publishers = [p for p in publishers if p.topic_type == type_name]
    hashes = [str(p.topic_type_hash) for p in publishers]
    return Topic(
        name=name,
        type=type_name,
        definition=schemas.definition(type_name),
        type_hash=hashes[0] if hashes else schemas.type_hash(type_name) or '',
        qos=tuple(bag_qos(p.qos_profile) for p in publishers),
    )
