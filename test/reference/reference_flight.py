"""Reference integrator for a disc flight: it shares no code and no formulation with the package.

Sources: Crowther & Potts 2007 (Sports Engineering 10, 3-21), cited as "eqn n", with the errata of
docs/deviations.md. Formulation: velocity (u, v, w) and rates (p, q, r) in axes fixed
in the SPINNING disc (eqns 10 and 11), attitude as the nine numbers of a rotation matrix
(Rdot = R omega~); no quaternion, no despun axes, no Euler angles after the launch. Only the
`precession` model, which is defined in non-spinning axes, has axes that do not turn about the
disc normal.

Integration: Dormand-Prince 8(5,3) (tableau of `scipy.integrate.DOP853`) compiled with numba,
tolerance 1e-12 and a step of at most 0.2 ms. The integration stops at the kinks of the linearly
interpolated table: a step uses one segment of the table, continued linearly beyond its nodes, and
is shortened to end at the node where alpha leaves the segment.

Measured over the 40 launches of cases.py, largest change of landing position and time:
- steps of 0.1 and 0.05 ms instead of 0.2 ms: 3e-12 m, 2e-11 s (rtol = atol = 1e-10: none, the
  step limit governs). Steps of 1 ms: 5e-6 m, where alpha just grazes a node within a step;
- against a second formulation (velocity, angular momentum and normal in earth axes, np.interp,
  `scipy.integrate.solve_ivp` DOP853 at 1e-12, max_step 0.25 ms, no stops at nodes): 1.9e-8 m,
  3.7e-9 s with the table, 7e-13 m with linear aerodynamics.
Where u3 = 0 (alpha = +-90 degrees, or no airspeed) the direction of the lift is not continuous;
the result is finite but these figures do not hold.
"""

from collections.abc import Mapping, Sequence
import math

from numba import njit
import numpy as np
from scipy.integrate import DOP853

_A = np.ascontiguousarray(DOP853.A)
_B = np.ascontiguousarray(DOP853.B)
_E3 = np.ascontiguousarray(DOP853.E3)
_E5 = np.ascontiguousarray(DOP853.E5)
_STAGES = 12
_NEW = _STAGES + 1  # the row of the work array that holds the state after the step
_STATES = 18  # X Y Z, u v w, p q r, R row by row (body to earth)

_MODELS = {'exact': 0, 'constant_spin': 1, 'precession': 2}
_EXACT = 0
_PRECESSION = 2

# Places in the parameter vector.
_MASS, _CHORD, _AREA, _IZ, _IX, _CLP, _CMQ, _CNR, _RHO, _G = range(10)
_WX, _WY, _WZ, _CTL_L, _CTL_M, _CTL_N, _MODEL, _WIND_AXES, _LINEAR = range(10, 19)
_CL0, _CLA, _CD0, _CDA, _ALPHA0, _CM0, _CMA = range(19, 26)
_STOPS = 26
_PARAMETERS = 27

_GROUND = math.inf  # as a node: the ground instead of a table node
_ON_NODE = 1e-11  # degrees

# Of max_step, for steps that miss the tolerance. The direction of the lift jumps where alpha
# passes +-90 degrees, no step is small enough there, and this one is taken.
_SMALLEST = 0.1


@njit
def _air_angles(y: np.ndarray, par: np.ndarray) -> tuple:
    """Return airspeed, alpha and beta (eqns 15-18); atan2(0, 0) is 0."""
    wx, wy, wz = par[_WX], par[_WY], par[_WZ]
    ua = y[3] - (y[9] * wx + y[12] * wy + y[15] * wz)
    va = y[4] - (y[10] * wx + y[13] * wy + y[16] * wz)
    wa = y[5] - (y[11] * wx + y[14] * wy + y[17] * wz)
    u3 = math.hypot(ua, va)
    return math.hypot(u3, wa), math.atan2(wa, u3), math.atan2(va, ua)


@njit
def _find_cell(alpha: float, nodes: np.ndarray) -> int:
    """Return how many nodes lie below alpha; 0 and all of them: the flat ends of np.interp.

    On a node, the segment towards alpha = 0: alpha never goes beyond +-90 degrees.
    """
    degrees = math.degrees(alpha)
    cell = 0
    while cell < len(nodes) and (nodes[cell] < degrees or nodes[cell] == degrees < 0.0):
        cell += 1
    return cell


