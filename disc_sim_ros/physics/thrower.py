"""A release in the words of disc golf: launch, nose and hyzer angle, and the kind of throw."""

from dataclasses import dataclass
from math import degrees, radians, tan

from disc_sim_ros.physics import frames
from disc_sim_ros.physics.disc import Disc
from disc_sim_ros.physics.environment import Air
from disc_sim_ros.physics.kernels.rotation import cos_sin_degrees
from disc_sim_ros.physics.launch import Launch

# Sense of the spin, seen from above: 1 clockwise. Right or left hand, backhand or forehand.
THROWS = {'rhbh': 1, 'rhfh': -1, 'lhbh': -1, 'lhfh': 1}

# International Standard Atmosphere, ISO 2533, below 11 km.
_P_0 = 101325.0  # Pa
_T_0 = 288.15  # K
_LAPSE = 0.0065  # K/m
_R = 287.05287  # J/(kg K), dry air
_EXPONENT = 9.80665 / (_R * _LAPSE)
_ZERO_CELSIUS = 273.15  # K


@dataclass(frozen=True, kw_only=True)
class Release:
    """A release as a thrower or a sensor in the disc gives it.

    Attributes:
        speed: Over the ground [m/s].
        spin: Clockwise from above positive [rad/s].
        launch_angle, nose, hyzer: As of `angles` [degrees].
        wobble: Angle between the axis of the disc and the axis about which it wobbles [degrees].
        heading: Of the velocity, right of +x [degrees].
    """

    speed: float
    spin: float
    launch_angle: float
    nose: float
    hyzer: float
    wobble: float = 0.0
    heading: float = 0.0

    def launch(self, disc: Disc, height: float) -> Launch:
        """Return the release as a launch.

        A free disc whose axis wobbles about its angular momentum by an angle has the transverse
        rate (I_z / I_x) r tan(angle). Its direction at the release is not measured: it is put
        into the roll rate.

        Args:
            disc: Gives the inertias.
            height: Of the release above the ground [m].
        """
        ratio = disc.inertia_axial / disc.inertia_diametral
        wobble = ratio * self.spin * tan(radians(self.wobble))
        turned = angles(
            self.launch_angle,
            self.nose,
            self.hyzer,
            yaw=self.heading,
            clockwise=self.spin >= 0.0,
        )
        return Launch(speed=self.speed, spin=self.spin, height=height, roll_rate=wobble, **turned)


def angles(
    launch_angle: float, nose: float, hyzer: float, *, yaw: float = 0.0, clockwise: bool = True
) -> dict[str, float]:
    """Return the angles of a `Launch` for a release in a thrower's words.

    The velocity climbs by the launch angle towards the heading. The disc is first flat to it, then
    rolled about it by the hyzer angle, then pitched about its own lateral axis by the nose angle.

    Args:
        launch_angle: Angle of the velocity above the horizontal [degrees].
        nose: Angle of the nose above the velocity [degrees].
        hyzer: Tilt towards the side to which the disc fades [degrees]: the left edge down for a
            disc that spins clockwise from above, the right edge down otherwise. Negative: anhyzer.
        yaw: Heading of the velocity, right of +x [degrees].
        clockwise: Sense of the spin, seen from above.

    Returns:
        The fields pitch, roll, yaw and angle_of_attack of `Launch` [degrees].
    """
    roll = -hyzer if clockwise else hyzer
    if roll == 0.0:  # to the bit
        return {'pitch': launch_angle + nose, 'roll': 0.0, 'yaw': yaw, 'angle_of_attack': nose}
    path = frames.quaternion_from_euler(roll, launch_angle, yaw)
    c, s = cos_sin_degrees(nose / 2)
    e0, e1, e2, e3 = path  # times (c, 0, s, 0), a turn about y
    disc = (c * e0 - s * e2, c * e1 - s * e3, c * e2 + s * e0, c * e3 + s * e1)
    phi, theta, psi = frames.euler_from_quaternion(disc)
    return {
        'pitch': degrees(theta),
        'roll': degrees(phi),
        'yaw': degrees(psi),
        'angle_of_attack': nose,
    }


def air_at(altitude: float, temperature: float | None = None, **more: float) -> Air:
    """Return the air at an altitude, by the International Standard Atmosphere.

    Args:
        altitude: Above the sea [m], below 11,000.
        temperature: Of the air there [degrees Celsius]; None for that of the standard atmosphere,
            15 at the sea and 6.5 less for each 1000 m.
        more: Other fields of `Air`.
    """
    standard = _T_0 - _LAPSE * altitude
    pressure = _P_0 * (standard / _T_0) ** _EXPONENT
    kelvin = standard if temperature is None else temperature + _ZERO_CELSIUS
    return Air(density=pressure / (_R * kelvin), **more)
