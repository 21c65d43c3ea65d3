# ruff: noqa: N806 - the paper's letters
"""The equations of `kernels.equations` in plain numpy, over arrays of flights: a baseline.

The exact model with table aerodynamics and moments in body axes, in still air, classic RK4: the
usual first program. Every operation makes an array, and all flights make the same steps.
"""

from typing import TYPE_CHECKING

import numpy as np

from disc_sim_ros.physics.kernels.rotation import rotation_elements

if TYPE_CHECKING:
    from disc_sim_ros.arrays import FloatArray
    from disc_sim_ros.physics.flight import Setup


def fly(states: 'FloatArray', setup: 'Setup') -> 'FloatArray':
    """Fly to the ground.

    Args:
        states: States at release, as `kernels.equations.State`, shape (14, n).
        setup: Disc, air and step.

    Returns:
        X, Y where Z = 0 [m], shape (2, n).
    """
    h = setup.step
    landings = np.full((2, states.shape[1]), np.nan)
    flying = np.arange(states.shape[1])
    while flying.size:
        k1 = derivative(states, setup)
        k2 = derivative(states + h / 2 * k1, setup)
        k3 = derivative(states + h / 2 * k2, setup)
        k4 = derivative(states + h * k3, setup)
        ends = states + h / 6 * (k1 + 2 * (k2 + k3) + k4)
        ends[6:10] /= np.sqrt(np.sum(ends[6:10] ** 2, axis=0))
        down = ends[2] > 0.0
        if down.any():
            landings[:, flying[down]] = touchdown(states[:, down], ends[:, down], h)
            flying, ends = flying[~down], ends[:, ~down]
        states = ends
    return landings


def touchdown(s: 'FloatArray', end: 'FloatArray', h: float) -> 'FloatArray':
    """Return X, Y where the cubic through both ends of a step has Z = 0."""

    def cubic(i: int, f: 'FloatArray') -> 'FloatArray':
        rise, a, b = end[i] - s[i], h * s[i + 3], h * end[i + 3]
        return s[i] + f * (a + f * (3 * rise - 2 * a - b + f * (a + b - 2 * rise)))

    low, high = np.zeros(s.shape[1]), np.ones(s.shape[1])
    for _ in range(40):
        f = (low + high) / 2
        below = cubic(2, f) > 0.0
        low, high = np.where(below, low, f), np.where(below, f, high)
    return np.array([cubic(0, high), cubic(1, high)])


def derivative(s: 'FloatArray', setup: 'Setup') -> 'FloatArray':
    """Return the rate of change of the states, shape (14, n)."""
    d, rho = setup.disc, setup.air.density
    _, _, _, VX, VY, VZ, e0, e1, e2, e3, p, q, r, _ = s
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation_elements(e0, e1, e2, e3)
    u, v, w = xx * VX + yx * VY + zx * VZ, xy * VX + yy * VY + zy * VZ, xz * VX + yz * VY + zz * VZ
    u3 = np.hypot(u, v)
    V = np.hypot(u3, w)
    alpha = np.arctan2(w, u3)
    CL, CD, CM = (np.interp(alpha, d.table_rows[:, 0], d.table_rows[:, i]) for i in (1, 2, 3))
    d_x, d_y = u / u3, v / u3
    qS_V = rho / 2 * V * d.area
    X = qS_V * (-CD * u + CL * w * d_x)
    Y = qS_V * (-CD * v + CL * w * d_y)
    Z = qS_V * (-CD * w - CL * u3)
    M3 = qS_V * V * d.diameter * CM
    damping = qS_V / 2 * d.diameter**2
    p3, q3 = d_x * p + d_y * q, d_x * q - d_y * p
    L_p, M_q = damping * d.C_Lp * p3, damping * d.C_Mq * q3 + M3
    I_x, I_z = d.inertia_diametral, d.inertia_axial
    return np.array(
        [
            VX,
            VY,
            VZ,
            (xx * X + xy * Y + xz * Z) / d.mass,
            (yx * X + yy * Y + yz * Z) / d.mass,
            (zx * X + zy * Y + zz * Z) / d.mass + setup.air.gravity,
            -(e1 * p + e2 * q) / 2,
            (e0 * p - e3 * q) / 2,
            (e0 * q + e3 * p) / 2,
            (e1 * q - e2 * p) / 2,
            (d_x * L_p - d_y * M_q - q * r * I_z) / I_x,
            (d_y * L_p + d_x * M_q + p * r * I_z) / I_x,
            damping * d.C_Nr * r / I_z,
            r,
        ]
    )