@njit
def _steady(alpha: float, air: tuple) -> tuple:
    """Return the steady CL, CD, CM: a straight segment of the table, or the linear fit."""
    cell, par, nodes, table = air
    if par[_LINEAR] != 0.0:
        cl = par[_CL0] + par[_CLA] * alpha
        cd = par[_CD0] + par[_CDA] * (alpha - par[_ALPHA0]) ** 2
        return cl, cd, par[_CM0] + par[_CMA] * alpha
    if cell == 0:
        return table[0, 0], table[1, 0], table[2, 0]
    last = len(nodes) - 1
    if cell > last:
        return table[0, last], table[1, last], table[2, last]
    part = (math.degrees(alpha) - nodes[cell - 1]) / (nodes[cell] - nodes[cell - 1])
    return (
        table[0, cell - 1] + part * (table[0, cell] - table[0, cell - 1]),
        table[1, cell - 1] + part * (table[1, cell] - table[1, cell - 1]),
        table[2, cell - 1] + part * (table[2, cell] - table[2, cell - 1]),
    )


@njit
def _precession_rates(angles: tuple, spin: float, cm: float, par: np.ndarray) -> tuple:
    """Solve 0 = L(p, q) - q r Iz and 0 = M(p, q) + p r Iz in axes 3; p, q in the body axes."""
    airspeed, alpha, beta = angles
    qsc = 0.5 * par[_RHO] * airspeed * airspeed * par[_AREA] * par[_CHORD]
    damping = 0.25 * par[_RHO] * airspeed * par[_AREA] * par[_CHORD] * par[_CHORD]
    roll_damping = damping * par[_CLP]
    pitch_damping = damping * par[_CMQ]
    roll = qsc * par[_CTL_L]
    pitch = qsc * (cm + par[_CTL_M])
    yaw = qsc * par[_CTL_N] + damping * par[_CNR] * spin
    if par[_WIND_AXES] != 0.0:
        roll_damping *= math.cos(alpha)
        roll = roll * math.cos(alpha) - yaw * math.sin(alpha)
    momentum = spin * par[_IZ]
    # [roll_damping, -momentum; momentum, pitch_damping] [p3; q3] = [-roll; -pitch]
    determinant = roll_damping * pitch_damping + momentum * momentum
    if determinant == 0.0:
        return 0.0, 0.0
    p3 = (-roll * pitch_damping - pitch * momentum) / determinant
    q3 = (-pitch * roll_damping + roll * momentum) / determinant
    cb, sb = math.cos(beta), math.sin(beta)
    return cb * p3 - sb * q3, sb * p3 + cb * q3


@njit
def _derivative(y: np.ndarray, air: tuple, dy: np.ndarray) -> None:
    """Fill dy with the right side of eqns 10 and 11 (or 47-49, or the precession model)."""
    par = air[1]
    airspeed, alpha, beta = _air_angles(y, par)
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    cl, cd, cm = _steady(alpha, air)
    u, v, w, p, q, r = y[3], y[4], y[5], y[6], y[7], y[8]
    ix, iz = par[_IX], par[_IZ]
    turn = r  # rate of the axes about the disc normal

    dy[6] = dy[7] = dy[8] = 0.0
    if par[_MODEL] == _PRECESSION:
        p, q = _precession_rates((airspeed, alpha, beta), r, cm, par)
        turn = 0.0
    else:
        # Eqns 22-24: dynamic pressure times c/(2V) leaves one factor V, so V = 0 needs no care.
        qsc = 0.5 * par[_RHO] * airspeed * airspeed * par[_AREA] * par[_CHORD]
        damping = 0.25 * par[_RHO] * airspeed * par[_AREA] * par[_CHORD] * par[_CHORD]
        p3 = cb * p + sb * q
        q3 = -sb * p + cb * q
        roll = qsc * par[_CTL_L] + damping * par[_CLP] * p3
        pitch = qsc * (cm + par[_CTL_M]) + damping * par[_CMQ] * q3
        yaw = qsc * par[_CTL_N] + damping * par[_CNR] * r
        if par[_WIND_AXES] != 0.0:  # eqn 32: M3 = T34 transposed M4
            roll, yaw = ca * roll - sa * yaw, sa * roll + ca * yaw
        dy[6] = (cb * roll - sb * pitch - q * r * (iz - ix)) / ix
        dy[7] = (sb * roll + cb * pitch - r * p * (ix - iz)) / ix
        if par[_MODEL] == _EXACT:
            dy[8] = yaw / iz

    qs = 0.5 * par[_RHO] * airspeed * airspeed * par[_AREA]
    fx3 = qs * (-cd * ca + cl * sa)
    fz3 = qs * (-cd * sa - cl * ca)
    mass, g = par[_MASS], par[_G]
    dy[3] = cb * fx3 / mass + g * y[15] - (q * w - turn * v)
    dy[4] = sb * fx3 / mass + g * y[16] - (turn * u - p * w)
    dy[5] = fz3 / mass + g * y[17] - (p * v - q * u)
    for row in range(3):
        k = 9 + 3 * row
        dy[row] = y[k] * u + y[k + 1] * v + y[k + 2] * w
        dy[k] = y[k + 1] * turn - y[k + 2] * q
        dy[k + 1] = -y[k] * turn + y[k + 2] * p
        dy[k + 2] = y[k] * q - y[k + 1] * p


