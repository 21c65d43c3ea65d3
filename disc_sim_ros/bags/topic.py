"""What a bag says of a topic."""

from dataclasses import dataclass

from disc_sim_ros.bags.qos import Qos


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """A topic with all that is needed to read and to play back its messages."""

    name: str  # '/odom'
    type: str  # 'nav_msgs/msg/Odometry'
    definition: str = ''  # of the type and all it holds; '' when it was not found
    type_hash: str = ''  # 'RIHS01_...'
    qos: tuple[Qos, ...] = ()  # offered, one profile a publisher
    serialization_format: str = 'cdr'
    definition_encoding: str = 'ros2msg'  # or 'ros2idl', in bags of others
    extra: tuple[tuple[str, str], ...] = ()  # further channel metadata, in bags of others
