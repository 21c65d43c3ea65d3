"""A second integration of a flight, with another formulation and another integrator.

It uses no quaternion, no axes of the disc, no RK4 and nothing of `physics.kernels`: the velocity,
the normal of the disc and its transverse angular velocity are vectors in earth axes, and scipy's
DOP853 integrates them. Only the constants of the disc are shared. Source: paper, eqns 10, 11 and
15 to 33, with the corrections of docs/deviations.md; moments in axes 3.
"""

import bisect
from collections.abc import Callable, Sequence
import math

import numpy as np

from disc_sim_ros.physics.flight import Flight

Vector = Sequence[float]
Steady = Callable[[float], tuple[float, float, float]]
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
    from scipy.integrate import solve_ivp  # noqa: PLC0415 - slow, and not every process needs it

    t = flight.trajectory
    steady = _steady(flight)
    solution = solve_ivp(
        lambda _, y: _rates(y.tolist(), flight, steady),
        (0.0, float(t.t[-1])),
        _release(flight),
        method='DOP853',
        t_eval=np.minimum(t.t, t.t[-1]),
        rtol=TOLERANCE,
        atol=TOLERANCE,
        max_step=LONGEST_STEP,
    )
    return float(np.linalg.norm(solution.y[:3].T - t.position, axis=1).max())


def _release(flight: Flight) -> list[float]:
    """Return X, V, n, omega (transverse) in earth axes, and r, from the angles of the launch."""
    launch = flight.launch
    roll, pitch, yaw, alpha, beta = np.radians(
        (launch.roll, launch.pitch, launch.yaw, launch.angle_of_attack, launch.sideslip)
    )
    nose = (math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), -math.sin(pitch))
    level = (-math.sin(yaw), math.cos(yaw), 0.0)  # to the right, before the roll
    right = _combined(math.cos(roll), level, math.sin(roll), _cross(nose, level))
    normal = _cross(nose, right)
    flow = _combined(math.cos(beta), nose, math.sin(beta), right)
    direction = _combined(math.cos(alpha), flow, math.sin(alpha), normal)
    velocity = [launch.speed * part for part in direction]
    omega = _combined(launch.roll_rate, nose, launch.pitch_rate, right)
    return [0.0, 0.0, -launch.height, *velocity, *normal, *omega, launch.spin]


def _rates(y: list[float], flight: Flight, steady: Steady) -> list[float]:
    """Return the rate of change of X, V, n, omega and r."""
    disc, air, control = flight.setup.disc, flight.setup.air, flight.control
    V, n, omega, r = y[3:6], y[6:9], y[9:12], y[12]
    speed = math.hypot(*V)
    w = _dot(V, n)
    in_plane = _combined(1.0, V, -w, n)
    u3 = math.hypot(*in_plane)
    ahead = [part / u3 for part in in_plane]
    across = _cross(n, ahead)
    alpha = math.atan2(w, u3)
    lift, drag, moment = steady(alpha)
    qS = 0.5 * air.density * speed * speed * disc.area
    up = _combined(math.sin(alpha), ahead, -math.cos(alpha), n)
    force = _combined(qS * lift, up, -qS * drag / speed, V)

    per_rate = disc.diameter / (2.0 * speed)
    C_L = disc.C_Lp * per_rate * _dot(omega, ahead) + control.C_L
    C_M = moment + disc.C_Mq * per_rate * _dot(omega, across) + control.C_M
    C_N = disc.C_Nr * per_rate * r + control.C_N
    qSc = qS * disc.diameter
    n_rate = _cross(omega, n)
    # d/dt (I_x omega + I_z r n) = M; omega stays perpendicular to n.
    aerodynamic = _combined(qSc * C_L, ahead, qSc * C_M, across)
    torque = _combined(1.0, aerodynamic, -disc.inertia_axial * r, n_rate)
    omega_rate = _combined(1.0 / disc.inertia_diametral, torque, -_dot(omega, n_rate), n)
    r_rate = qSc * C_N / disc.inertia_axial if flight.setup.model == 'exact' else 0.0
    A_x, A_y, A_z = (part / disc.mass for part in force)
    return [*V, A_x, A_y, A_z + air.gravity, *n_rate, *omega_rate, r_rate]


# numpy takes five times as long for vectors of three.


def _dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> list[float]:
    """Return the cross product."""
    (a_x, a_y, a_z), (b_x, b_y, b_z) = a, b
    return [a_y * b_z - a_z * b_y, a_z * b_x - a_x * b_z, a_x * b_y - a_y * b_x]


def _combined(a: float, u: Vector, b: float, v: Vector) -> list[float]:
    """Return a u + b v."""
    return [a * u[0] + b * v[0], a * u[1] + b * v[1], a * u[2] + b * v[2]]


def _steady(flight: Flight) -> Steady:
    """Return what gives C_Lift, C_Drag and C_M at an angle of attack [rad]."""
    disc = flight.setup.disc
    line, table = disc.linear, disc.table
    if (flight.setup.aero or disc.aero) == 'linear' and line is not None:

        def on_lines(alpha: float) -> tuple[float, float, float]:
            drag = line.CD_0 + line.CD_alpha * (alpha - line.alpha_0) ** 2
            return line.CL_0 + line.CL_alpha * alpha, drag, line.CM_0 + line.CM_alpha * alpha

        return on_lines
    if table is None:
        raise ValueError(f'disc {disc.name} has no table')
    angles, rows = table.alpha_deg.tolist(), table.coefficients.tolist()

    def between_rows(alpha: float) -> tuple[float, float, float]:
        degrees = math.degrees(alpha)
        i = min(bisect.bisect_right(angles, degrees), len(angles) - 1)
        part = (degrees - angles[i - 1]) / (angles[i] - angles[i - 1])
        lift, drag, moment = _combined(1.0 - part, rows[i - 1], part, rows[i])
        return lift, drag, moment

    return between_rows
