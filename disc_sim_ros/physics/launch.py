"""The release of a disc in a thrower's terms, and the state that it means."""

from dataclasses import dataclass

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.kernels import rotation
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.quantities import LAUNCH


@dataclass(frozen=True, kw_only=True, slots=True)
class Launch:
    """A release; the defaults are the throw of the paper's Fig. 5.

    The velocity is over the ground, so that wind comes on top. It points `angle_of_attack` below
    the plane of the disc and `sideslip` right of its x axis. Rates are body rates at release.
    Ranges and defaults are in `quantities.LAUNCH`.

    Raises:
        ConfigError: A value is out of range.
    """

    speed: float = LAUNCH['speed'].default  # m/s
    pitch: float = LAUNCH['pitch'].default  # degrees, nose up positive
    roll: float = LAUNCH['roll'].default  # degrees, right edge down positive
    yaw: float = LAUNCH['yaw'].default  # degrees, right of +x positive
    angle_of_attack: float = LAUNCH['angle_of_attack'].default  # degrees
    sideslip: float = LAUNCH['sideslip'].default  # degrees
    spin: float = LAUNCH['spin'].default  # rad/s, clockwise from above positive
    roll_rate: float = LAUNCH['roll_rate'].default  # rad/s, p
    pitch_rate: float = LAUNCH['pitch_rate'].default  # rad/s, q
    height: float = LAUNCH['height'].default  # m above the ground

    def __post_init__(self) -> None:
        for name, quantity in LAUNCH.items():
            quantity.check(getattr(self, name))

    def state(self) -> State:
        """Return the state at release in despun axes, spin angle 0."""
        c_alpha, s_alpha = rotation.cos_sin_degrees(self.angle_of_attack)
        c_beta, s_beta = rotation.cos_sin_degrees(self.sideslip)
        uvw = (c_alpha * c_beta, c_alpha * s_beta, s_alpha)
        e = frames.quaternion_from_euler(self.roll, self.pitch, self.yaw)
        V_X, V_Y, V_Z = frames.earth_from_body(e, uvw)
        V = float(self.speed)
        return State(
            X=0.0,
            Y=0.0,
            Z=-float(self.height),
            VX=V * V_X,
            VY=V * V_Y,
            VZ=V * V_Z,
            e0=e[0],
            e1=e[1],
            e2=e[2],
            e3=e[3],
            p=float(self.roll_rate),
            q=float(self.pitch_rate),
            r=float(self.spin),
            sigma=0.0,
        )


ABOVE_GROUND = 'with ground, release at 0 m or above'


def require_above_ground(height: float) -> None:
    """Refuse a release below the ground, for flights that end there.

    Args:
        height: Height of the centre of the disc [m].

    Raises:
        ConfigError: The height is negative.
    """
    if height < 0.0:
        raise ConfigError('height', height, ABOVE_GROUND, 'height')
