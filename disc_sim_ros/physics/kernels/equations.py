"""The equations of motion of a spinning disc, in the paper's letters with its equation numbers.

They are written in axes 2 that tilt with the disc but do not spin with it ("despun"), so that the
spin does not limit the step. These are the paper's body axes turned back about z by the spin angle
sigma; their own angular velocity is (p, q, 0). Position and velocity are in earth axes 1.
docs/deviations.md lists each correction of the printed equations with its reason.

Each function takes floats, or SIMD vectors with one float for each of several flights (`simd`).
numba compiles the same source for the node, the offline flight and the ensemble; without numba it
runs as plain Python. Never branch on per-flight values with `if`; use `where`.
"""

import math
from typing import NamedTuple

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.aerodynamics import (
    Linear,
    linear_coefficients,
    spin_coefficients,
    table_coefficients,
)
from disc_sim_ros.physics.kernels.jit import inline
from disc_sim_ros.physics.kernels.rotation import rotation_elements
from disc_sim_ros.physics.kernels.simd import where

EXACT, CONSTANT_SPIN, PRECESSION, SLOWING_PRECESSION = range(4)  # rigid-body models
BODY, WIND = range(2)  # axes in which the moment coefficients act: 3 or 4
DISC, DISC_BODY, DISC_AIR = range(3)  # axes of a moment given in N m

# Where the in-plane airspeed is below this fraction of the airspeed (within 0.006 degrees of
# alpha = +-90 degrees) the flow has no direction in the plane of the disc, and every effect that
# needs this direction fades to zero.
NO_DIRECTION = 1e-4
_TINY = 1e-300


class State(NamedTuple):
    """State of the disc, or its rate of change."""

    X: float  # position of the centre, earth axes 1 [m]
    Y: float
    Z: float
    VX: float  # velocity over the ground, earth axes 1 [m/s]
    VY: float
    VZ: float
    e0: float  # attitude of the despun axes 2 in axes 1, unit quaternion, scalar first
    e1: float
    e2: float
    e3: float
    p: float  # angular velocity of the disc, despun axes 2 [rad/s]
    q: float
    r: float
    sigma: float  # spin angle from the despun axes 2 to the disc, clockwise from above [rad]


class Plant(NamedTuple):
    """What flies, and in what: constants of the disc and the air, and the choice of model."""

    m: float  # kg
    c: float  # m
    S: float  # m^2
    I_x: float  # kg m^2
    I_z: float  # kg m^2
    C_Lp: float
    C_Mq: float
    C_Nr: float
    rho: float  # kg/m^3
    g: float  # m/s^2
    model: int  # EXACT, CONSTANT_SPIN, PRECESSION or SLOWING_PRECESSION
    moment_axes: int  # BODY or WIND
    use_linear: bool  # straight lines instead of the table
    line: Linear
    table: FloatArray  # steady coefficients, see `aerodynamics.table_coefficients`
    spin_terms: FloatArray  # see `aerodynamics.spin_coefficients`; empty if the disc has none
    rim: float  # m, radius of the rim that touches the ground; 0 where the centre does


class Velocity(NamedTuple):
    """A velocity in earth axes 1 [m/s]."""

    X: float
    Y: float
    Z: float


class Control(NamedTuple):
    """Control inputs, held over a step: coefficients of eqns 22 to 24, and a moment in N m."""

    C_L: float = 0.0  # roll, right edge down positive
    C_M: float = 0.0  # pitch, nose up positive
    C_N: float = 0.0  # spin, clockwise from above positive
    L: float = 0.0  # N m, about x, y, z of `axes`
    M: float = 0.0
    N: float = 0.0
    axes: int = DISC  # DISC: despun axes 2; DISC_BODY: fixed in the plastic; DISC_AIR: axes 3


class Coefficients(NamedTuple):
    """Aerodynamic coefficients without control inputs and damping, axes 3 and 4."""

    Lift: float
    Drag: float
    Side: float
    L: float
    M: float


