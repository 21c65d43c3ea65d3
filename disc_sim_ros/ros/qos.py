"""Quality of service of the nodes' topics, and how a bag describes that of a publisher."""

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from disc_sim_ros.bags.topic import INFINITE, Qos


def _reliable(depth: int, durability: DurabilityPolicy = DurabilityPolicy.VOLATILE) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
    )


STATE_QOS = _reliable(2000)  # a recorder that is late for 0.2 s of 10 kHz loses nothing
LATCHED_QOS = _reliable(1, DurabilityPolicy.TRANSIENT_LOCAL)  # a late subscriber gets the last one
COMMAND_QOS = _reliable(100)
# Measurements, of reliable and of best-effort publishers.
MEASUREMENT_QOS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
# A page shows the newest message alone, and takes it from any publisher.
NEWEST_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
CLOCK_QOS = _reliable(1)  # only the newest time counts; best-effort subscribers get it as well
CLOCK_PERIOD = 0.005  # s of wall time; a node that follows it spends 14 % of a core at 250 Hz


def discovered_qos(profile: QoSProfile) -> Qos:
    """Return what other nodes discover of a publisher's QoS: DDS leaves out history and depth."""
    reliable = profile.reliability == ReliabilityPolicy.RELIABLE
    latched = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return Qos(
        history='unknown',
        depth=0,
        reliability='reliable' if reliable else 'best_effort',
        durability='transient_local' if latched else 'volatile',
    )


def bag_qos(profile: QoSProfile) -> Qos:
    """Return the QoS of a publisher in the graph as a bag describes it."""
    return Qos(
        history=profile.history.name.lower(),
        depth=profile.depth,
        reliability=profile.reliability.name.lower(),
        durability=profile.durability.name.lower(),
        deadline=_nanoseconds(profile.deadline),
        lifespan=_nanoseconds(profile.lifespan),
        liveliness=profile.liveliness.name.lower(),
        liveliness_lease_duration=_nanoseconds(profile.liveliness_lease_duration),
        avoid_ros_namespace_conventions=profile.avoid_ros_namespace_conventions,
    )


def _nanoseconds(duration: Duration) -> int:
    return min(int(duration.nanoseconds), INFINITE)
