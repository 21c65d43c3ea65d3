"""Throws side by side, compiled: moved apart, compared with measurements, and their equations.

An update of a prediction runs these loops for some thirty throws and hundreds of measurements.
`throw_fit` calls them. Without numba they run as plain Python.
"""

import math
from typing import NamedTuple

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.kernels.jit import entry, inline, jit
from disc_sim_ros.physics.kernels.rows import AT
from disc_sim_ros.physics.kernels.simd import WIDTH
from disc_sim_ros.physics.kernels.tracking import SEEN

MANNER = 7  # speed, climb, nose, bank, p, q, spin
_STEEPEST = 1.5  # rad, largest angle of attack to which a throw is moved
_LEAST_SPEED = 0.5  # m/s through the air, below which a flow has no direction here
_HORIZONTAL = 1e-3  # share of the speed below which a path counts as vertical
_LEVEL = 1e-6
_WIND = AT['wind_x']
_LIFT = AT['lift_offset']
_FACTOR = AT['lift_factor']
_E = State._fields.index('e0')
_P = State._fields.index('p')


class Curve(NamedTuple):
    """What turns lift into attitude: `lift_coordinates.LiftCurve` and the air."""

    alpha: FloatArray  # rad, ascending
    C_Lift: FloatArray  # ascending
    per_speed_squared: float  # acceleration by a coefficient of 1 over the squared airspeed [1/m]


@entry
def move(
    state: FloatArray,
    row: FloatArray,
    deltas: FloatArray,
    rows: FloatArray,
    curve: Curve,
    states: FloatArray,
) -> None:
    """Write states that are moved by `lift_coordinates`.

    Args:
        state: Paper's axes, shape (14,).
        row: Constants of its flight.
        deltas: In the order of `lift_coordinates.NAMES`, lift as an acceleration [m/s^2], shape
            (n, 11).
        rows: Constants of each moved flight, shape (n, len(row)).
        curve: Of the disc.
        states: Filled, shape (n, 14).
    """
    flow = _air_velocity(state, row)
    right, down = _frame(flow)
    axis = _axis(state)
    forward = _scaled(flow, 1.0 / max(math.sqrt(_dot(flow, flow)), 1e-9))
    alpha = math.asin(min(max(_dot(axis, forward), -1.0), 1.0))
    bank = math.atan2(-_dot(axis, right), _dot(axis, down))
    C_Lift = _on(alpha, curve.alpha, curve.C_Lift) * row[_FACTOR] + row[_LIFT]
    lift = _dynamic(flow, curve) * C_Lift
    for i in range(len(deltas)):
        delta, own_row, own = deltas[i], rows[i], states[i]
        for k in range(len(own)):
            own[k] = state[k]
        for k in range(6):
            own[k] += delta[k]
        for k in range(3):
            own[_P + k] += delta[8 + k]
        flow = _air_velocity(own, own_row)
        C_Lift = (lift + delta[6]) / _dynamic(flow, curve) - own_row[_LIFT]
        new = _on(C_Lift / own_row[_FACTOR], curve.C_Lift, curve.alpha)
        new = min(max(new, -_STEEPEST), _STEEPEST)
        right, down = _frame(flow)
        forward = _scaled(flow, 1.0 / max(math.sqrt(_dot(flow, flow)), 1e-9))
        c, s = math.cos(new), math.sin(new)
        c_bank, s_bank = math.cos(bank + delta[7]), math.sin(bank + delta[7])
        new_axis = (
            forward[0] * s + down[0] * c * c_bank - right[0] * c * s_bank,
            forward[1] * s + down[1] * c * c_bank - right[1] * c * s_bank,
            forward[2] * s + down[2] * c * c_bank - right[2] * c * s_bank,
        )
        _turn(own, axis, new_axis)