class Flow(NamedTuple):
    """The air relative to the disc: components and angles in despun axes 2 and in axes 3."""

    u: float  # velocity relative to the air, despun axes 2 [m/s]
    v: float
    w: float
    u3: float  # its part in the plane of the disc, axes 3 (v3 = 0) [m/s]
    V: float  # airspeed [m/s]
    alpha: float  # angle of attack [rad]
    d_x: float  # direction of x3 in axes 2, (cos beta, sin beta)
    d_y: float
    no_direction: float  # 0 in ordinary flight, 1 where x3 has no direction and d is 0


class Moment(NamedTuple):
    """Moment in despun axes 2: (L, M) + D (p, q) about x and y, and N about z."""

    L: float  # N m, at p = q = 0
    M: float
    N: float  # N m, spin damping included
    D_xx: float  # N m s, damping of p and q; symmetric
    D_xy: float
    D_yy: float


@inline
def flow(s: State, wind: Velocity) -> Flow:
    """Return the flow relative to the disc, for the wind at the disc (eqns 9 and 15 to 17).

    Where the flow has no direction in the plane of the disc (alpha = +-90 degrees, no airspeed)
    the vector d shrinks to 0, and so does every effect along it: no sideways motion arises.
    """
    V_X = s.VX - wind.X
    V_Y = s.VY - wind.Y
    V_Z = s.VZ - wind.Z
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation_elements(s.e0, s.e1, s.e2, s.e3)
    u = xx * V_X + yx * V_Y + zx * V_Z
    v = xy * V_X + yy * V_Y + zy * V_Z
    w = xz * V_X + yz * V_Y + zz * V_Z
    u3 = math.sqrt(u * u + v * v)
    V = math.sqrt(u3 * u3 + w * w)
    per_u3 = 1.0 / max(u3, NO_DIRECTION * V, _TINY)
    return Flow(u, v, w, u3, V, arctangent(w, u3), u * per_u3, v * per_u3, 1.0 - u3 * per_u3)


@inline
def angle_of_flow(w: float, u3: float) -> float:
    """Return alpha of one state (eqn 17) [rad]; `flow` has it for SIMD vectors, too."""
    return math.atan2(w, u3)


@inline
def coefficients(a: Flow, r: float, plant: Plant) -> Coefficients:
    """Return the coefficients without control inputs and damping (eqns 19 to 23)."""
    if plant.use_linear:
        C_Lift, C_Drag, C_M = linear_coefficients(a.alpha, plant.line)
    else:
        C_Lift, C_Drag, C_M = table_coefficients(a.alpha, plant.table)
    C_L = C_Side = 0.0
    if len(plant.spin_terms) > 0:
        AdvR = r * plant.c / (2.0 * max(a.V, _TINY))  # eqn 63
        C_L, C_Side = spin_coefficients(AdvR, a.alpha, plant.spin_terms)
    return Coefficients(C_Lift, C_Drag, C_Side, C_L, C_M)


@inline
def force(a: Flow, C: Coefficients, plant: Plant) -> tuple[float, float, float]:
    """Return the aerodynamic force in despun axes 2 [N] (eqns 26, 28, 30 and 31).

    q_inf S cos alpha is rho V S u3 / 2, and q_inf S sin alpha is rho V S w / 2: zero airspeed
    needs no special case.
    """
    qS_V = 0.5 * plant.rho * a.V * plant.S
    lift_in_plane = C.Lift * a.w
    side = C.Side * a.V
    X = qS_V * (-C.Drag * a.u + lift_in_plane * a.d_x - side * a.d_y)
    Y = qS_V * (-C.Drag * a.v + lift_in_plane * a.d_y + side * a.d_x)
    Z = qS_V * (-C.Drag * a.w - C.Lift * a.u3)
    return X, Y, Z


