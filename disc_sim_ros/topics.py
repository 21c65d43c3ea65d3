"""Names of topics, qualities of service and frames: the only place where they are written.

Names are relative, so that namespaces and remapping work, except for those that ROS has fixed.
"""

from dataclasses import dataclass
import re
from typing import ClassVar

from disc_sim_ros.errors import ConfigError

# What the simulator publishes, with STATE_QOS where nothing else is said.
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
FLIGHT_EVENTS = 'flight_events'
CONFIGURATION = 'configuration'  # LATCHED_QOS
RELEASE = 'release'  # LATCHED_QOS
APPLIED_MOMENT = 'applied_moment'
APPLIED_COEFFICIENTS = 'applied_coefficients'
APPLIED_WIND = 'applied_wind'
CLOCK = '/clock'  # CLOCK_QOS
DIAGNOSTICS = '/diagnostics'
TF = '/tf'

# What it takes, with COMMAND_QOS.
CMD_MOMENT = 'cmd_moment'
CMD_COEFFICIENTS = 'cmd_coefficients'
THROW = 'throw'
WIND = 'wind'

SPIN_JOINT = 'spin'  # name of the joint in JOINT_STATES, from `disc` to `disc_body`


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
            ConfigError: A prefix that tf2 or a viewer would stumble over.
        """
        if not cls.PREFIX.fullmatch(frame_prefix):
            raise ConfigError('frame_prefix', frame_prefix, f'give {cls.PREFIX_RULE}')
        plain = cls()
        return cls(
            disc=frame_prefix + plain.disc,
            disc_body=frame_prefix + plain.disc_body,
            disc_air=frame_prefix + plain.disc_air,
        )
