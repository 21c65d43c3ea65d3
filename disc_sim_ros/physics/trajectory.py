"""What the paper plots: of one state, and of a sampled flight."""

from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics import frames, theory
from disc_sim_ros.physics.kernels.equations import State, Velocity, angle_of_flow
from disc_sim_ros.physics.kernels.jit import inline
from disc_sim_ros.physics.kernels.rotation import rotation_elements

COLUMNS = 1 + len(State._fields) + 3  # t, the state, the wind
_NO_AIRSPEED = 1e-9  # m/s


class Quantities(NamedTuple):
    """What the paper plots of one state; all finite."""

    airspeed: float  # m/s
    angle_of_attack: float  # rad, air on the underside positive
    absolute_attitude: float  # rad, between the disc's axis and the vertical
    advance_ratio: float  # rim speed to airspeed, with the sign of the spin
    spin_rate: float  # rad/s, the paper's r: clockwise from above positive


@inline
def quantities(s: State, wind: Velocity, diameter: float) -> Quantities:
    """Return what the paper plots (eqns 17, 50 and 63) of one state.

    `Trajectory` has the same quantities as arrays; this is scalar Python, because the node calls
    it at up to 10 kHz.

    Args:
        s: State.
        wind: Wind at the disc, where the air moves to, earth axes 1 [m/s].
        diameter: The paper's c [m].

    Returns:
        The quantities. A disc without airspeed has angle of attack and advance ratio 0, because
        messages carry finite numbers.
    """
    _, _, _, VX, VY, VZ, e0, e1, e2, e3, _, _, r, _ = s
    V_X, V_Y, V_Z = VX - wind.X, VY - wind.Y, VZ - wind.Z
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation_elements(e0, e1, e2, e3)
    u = xx * V_X + yx * V_Y + zx * V_Z
    v = xy * V_X + yy * V_Y + zy * V_Z
    w = xz * V_X + yz * V_Y + zz * V_Z
    u3 = math.sqrt(u * u + v * v)  # as in `equations.flow`
    V = math.sqrt(u3 * u3 + w * w)
    flies = V > _NO_AIRSPEED
    return Quantities(
        V,
        angle_of_flow(w, u3) if flies else 0.0,
        math.atan2(math.sqrt(xz * xz + yz * yz), zz),
        0.5 * r * diameter / V if flies else 0.0,
        r,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Samples of one flight, in the paper's axes; n is the number of samples.

    Attributes:
        rows: Columns t, the fields of `State`, wind X, Y, Z; shape (n, 18).
        diameter: The paper's c [m].
    """

    rows: FloatArray
    diameter: float

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def t(self) -> FloatArray:
        """Time since release [s], shape (n,)."""
        return self.rows[:, 0]

    @property
    def position(self) -> FloatArray:
        """Position of the centre in earth axes 1 [m], shape (n, 3)."""
        return self.rows[:, 1:4]

    @property
    def velocity(self) -> FloatArray:
        """Velocity over the ground in earth axes 1 [m/s], shape (n, 3)."""
        return self.rows[:, 4:7]

    @property
    def attitude(self) -> FloatArray:
        """Quaternion of the despun axes 2 in axes 1, scalar first, shape (n, 4)."""
        return self.rows[:, 7:11]

    @property
    def rates(self) -> FloatArray:
        """Angular velocity p, q, r in despun axes 2 [rad/s], shape (n, 3)."""
        return self.rows[:, 11:14]

    @property
    def spin(self) -> FloatArray:
        """Spin rate r, clockwise from above positive [rad/s], shape (n,)."""
        return self.rows[:, 13]

    @property
    def spin_angle(self) -> FloatArray:
        """Angle from the despun axes 2 to the disc [rad], shape (n,)."""
        return self.rows[:, 14]

    @property
    def wind(self) -> FloatArray:
        """Wind at the disc, where the air moves to, earth axes 1 [m/s], shape (n, 3)."""
        return self.rows[:, 15:18]

    @property
    def air_velocity(self) -> FloatArray:
        """Velocity relative to the air, u, v, w in despun axes 2 [m/s], shape (n, 3)."""
        to_earth = frames.rotation_matrix(self.attitude)
        uvw: FloatArray = np.einsum('nji,nj->ni', to_earth, self.velocity - self.wind)
        return uvw

    @property
    def airspeed(self) -> FloatArray:
        """Speed relative to the air, V [m/s], shape (n,)."""
        V: FloatArray = np.linalg.norm(self.velocity - self.wind, axis=1)
        return V

    @property
    def alpha(self) -> FloatArray:
        """Angle of attack [rad], -pi/2 to pi/2, shape (n,) (eqn 17)."""
        u, v, w = self.air_velocity.T
        alpha: FloatArray = theory.angle_of_attack(u, v, w)
        return alpha

    @property
    def normal(self) -> FloatArray:
        """Unit vector of the disc's z axis, out of the underside, earth axes 1, shape (n, 3)."""
        return frames.rotation_matrix(self.attitude)[:, :, 2]

    @property
    def absolute_attitude(self) -> FloatArray:
        """Angle lambda between the disc's z axis and gravity [rad], shape (n,) (eqn 50)."""
        x, y, z = self.normal.T
        angle: FloatArray = np.arctan2(np.hypot(x, y), z)
        return angle

    @property
    def euler(self) -> FloatArray:
        """Roll phi, pitch theta and yaw psi of the despun axes 2 [rad], shape (n, 3).

        These are the angles that the paper's Fig. 5 plots: axes that took part in the spin would
        give angles that go round with it.
        """
        return frames.euler_from_quaternion(self.attitude)

    @property
    def advance_ratio(self) -> FloatArray:
        """Ratio AdvR = r c / (2 V) of rim speed to airspeed, shape (n,) (eqn 63).

        Infinite where there is no airspeed, and not a number where there is no spin either.
        """
        with np.errstate(divide='ignore', invalid='ignore'):
            return theory.advance_ratio(self.spin, self.diameter, self.airspeed)
