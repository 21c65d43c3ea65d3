"""A second integration of a flight, with another formulation and another integrator.

It uses no quaternion, no axes of the disc, no RK4 and nothing of `physics.kernels`: the velocity,
the normal of the disc and its transverse angular velocity are vectors in earth axes, and scipy's
DOP853 integrates them. Only the constants of the disc are shared. Source: paper, eqns 10, 11 and
15 to 33, with the corrections of docs/deviations.md; moments in axes 3.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.flight import Flight

TOLERANCE = 1e-8  # of DOP853, relative and absolute
LONGEST_STEP = 0.02  # s; limits the error at the corners of the table


def largest_distance(flight: Flight) -> float:
    """Return the largest distance between a flight and its second integration [m].

    Args:
        flight: A sampled flight in the exact or the constant-spin model, with moments in axes 3
            and without wind.

    Raises:
        ValueError: This integration does not cover the model, the axes or the wind.
    """
    setup = flight.setup
    covered = setup.model in {'exact', 'constant_spin'} and setup.moment_axes == 'body'
    if not covered or setup.wind.turbulence or any(setup.wind.mean):
        raise ValueError(
            'the second integration covers exact and constant_spin, axes 3, still air'
        )
    t = flight.trajectory
    solution = solve_ivp(
        lambda _, y: _rates(y, flight),
        (0.0, float(t.t[-1])),
        _release(flight),
        method='DOP853',
        t_eval=np.minimum(t.t, t.t[-1]),
        rtol=TOLERANCE,
        atol=TOLERANCE,
        max_step=LONGEST_STEP,
    )
    return float(np.linalg.norm(solution.y[:3].T - t.position, axis=1).max())


def _release(flight: Flight) -> FloatArray:
    """Return X, V, n, omega (transverse) in earth axes, and r, from the angles of the launch."""
    launch = flight.launch
    roll, pitch, yaw, alpha, beta = np.radians(
        (launch.roll, launch.pitch, launch.yaw, launch.angle_of_attack, launch.sideslip)
    )
    nose = np.array([math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw),
                     -math.sin(pitch)])  # fmt: skip
    level = np.array([-math.sin(yaw), math.cos(yaw), 0.0])  # to the right, before the roll
    right = math.cos(roll) * level + math.sin(roll) * _cross(nose, level)
    normal = _cross(nose, right)
    flow = math.cos(beta) * nose + math.sin(beta) * right
    velocity = launch.speed * (math.cos(alpha) * flow + math.sin(alpha) * normal)
    omega = launch.roll_rate * nose + launch.pitch_rate * right
    return np.concatenate(([0.0, 0.0, -launch.height], velocity, normal, omega, [launch.spin]))


def _rates(y: FloatArray, flight: Flight) -> FloatArray:
    """Return the rate of change of X, V, n, omega and r."""
    disc, air, control = flight.setup.disc, flight.setup.air, flight.control
    V, n, omega, r = y[3:6], y[6:9], y[9:12], y[12]
    speed = math.sqrt(V @ V)
    w = float(V @ n)
    in_plane = V - w * n
    u3 = math.sqrt(in_plane @ in_plane)
    ahead = in_plane / u3
    across = _cross(n, ahead)
    alpha = math.atan2(w, u3)
    lift, drag, moment = _steady(flight, alpha)
    qS = 0.5 * air.density * speed * speed * disc.area
    up = math.sin(alpha) * ahead - math.cos(alpha) * n
    force = qS * (lift * up - drag * V / speed)

    per_rate = disc.diameter / (2.0 * speed)
    C_L = disc.C_Lp * per_rate * (omega @ ahead) + control.C_L
    C_M = moment + disc.C_Mq * per_rate * (omega @ across) + control.C_M
    C_N = disc.C_Nr * per_rate * r + control.C_N
    qSc = qS * disc.diameter
    n_rate = _cross(omega, n)
    # d/dt (I_x omega + I_z r n) = M; omega stays perpendicular to n.
    torque = qSc * (C_L * ahead + C_M * across) - disc.inertia_axial * r * n_rate
    omega_rate = torque / disc.inertia_diametral - (omega @ n_rate) * n
    r_rate = qSc * C_N / disc.inertia_axial if flight.setup.model == 'exact' else 0.0
    fall = np.array([0.0, 0.0, air.gravity])
    return np.concatenate((V, force / disc.mass + fall, n_rate, omega_rate, [r_rate]))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross product; numpy's takes ten times as long for two vectors."""
    (a_x, a_y, a_z), (b_x, b_y, b_z) = a.tolist(), b.tolist()
    return np.array([a_y * b_z - a_z * b_y, a_z * b_x - a_x * b_z, a_x * b_y - a_y * b_x])


def _steady(flight: Flight, alpha: float) -> tuple[float, float, float]:
    """Return C_Lift, C_Drag and C_M."""
    disc = flight.setup.disc
    line, table = disc.linear, disc.table
    if (flight.setup.aero or disc.aero) == 'linear' and line is not None:
        drag = line.CD_0 + line.CD_alpha * (alpha - line.alpha_0) ** 2
        return line.CL_0 + line.CL_alpha * alpha, drag, line.CM_0 + line.CM_alpha * alpha
    if table is None:
        raise ValueError(f'disc {disc.name} has no table')
    degrees = math.degrees(alpha)
    i = min(int(np.searchsorted(table.alpha_deg, degrees, 'right')), len(table.alpha_deg) - 1)
    low, high = table.alpha_deg[i - 1], table.alpha_deg[i]
    part = (degrees - low) / (high - low)
    lift, drag, moment = (1.0 - part) * table.coefficients[i - 1] + part * table.coefficients[i]
    return float(lift), float(drag), float(moment)