@inline
def _dot(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inline
def _scaled(a: tuple[float, float, float], f: float) -> tuple[float, float, float]:
    return a[0] * f, a[1] * f, a[2] * f


@inline
def _cross(
    a: tuple[float, float, float], b: tuple[float, float, float]
) -> tuple[float, float, float]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inline
def _air_velocity(state: FloatArray, row: FloatArray) -> tuple[float, float, float]:
    """Return the velocity through the air, earth axes 1; the wind of a row is in `map`."""
    return state[3] - row[_WIND], state[4] + row[_WIND + 1], state[5] + row[_WIND + 2]


@inline
def _dynamic(flow: tuple[float, float, float], curve: Curve) -> float:
    """Return the acceleration by a coefficient of 1 [m/s^2]."""
    return curve.per_speed_squared * max(_dot(flow, flow), _LEAST_SPEED * _LEAST_SPEED)


@inline
def _frame(
    flow: tuple[float, float, float],
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return unit vectors to the right of the flow and down from it."""
    x, y, z = _scaled(flow, 1.0 / max(math.sqrt(_dot(flow, flow)), 1e-9))
    level = max(math.sqrt(x * x + y * y), _LEVEL)
    right = (-y / level, x / level, 0.0)
    return right, _cross((x, y, z), right)


@inline
def _axis(state: FloatArray) -> tuple[float, float, float]:
    """Return the axis through the underside, earth axes 1."""
    e0, e1, e2, e3 = state[_E], state[_E + 1], state[_E + 2], state[_E + 3]
    z = e0 * e0 - e1 * e1 - e2 * e2 + e3 * e3
    return 2.0 * (e1 * e3 + e0 * e2), 2.0 * (e2 * e3 - e0 * e1), z


@jit
def _on(x: float, places: FloatArray, values: FloatArray) -> float:
    """Return the value on straight lines through ascending places, which go on at both ends."""
    i = 0
    while i < len(places) - 2 and x >= places[i + 1]:
        i += 1
    slope = (values[i + 1] - values[i]) / (places[i + 1] - places[i])
    value: float = values[i] + (x - places[i]) * slope
    return value


@inline
def _turn(
    state: FloatArray, old: tuple[float, float, float], new: tuple[float, float, float]
) -> None:
    """Turn the attitude by the smallest rotation that takes the axis `old` to `new`."""
    w = 1.0 + _dot(old, new)
    x, y, z = _cross(old, new)
    n = 1.0 / math.sqrt(max(w * w + x * x + y * y + z * z, 1e-18))
    w, x, y, z = w * n, x * n, y * n, z * n
    a, b, c, d = state[_E], state[_E + 1], state[_E + 2], state[_E + 3]
    state[_E] = w * a - x * b - y * c - z * d
    state[_E + 1] = w * b + x * a + y * d - z * c
    state[_E + 2] = w * c - x * d + y * a + z * b
    state[_E + 3] = w * d + x * c - y * b + z * a


@entry
def manners(states: FloatArray, out: FloatArray) -> None:
    """Write speed, climb, nose, bank, p, q and spin of states, shape (n, 7), from (n, 14)."""
    for i in range(len(states)):
        s = states[i]
        X, Y, Z = s[3], s[4], s[5]
        speed = max(math.sqrt(X * X + Y * Y + Z * Z), 1e-6)
        X, Y, Z = X / speed, Y / speed, Z / speed
        level = max(math.sqrt(X * X + Y * Y), _HORIZONTAL)
        a, b, c = _axis(s)
        out[i, 0] = speed
        out[i, 1] = math.atan2(-Z, level)
        out[i, 2] = math.asin(min(max(a * X + b * Y + c * Z, -1.0), 1.0))
        out[i, 3] = -math.asin(min(max((b * X - a * Y) / level, -1.0), 1.0))
        for k in range(3):
            out[i, 4 + k] = s[_P + k]


class Equations(NamedTuple):
    """Normal equations of a throw, filled by `normal_equations`; m unknowns."""

    normal: FloatArray  # shape (m, m)
    gradient: FloatArray  # shape (m,)


@entry
def normal_equations(
    sights: FloatArray,
    base: FloatArray,
    roots: FloatArray,
    of_prior: FloatArray,
    free: int,
    slopes: FloatArray,
    out: Equations,
) -> None:
    """Write the normal equations from throws to both sides of an estimate.

    The first three unknowns are the position, which moves all positions alike.

    Args:
        sights: Of lanes: the estimate, `free` to one side, `free` to the other; see
            `tracked.Tracks.sights`.
        base: Differences of the estimate from the measurements, shape (k, SEEN).
        roots: Roots of their weights; 0 where nothing was measured, shape (k, SEEN).
        of_prior: Residuals of the prior of all lanes, shape (n, c).
        free: Number of the other unknowns.
        slopes: Work space, shape (3 + free,).
        out: Filled.
    """
    m = free + 3
    out.normal[:] = 0.0
    out.gradient[:] = 0.0
    for j in range(len(base)):
        for c in range(SEEN):
            root = roots[j, c]
            if root == 0.0:
                continue
            for u in range(3):
                slopes[u] = root if u == c else 0.0
            for u in range(free):
                a, b = 1 + u, 1 + free + u
                plus, minus = (
                    sights[a // WIDTH, j, c, a % WIDTH],
                    sights[b // WIDTH, j, c, b % WIDTH],
                )
                slopes[3 + u] = _finite(0.5 * (plus - minus) * root)
            _add(slopes, base[j, c] * root, m, out)
    for c in range(of_prior.shape[1]):
        for u in range(3):
            slopes[u] = 0.0
        for u in range(free):
            slopes[3 + u] = _finite(0.5 * (of_prior[1 + u, c] - of_prior[1 + free + u, c]))
        _add(slopes, of_prior[0, c], m, out)
    for u in range(m):
        for v in range(u):
            out.normal[v, u] = out.normal[u, v]


@inline
def _finite(x: float) -> float:
    return x if abs(x) < math.inf else 0.0


@inline
def _add(slopes: FloatArray, residual: float, m: int, out: Equations) -> None:
    for u in range(m):
        x = slopes[u]
        out.gradient[u] += x * residual
        for v in range(u + 1):
            out.normal[u, v] += x * slopes[v]


@entry
def costs(
    sights: FloatArray,
    measured: FloatArray,
    per_sigma: FloatArray,
    of_prior: FloatArray,
    gate: float,
    out: FloatArray,
) -> None:
    """Write half the sums of squared residuals of n throws; outliers count less.

    Args:
        sights: See `tracked.Tracks.sights`.
        measured: Measurements, shape (k, SEEN).
        per_sigma: One over their scaled standard deviations; 0 where nothing was measured.
        of_prior: Residuals of the prior, shape (n, c).
        gate: Squared residual of a position, or of an axis, beyond which it counts less.
        out: Filled; inf of a lost flight, shape (n,).
    """
    for i in range(len(out)):
        group, lane = i // WIDTH, i % WIDTH
        total = 0.0
        for j in range(len(measured)):
            for part in range(2):
                squared = 0.0
                for c in range(3 * part, 3 * part + 3):
                    if per_sigma[j, c] > 0.0:
                        r = (sights[group, j, c, lane] - measured[j, c]) * per_sigma[j, c]
                        squared += r * r
                total += 2.0 * gate - gate * gate / squared if squared > gate else squared
        for c in range(of_prior.shape[1]):
            total += of_prior[i, c] * of_prior[i, c]
        out[i] = 0.5 * total if abs(total) < math.inf else math.inf


def equations(m: int) -> Equations:
    """Return space for the normal equations of m unknowns."""
    return Equations(np.empty((m, m)), np.empty(m))