@njit
def _step(y: np.ndarray, h: float, air: tuple, work: np.ndarray) -> None:
    """Take one Dormand-Prince step; rows of work: 13 derivatives (0: at y), the new state."""
    stage = np.empty(_STATES)
    for s in range(1, _STAGES):
        for i in range(_STATES):
            total = 0.0
            for j in range(s):
                total += _A[s, j] * work[j, i]
            stage[i] = y[i] + h * total
        _derivative(stage, air, work[s])
    for i in range(_STATES):
        total = 0.0
        for j in range(_STAGES):
            total += _B[j] * work[j, i]
        work[_NEW, i] = y[i] + h * total
    _derivative(work[_NEW], air, work[_STAGES])


@njit
def _error(y: np.ndarray, h: float, work: np.ndarray, rtol: float, atol: float) -> float:
    """Return the error norm of a step as scipy's DOP853 forms it; 1 is the limit."""
    e5, e3 = 0.0, 0.0
    for i in range(_STATES):
        scale = atol + rtol * max(abs(y[i]), abs(work[_NEW, i]))
        sum5, sum3 = 0.0, 0.0
        for j in range(_STAGES + 1):
            sum5 += _E5[j] * work[j, i]
            sum3 += _E3[j] * work[j, i]
        e5 += (sum5 / scale) ** 2
        e3 += (sum3 / scale) ** 2
    if e5 == 0.0 and e3 == 0.0:
        return 0.0
    return h * e5 / math.sqrt((e5 + 0.01 * e3) * _STATES)


@njit
def _level(y: np.ndarray, edge: float, par: np.ndarray) -> float:
    """Return what an event brings to zero: Z for the edge _GROUND, else alpha - edge (degrees)."""
    if edge == _GROUND:
        return y[2]
    return math.degrees(_air_angles(y, par)[1]) - edge


@njit
def _shorten(y: np.ndarray, h: float, edge: float, air: tuple, work: np.ndarray) -> float:
    """Find the step length at which _level vanishes (Illinois method) and take that step."""
    par = air[1]
    low, high = 0.0, h
    g_low = _level(y, edge, par)
    _step(y, h, air, work)
    g_high = _level(work[_NEW], edge, par)
    tolerance = 1e-15 if edge == _GROUND else 5e-14
    mid, side = h, 0
    for _ in range(100):
        mid = (low * g_high - high * g_low) / (g_high - g_low)
        if not low < mid < high:
            mid = 0.5 * (low + high)
        _step(y, mid, air, work)
        g = _level(work[_NEW], edge, par)
        if abs(g) < tolerance or high - low < 1e-16:
            break
        if (g > 0.0) == (g_high > 0.0):
            high, g_high = mid, g
            if side == 1:
                g_low *= 0.5
            side = 1
        else:
            low, g_low = mid, g
            if side == -1:
                g_high *= 0.5
            side = -1
    return mid