@inline
def moment(a: Flow, s: State, C: Coefficients, plant: Plant, control: Control) -> Moment:
    """Return the moment of air and control inputs in despun axes 2 (eqns 22 to 25, 27 and 32).

    Damping coefficients are per rate times c / (2 V): the slope of the moment against a rate is
    q_inf S c^2 / (2 V) = rho V S c^2 / 4.
    """
    qS_V = 0.5 * plant.rho * a.V * plant.S
    qSc = qS_V * a.V * plant.c
    qScc_2V = 0.5 * qS_V * plant.c * plant.c
    L_p = qScc_2V * plant.C_Lp
    M_q = qScc_2V * plant.C_Mq
    L_steady = qSc * C.L
    M_steady = qSc * C.M
    L_control = qSc * control.C_L
    M_control = qSc * control.C_M
    N = qSc * control.C_N + qScc_2V * plant.C_Nr * s.r

    # Coefficients act about axes 3, as above, or about axes 4, whose roll and spin axes are turned
    # by alpha (T_34, corrected).
    if plant.moment_axes == WIND:
        per_V = 1.0 / max(a.V, _TINY)
        cos_alpha = a.u3 * per_V
        sin_alpha = a.w * per_V
        roll = L_steady + L_control + L_p * (a.d_x * s.p + a.d_y * s.q)
        L_steady = cos_alpha * L_steady - sin_alpha * N
        L_control = cos_alpha * L_control
        L_p = cos_alpha * L_p
        N = cos_alpha * N + sin_alpha * roll

    # From axes 3 to axes 2. Where x3 has no direction, control inputs act about the disc's own x
    # axis, and damping is the same about every diameter.
    x_x = a.d_x + a.no_direction
    L = L_steady * a.d_x - M_steady * a.d_y + L_control * x_x - M_control * a.d_y
    M = L_steady * a.d_y + M_steady * a.d_x + L_control * a.d_y + M_control * x_x
    isotropic = 0.5 * (L_p + M_q) * (1.0 - a.d_x * a.d_x - a.d_y * a.d_y)
    D_xx = L_p * a.d_x * a.d_x + M_q * a.d_y * a.d_y + isotropic
    D_xy = (L_p - M_q) * a.d_x * a.d_y
    D_yy = L_p * a.d_y * a.d_y + M_q * a.d_x * a.d_x + isotropic

    cos, sin = _axes_of_moment(control.axes, s.sigma, x_x, a.d_y)
    L += control.L * cos - control.M * sin
    M += control.L * sin + control.M * cos
    return Moment(L, M, N + control.N, D_xx, D_xy, D_yy)


@inline
def _axes_of_moment(axes: int, sigma: float, x_x: float, x_y: float) -> tuple[float, float]:
    """Return the x axis, in despun axes 2, of the axes of a moment given in N m."""
    if axes == DISC_BODY:
        return math.cos(sigma), math.sin(sigma)
    if axes == DISC_AIR:
        return x_x, x_y
    return 1.0, 0.0


@inline
def precession_rates(r: float, m: Moment, I_z: float) -> tuple[float, float]:
    """Return p, q at which the moments balance the gyroscopic ones (eqns 53 and 54, corrected).

    With dp/dt = dq/dt = 0 in axes that do not spin, eqns 51 and 52 read L = q r I_z and
    M = -p r I_z. L and M include the damping by p and q: two linear equations in p and q.
    """
    H = r * I_z
    det = m.D_xx * m.D_yy + (H - m.D_xy) * (H + m.D_xy)
    singular = det <= _TINY  # neither spin nor damping determines the rates
    per_det = 1.0 / where(singular, 1.0, det)
    p = (-m.D_yy * m.L - (H - m.D_xy) * m.M) * per_det
    q = (-m.D_xx * m.M + (H + m.D_xy) * m.L) * per_det
    return where(singular, 0.0, p), where(singular, 0.0, q)


