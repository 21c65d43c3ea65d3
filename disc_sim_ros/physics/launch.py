"""How a disc is let go: the launch in a thrower's words, and the state that it means."""

from dataclasses import dataclass

from disc_sim_ros import validation
from disc_sim_ros.physics import frames
from disc_sim_ros.physics.kernels import rotation
from disc_sim_ros.physics.kernels.equations import State


@dataclass(frozen=True, kw_only=True, slots=True)
class Launch:
    """A release. Angles are the paper's, in degrees; the defaults are the throw of its Fig. 5.

    The velocity lies in the disc's x-z plane, `angle_of_attack` below its x axis, turned right by
    `sideslip`; it is over the ground, so that wind comes on top. Rates are body rates at release.
    """

    speed: float = 15.0  # m/s
    pitch: float = 15.0  # degrees, nose up positive
    roll: float = 0.0  # degrees, right edge down positive
    yaw: float = 0.0  # degrees, right of +x positive
    angle_of_attack: float = 0.0  # degrees
    sideslip: float = 0.0  # degrees
    spin: float = 31.416  # rad/s, clockwise from above positive
    roll_rate: float = 0.0  # rad/s, p
    pitch_rate: float = 0.0  # rad/s, q
    height: float = 0.0  # m above the ground

    def __post_init__(self) -> None:
        for name, (lowest, highest, unit) in LIMITS.items():
            validation.number(name, getattr(self, name), lowest, highest, unit=unit)

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


LIMITS = {
    'speed': (0.0, 200.0, 'm/s'),
    'pitch': (-180.0, 180.0, 'degrees'),
    'roll': (-180.0, 180.0, 'degrees'),
    'yaw': (-360.0, 360.0, 'degrees'),
    'angle_of_attack': (-180.0, 180.0, 'degrees'),
    'sideslip': (-180.0, 180.0, 'degrees'),
    'spin': (-1000.0, 1000.0, 'rad/s'),
    'roll_rate': (-1000.0, 1000.0, 'rad/s'),
    'pitch_rate': (-1000.0, 1000.0, 'rad/s'),
    'height': (-1000.0, 10000.0, 'm'),
}
