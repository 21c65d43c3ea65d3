"""What an ideal inertial measurement unit (IMU) on the disc reads; it has no bias and no noise.

The signs of `frames.flip_yz` are written out here, because a node calls `reading` at up to 10 kHz
and the calls cost a sixth of it; a test compares the two.
"""

import math

from disc_sim_ros.arrays import Vector
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.kernels.jit import inline
from disc_sim_ros.physics.kernels.rotation import rotation_elements

Reading = tuple[float, float, float, float, float, float]


@inline
def reading(
    s: State, acceleration: Vector, rates_change: Vector, offset: Vector, gravity: float
) -> Reading:
    """Return what an ideal IMU measures that is fixed in the plastic and aligned with it.

    Args:
        s: State.
        acceleration: dV/dt of the centre over the ground, earth axes 1 [m/s^2]; zeros at rest.
        rates_change: dp/dt, dq/dt, dr/dt in despun axes 2 [rad/s^2].
        offset: Position of the IMU from the centre of the disc, in `disc_body` [m].
        gravity: g [m/s^2].

    Returns:
        Angular velocity [rad/s] and specific force [m/s^2] in `disc_body`. The specific force is
        the acceleration minus gravity: +g along z when the disc lies level.
    """
    _, _, _, _, _, _, e0, e1, e2, e3, p, q, r, sigma = s
    p_dot, q_dot, r_dot = rates_change
    offset_x, offset_y, o_z = offset
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation_elements(e0, e1, e2, e3)
    f_X, f_Y, f_Z = acceleration
    f_Z -= gravity

    # From here on in `disc`, where z is up. Components in despun axes also change because these
    # axes turn at (p, q, 0): (p, q, 0) x (p, q, r) is (q r, -p r, 0).
    w_x, w_y, w_z = p, 0.0 - q, 0.0 - r
    a_x, a_y, a_z = p_dot + q * r, p * r - q_dot, 0.0 - r_dot
    c, si = math.cos(sigma), 0.0 - math.sin(sigma)  # of the angle of `disc_body` about z up
    o_x, o_y = c * offset_x - si * offset_y, si * offset_x + c * offset_y

    # f + a x o + w x (w x o)
    v_x, v_y, v_z = w_y * o_z - w_z * o_y, w_z * o_x - w_x * o_z, w_x * o_y - w_y * o_x
    f_x = xx * f_X + yx * f_Y + zx * f_Z + a_y * o_z - a_z * o_y + w_y * v_z - w_z * v_y
    f_y = a_z * o_x - a_x * o_z + w_z * v_x - w_x * v_z - (xy * f_X + yy * f_Y + zy * f_Z)
    f_z = a_x * o_y - a_y * o_x + w_x * v_y - w_y * v_x - (xz * f_X + yz * f_Y + zz * f_Z)
    return (
        c * w_x + si * w_y,
        c * w_y - si * w_x,
        w_z,
        c * f_x + si * f_y,
        c * f_y - si * f_x,
        f_z,
    )