@inline
def derivative(s: State, wind: Velocity, plant: Plant, control: Control) -> State:
    """Return the rate of change of the state: eqns 10, 11 and 33 in despun axes.

    Args:
        s: State; its quaternion has unit length.
        wind: Velocity of the air at the disc.
        plant: Constants of the flight, with the rigid-body model.
        control: Control inputs.
    """
    a = flow(s, wind)
    C = coefficients(a, s.r, plant)
    m = moment(a, s, C, plant, control)
    p, q, r = s.p, s.q, s.r
    p_dot = q_dot = r_dot = 0.0
    if plant.model >= PRECESSION:
        p, q = precession_rates(r, m, plant.I_z)
        if plant.model == SLOWING_PRECESSION:
            r_dot = m.N / plant.I_z
    else:
        # Eqn 11 with the axes turning at (p, q, 0) and the angular momentum (I_x p, I_x q, I_z r).
        H = r * plant.I_z
        per_I_x = 1.0 / plant.I_x
        p_dot = (m.L + m.D_xx * p + m.D_xy * q - q * H) * per_I_x
        q_dot = (m.M + m.D_xy * p + m.D_yy * q + p * H) * per_I_x
        if plant.model == EXACT:
            r_dot = m.N / plant.I_z

    # Eqns 10 and 33 in earth axes: m dV/dt = T_21 F + m g.
    X, Y, Z = force(a, C, plant)
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation_elements(s.e0, s.e1, s.e2, s.e3)
    per_m = 1.0 / plant.m
    V_X_dot = (xx * X + xy * Y + xz * Z) * per_m
    V_Y_dot = (yx * X + yy * Y + yz * Z) * per_m
    V_Z_dot = (zx * X + zy * Y + zz * Z) * per_m + plant.g
    return State(
        s.VX,
        s.VY,
        s.VZ,
        V_X_dot,
        V_Y_dot,
        V_Z_dot,
        -0.5 * (s.e1 * p + s.e2 * q),  # eqn 6 as a quaternion rate, e (0, p, q, 0) / 2
        0.5 * (s.e0 * p - s.e3 * q),
        0.5 * (s.e0 * q + s.e3 * p),
        0.5 * (s.e1 * q - s.e2 * p),
        p_dot,
        q_dot,
        r_dot,
        r,
    )


@inline
def consistent(s: State, wind: Velocity, plant: Plant, control: Control) -> State:
    """Return the state with a unit quaternion and, in the precession models, their p and q."""
    n = 1.0 / math.sqrt(s.e0 * s.e0 + s.e1 * s.e1 + s.e2 * s.e2 + s.e3 * s.e3)
    e0, e1, e2, e3 = s.e0 * n, s.e1 * n, s.e2 * n, s.e3 * n
    p, q = s.p, s.q
    if plant.model >= PRECESSION:
        a = flow(s, wind)
        C = coefficients(a, s.r, plant)
        p, q = precession_rates(s.r, moment(a, s, C, plant, control), plant.I_z)
    return State(s.X, s.Y, s.Z, s.VX, s.VY, s.VZ, e0, e1, e2, e3, p, q, s.r, s.sigma)


_TAN_22_5, _TAN_67_5 = math.sqrt(2.0) - 1.0, math.sqrt(2.0) + 1.0


@inline
def arctangent(y: float, x: float) -> float:
    """Return atan2(y, x) for x >= 0 [rad], to 3e-16; 0 where both are 0 or below 1e-300.

    The angle is the nearest of 0, 45 and 90 degrees plus atan(t), |t| <= tan 22.5 degrees. A
    polynomial in t^2 interpolates (atan(t) / t - 1) / t^2 at the Chebyshev points; it gives
    atan(t) / t to 4e-17.
    """
    a = abs(y)
    steep, flat = a > _TAN_67_5 * x, a <= _TAN_22_5 * x
    above = where(steep, -x, where(flat, a, a - x))
    below = where(steep, a, where(flat, x, a + x))
    base = where(steep, math.pi / 2, where(flat, 0.0, math.pi / 4))
    t = above / max(below, _TINY)
    z = t * t
    z2 = z * z
    z4 = z2 * z2
    low = (-0.33333333333328435 + 0.19999999998854168 * z) + z2 * (
        -0.14285714180900647 + 0.11111106177375227 * z
    )
    high = (-0.09090773003240828 + 0.07689952488233016 * z) + z2 * (
        -0.066402251735395 + 0.0568830340363325 * z
    )
    top = -0.04347919839046537 + 0.021133752033748364 * z
    angle = base + (t + t * z * (low + z4 * (high + z4 * top)))
    signed: float = where(y < 0.0, -angle, angle)
    return signed
