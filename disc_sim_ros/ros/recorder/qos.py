"""Quality of service: what publishers offer, what a recorder asks for, what its bag keeps."""

from collections.abc import Sequence

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.topic import INFINITE, Qos, Topic

DEPTH = 5_000  # messages that wait for the recorder; Fast DDS holds no more for a reader


def adapt_request_to_offers(offers: Sequence[QoSProfile]) -> QoSProfile:
    """Return what to ask for so that every publisher is heard, as well as can be.

    Reliable where all are, and messages of before where all keep some, as rosbag2 does: a request
    that one offer does not meet would leave that publisher out.
    """
    reliable = all(o.reliability == ReliabilityPolicy.RELIABLE for o in offers)
    latched = all(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def same(one: QoSProfile, other: QoSProfile) -> bool:
    """Say whether two requests are heard by the same publishers."""
    policies = (one.reliability, one.durability)
    return policies == (other.reliability, other.durability)


def topic_of(name: str, type_name: str, publishers: Sequence[TopicEndpointInfo]) -> Topic:
    """Return what the bag says of a topic with these publishers, as far as they have its type."""
    publishers = [p for p in publishers if p.topic_type == type_name]
    hashes = [str(p.topic_type_hash) for p in publishers]
    return Topic(
        name=name,
        type=type_name,
        definition=schemas.definition(type_name) or '',
        type_hash=hashes[0] if hashes else schemas.type_hash(type_name) or '',
        qos=tuple(kept(p.qos_profile) for p in publishers),
    )


def kept(offer: QoSProfile) -> Qos:
    """Return an offered profile as a bag keeps it."""
    return Qos(
        history=offer.history.name.lower(),
        depth=offer.depth,
        reliability=offer.reliability.name.lower(),
        durability=offer.durability.name.lower(),
        deadline=_nanoseconds(offer.deadline),
        lifespan=_nanoseconds(offer.lifespan),
        liveliness=offer.liveliness.name.lower(),
        liveliness_lease_duration=_nanoseconds(offer.liveliness_lease_duration),
        avoid_ros_namespace_conventions=offer.avoid_ros_namespace_conventions,
    )


def _nanoseconds(duration: Duration) -> int:
    return min(int(duration.nanoseconds), INFINITE)