@njit
def _left_segment(y: np.ndarray, new: np.ndarray, air: tuple) -> tuple:
    """Return the segment of the table entered in a step, the node between, and a way to it.

    The last is false when y lies on that node already, or beyond: nothing is left to shorten.
    """
    cell, par, nodes, _ = air
    degrees = math.degrees(_air_angles(new, par)[1])
    before = math.degrees(_air_angles(y, par)[1])
    if par[_LINEAR] == 0.0 and cell > 0 and degrees < nodes[cell - 1]:
        return cell - 1, nodes[cell - 1], before - nodes[cell - 1] > _ON_NODE
    if par[_LINEAR] == 0.0 and cell < len(nodes) and degrees > nodes[cell]:
        return cell + 1, nodes[cell], nodes[cell] - before > _ON_NODE
    return cell, 0.0, False


@njit
def _copy(source: np.ndarray, target: np.ndarray) -> None:
    """Copy states. As an assignment to a slice it takes seconds to compile."""
    for i in range(_STATES):
        target[i] = source[i]


@njit(cache=True)  # once for all processes that test with it
def _integrate(y0: np.ndarray, times: np.ndarray, limits: tuple, model: tuple) -> tuple:
    """Fly from y0; return landed, the end time, the last state, the states at times, their count.

    `limits` holds duration, max_step, rtol, atol; `model` the parameters, nodes and table.
    """
    duration, max_step, rtol, atol = limits
    par, nodes, table = model
    smallest = _SMALLEST * max_step
    y = y0.copy()
    work = np.empty((_NEW + 1, _STATES))
    samples = np.empty((len(times), _STATES))
    count, t, h, turned_back = 0, 0.0, smallest, 0
    cell = _find_cell(_air_angles(y, par)[1], nodes)
    while True:
        while count < len(times) and times[count] <= t:
            _copy(y, samples[count])
            count += 1
        if t >= duration:
            return False, t, y, samples, count
        target = duration if count == len(times) else min(duration, times[count])
        length = min(max(h, smallest), max_step, target - t)
        reaches = length == target - t
        air = (cell, par, nodes, table)
        _derivative(y, air, work[0])
        _step(y, length, air, work)
        error = _error(y, length, work, rtol, atol)
        if error >= 1.0 and length > smallest:
            h = length * max(0.2, 0.9 * error ** (-0.125))
            continue
        h = max_step if error == 0.0 else length * min(5.0, 0.9 * error ** (-0.125))

        entered, node, way_to_it = _left_segment(y, work[_NEW], air)
        if way_to_it:
            length, reaches = _shorten(y, length, node, air, work), False
        elif entered != cell and turned_back < 2:
            turned_back += 1  # on the node and turning back: change the segment without moving
            cell = entered
            continue
        if par[_STOPS] != 0.0 and y[2] <= 0.0 < work[_NEW, 2]:
            if y[2] < 0.0:
                t += _shorten(y, length, _GROUND, air, work)
                _copy(work[_NEW], y)
            return True, t, y, samples, count
        cell, turned_back = entered, 0
        t = target if reaches else t + length
        _copy(work[_NEW], y)


def _launch_state(launch: Mapping) -> np.ndarray:
    """Return the 18 states at release: yaw-pitch-roll attitude, velocity over ground."""
    roll, pitch, yaw, alpha, beta = np.radians(
        [launch[key] for key in ('roll', 'pitch', 'yaw', 'alpha', 'sideslip')]
    )
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    y = np.zeros(_STATES)
    y[2] = -launch['height']
    y[3] = launch['speed'] * math.cos(alpha) * math.cos(beta)
    y[4] = launch['speed'] * math.cos(alpha) * math.sin(beta)
    y[5] = launch['speed'] * math.sin(alpha)
    y[6:9] = launch['roll_rate'], launch['pitch_rate'], launch['spin']
    y[9:] = (about_z @ about_y @ about_x).ravel()
    return y


def _angular_momentum(y: np.ndarray, model: tuple) -> np.ndarray:
    """Return the angular momentum in earth axes, kg m^2/s."""
    par, nodes, table = model
    p, q, r = y[6:9]
    if par[_MODEL] == _PRECESSION:
        angles = _air_angles(y, par)
        cm = _steady(angles[1], (_find_cell(angles[1], nodes), par, nodes, table))[2]
        p, q = _precession_rates(angles, r, cm, par)
    return y[9:].reshape(3, 3) @ np.array([par[_IX] * p, par[_IX] * q, par[_IZ] * r])


