"""Names of topics, frames and flight events: the only place where they are written.

Names of topics are relative, so that namespaces and remapping work, except for those that ROS has
fixed.
"""

from dataclasses import dataclass
from enum import StrEnum
import re
from types import MappingProxyType
from typing import ClassVar

from disc_sim_ros.errors import ConfigError

# Published by the simulator, with STATE_QOS unless a comment names another profile.
ODOM = 'odom'
POSE = 'pose'
TRANSFORM = 'transform'
JOINT_STATES = 'joint_states'
IMU = 'imu'
AIRSPEED = 'airspeed'
ANGLE_OF_ATTACK = 'angle_of_attack'
ABSOLUTE_ATTITUDE = 'absolute_attitude'
ADVANCE_RATIO = 'advance_ratio'
SPIN_RATE = 'spin_rate'
AERO_WRENCH = 'aero_wrench'
PATH = 'path'
MARKERS = 'markers'  # LATCHED_QOS
FIELD_MARKERS = 'field_markers'  # LATCHED_QOS
FLIGHT_EVENTS = 'flight_events'  # LATCHED_QOS
CONFIGURATION = 'configuration'  # LATCHED_QOS
RELEASE = 'release'  # LATCHED_QOS
APPLIED_MOMENT = 'applied_moment'
APPLIED_COEFFICIENTS = 'applied_coefficients'
APPLIED_WIND = 'applied_wind'
CLOCK = '/clock'  # CLOCK_QOS
DIAGNOSTICS = '/diagnostics'
TF = '/tf'

# Taken by the simulator, with COMMAND_QOS.
CMD_MOMENT = 'cmd_moment'
CMD_COEFFICIENTS = 'cmd_coefficients'
THROW = 'throw'
WIND = 'wind'

SPIN_JOINT = 'spin'  # name of the joint in JOINT_STATES, from `disc` to `disc_body`


class FlightEvent(StrEnum):
    """What FLIGHT_EVENTS reports."""

    THROWN = 'thrown'
    LANDED = 'landed'
    RESET = 'reset'
    FAILED = 'failed'  # the disc moves faster than the step can follow
    COMMAND_EXPIRED = 'command expired'
    TIME_JUMPED = 'time jumped'  # simulated time has jumped forward to the wall clock


def event_title(node: str, event: str) -> str:
    """Return the name of the message of an event, from the names of the node and of the event."""
    return f'{node}: {event}'


def event_of(title: str) -> str:
    """Return the name of an event from the name of its message."""
    return title.rpartition(': ')[2]


class Loss(StrEnum):
    """Kinds of losses that recorder_node writes to `custom_data` of a bag, before the topic."""

    DROPPED = 'dropped'
    LOST = 'lost'
    GAPS = 'gaps'
    ENDED = 'publishers ended around a stall'  # what they sent last may be lost, uncounted
    STALL = 'stood still'  # without a topic: how long the recorder did not run
    NOT_RECORDED = 'not recorded'


class PredictorTopic:
    """Topics of predictor_node."""

    # Taken, with MEASUREMENT_QOS.
    MEASURED_POINT = 'measured_point'
    MEASURED_POSE = 'measured_pose'
    MEASURED_POSE_WITH_COVARIANCE = 'measured_pose_with_covariance'
    # Published, with STATE_QOS.
    LANDING = 'predicted_landing'
    PATH = 'predicted_path'
    ESTIMATE = 'estimate'
    ELLIPSE = 'landing_ellipse'
    INTERCEPT = 'intercept'
    WIND = 'estimated_wind'
    DISC_WEIGHTS = 'disc_weights'


class NodeTopic:
    """Topics that rclpy gives every node."""

    ROSOUT = '/rosout'
    PARAMETER_EVENTS = '/parameter_events'


class MessageType:
    """Types of messages by name, as graphs and bags have them."""

    ODOMETRY = 'nav_msgs/msg/Odometry'
    POSE = 'geometry_msgs/msg/PoseStamped'
    IMU = 'sensor_msgs/msg/Imu'
    STRING = 'std_msgs/msg/String'
    DIAGNOSTIC_STATUS = 'diagnostic_msgs/msg/DiagnosticStatus'
    WRENCH = 'geometry_msgs/msg/WrenchStamped'
    VECTOR = 'geometry_msgs/msg/Vector3Stamped'
    PARAMETER_EVENT = 'rcl_interfaces/msg/ParameterEvent'


# Inputs that act on a flight, each from its stamp on; a re-simulation needs all of them.
APPLIED = (APPLIED_MOMENT, APPLIED_COEFFICIENTS, APPLIED_WIND)

# The topics of sim_node that describe a flight beside its motion, and their types.
FLIGHT_TOPICS = MappingProxyType(
    {
        CONFIGURATION: MessageType.STRING,
        RELEASE: MessageType.ODOMETRY,
        FLIGHT_EVENTS: MessageType.DIAGNOSTIC_STATUS,
        APPLIED_MOMENT: MessageType.WRENCH,
        APPLIED_COEFFICIENTS: MessageType.VECTOR,
        APPLIED_WIND: MessageType.VECTOR,
    }
)

# Parameters of sim_node that change a flight without a stamp of their own.
WIND_PROFILE = ('wind.roughness_length', 'wind.reference_height')


@dataclass(frozen=True, slots=True)
class Frames:
    """Names of the frames.

    All discs fly over the same ground: a prefix names a disc, and `map` never takes it.

    Attributes:
        map: The ground, x forward (the launch yaw 0), y left, z up.
        disc: At the centre of the disc, tilts with it, does not spin; x forward, y left, z up.
        disc_body: Fixed in the plastic: `disc` turned about z by the spin.
        disc_air: As `disc`, x along the velocity through the air in the plane of the disc.
        PREFIX: The prefixes that tf2 and viewers accept.
        PREFIX_RULE: The same in words, a part of a sentence.
    """

    PREFIX: ClassVar[re.Pattern[str]] = re.compile(r'([A-Za-z]\w*/)*([A-Za-z]\w*)?', re.ASCII)
    PREFIX_RULE: ClassVar[str] = (
        'names of letters, digits and _ after a letter, joined by /, such as red/ or red_'
    )

    map: str = 'map'
    disc: str = 'disc'
    disc_body: str = 'disc_body'
    disc_air: str = 'disc_air'

    @classmethod
    def prefixed(cls, frame_prefix: str) -> 'Frames':
        """Return the names with a prefix, which brings its own separator, such as 'red/'.

        Raises:
            ConfigError: tf2 or viewers do not accept the prefix.
        """
        if not cls.PREFIX.fullmatch(frame_prefix):
            raise ConfigError('frame_prefix', frame_prefix, f'give {cls.PREFIX_RULE}')
        return cls._with(frame_prefix)

    @classmethod
    def of_disc(cls, disc: str) -> 'Frames':
        """Return the names that go with a recorded name of the frame `disc`, unchecked."""
        return cls._with(disc.removesuffix(cls().disc))

    @classmethod
    def _with(cls, prefix: str) -> 'Frames':
        plain = cls()
        return cls(
            disc=prefix + plain.disc,
            disc_body=prefix + plain.disc_body,
            disc_air=prefix + plain.disc_air,
        )
