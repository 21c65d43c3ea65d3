"""Placeholder."""

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy


def _reliable(depth: int, durability: DurabilityPolicy = DurabilityPolicy.VOLATILE) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
    )


STATE_QOS = _reliable(1000)  # a recorder that is late for 100 ms of 10 kHz loses nothing


LATCHED_QOS = _reliable(1, DurabilityPolicy.TRANSIENT_LOCAL)  # who comes later gets the last one


COMMAND_QOS = _reliable(100)


CLOCK_PERIOD = 0.005  # s of wall time; a node that follows it spends 14 % of a core at 250 Hz


CLOCK_QOS = _reliable(1)  # only the newest time counts; best-effort subscribers get it as well