def reference_flight(
    disc: Mapping,
    launch: Mapping,
    *,
    model: str = 'exact',
    aero: str = 'table',
    moment_axes: str = 'body',
    control: Sequence[float] = (0.0, 0.0, 0.0),
    wind_map: Sequence[float] = (0.0, 0.0, 0.0),
    air_density: float = 1.225,
    gravity: float = 9.81,
    ground: bool = True,
    duration: float = 60.0,
    t_eval: Sequence[float] | None = None,
    rtol: float = 1e-12,
    atol: float = 1e-12,
    max_step: float = 2e-4,
) -> dict:
    """Fly one disc to the ground (or for `duration` seconds); return the landing and samples.

    `disc`: mass, diameter, area (default pi d^2/4), I_axial, I_diametral, C_Lp, C_Mq, C_Nr,
    `table` (alpha_deg, CL, CD, CM) and `linear` (CL0, CLa, CD0, CDa, alpha0, CM0, CMa, per
    radian). `launch`: speed, pitch, roll, yaw, alpha, sideslip (degrees), spin, roll_rate,
    pitch_rate (rad/s), height (m). `control` is added to the coefficients C_L, C_M, C_N of
    eqns 22-24 before `moment_axes` (axes 3 or 4) apply. `wind_map`: where the air moves to.
    `precession` ignores roll_rate and pitch_rate: its p and q are algebraic.

    Returned arrays follow the entries of `t_eval` up to the end of the flight (`t_s`). Positions
    and velocities are in map axes (x forward, y left, z up); `normal` and `angular_momentum` in
    earth axes (z down). `landing_position_m` is None without a landing; `end_position_m` is where
    the flight ended. The disc lands when Z changes from <= 0 to > 0 (a launch at height 0 that
    descends at once lands at t = 0).
    """
    diameter = disc['diameter']
    par = np.zeros(_PARAMETERS)
    par[_MASS], par[_CHORD] = disc['mass'], diameter
    par[_AREA] = disc.get('area') or math.pi * diameter**2 / 4.0
    par[_IZ], par[_IX] = disc['I_axial'], disc['I_diametral']
    par[_CLP], par[_CMQ], par[_CNR] = disc['C_Lp'], disc['C_Mq'], disc['C_Nr']
    par[_RHO], par[_G] = air_density, gravity
    par[_WX : _WZ + 1] = wind_map[0], -wind_map[1], -wind_map[2]
    par[_CTL_L : _CTL_N + 1] = control
    par[_MODEL] = _MODELS[model]
    par[_WIND_AXES] = {'body': 0.0, 'wind': 1.0}[moment_axes]
    par[_STOPS] = float(ground)
    par[_LINEAR] = {'table': 0.0, 'linear': 1.0}[aero]
    if aero == 'linear':
        keys = ('CL0', 'CLa', 'CD0', 'CDa', 'alpha0', 'CM0', 'CMa')
        par[_CL0 : _CMA + 1] = [disc['linear'][key] for key in keys]
        nodes, table = np.zeros(1), np.zeros((3, 1))
    else:
        nodes = np.array(disc['table']['alpha_deg'], dtype=float)
        table = np.array([disc['table'][key] for key in ('CL', 'CD', 'CM')], dtype=float)
    times = np.array([] if t_eval is None else t_eval, dtype=float)

    parts = (par, nodes, table)
    limits = (float(duration), float(max_step), float(rtol), float(atol))
    landed, end_time, last, states, count = _integrate(_launch_state(launch), times, limits, parts)
    states = states[:count]
    flip = np.array([1.0, -1.0, -1.0])  # earth axes (z down) to map axes (z up)
    angles = [_air_angles(y, par) for y in states]
    attitude = states[:, 9:].reshape(-1, 3, 3)
    momentum = [_angular_momentum(y, parts) for y in states]
    end_position = flip * last[:3]
    return {
        'landed': bool(landed),
        'flight_time_s': float(end_time),
        'landing_position_m': end_position if landed else None,
        'end_position_m': end_position,
        't_s': times[:count],
        'position_m': flip * states[:, :3],
        'velocity_m_s': flip * np.einsum('nij,nj->ni', attitude, states[:, 3:6]),
        'airspeed': np.array([a[0] for a in angles]),
        'alpha_rad': np.array([a[1] for a in angles]),
        'spin_rad_s': states[:, 8].copy(),
        'normal': attitude[:, :, 2].copy(),
        'angular_momentum': np.array(momentum).reshape(-1, 3),
    }
