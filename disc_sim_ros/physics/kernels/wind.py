"""Wind at a point: mean, log profile, and Dryden gusts of MIL-F-8785C for low altitude.

Gusts are drawn from given noise on a time grid of their own, and are linear in between: they do
not depend on the integration step, and the same noise gives the same flight. Length scales and
strengths follow MIL-F-8785C, section 3.7.3.4, for heights below 1000 ft. Below 10 ft, where the
specification ends, they are those at 10 ft.
"""

import math
from typing import NamedTuple

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import Velocity
from disc_sim_ros.physics.kernels.jit import inline

GUST_INTERVAL = 0.01  # s between drawn gusts; the shortest time scale, L_w / V, is 3 m / 30 m/s
NOISE_COLUMNS = 5  # standard normal numbers for each drawn gust
_FOOT = 0.3048  # m
_LOWEST, _HIGHEST = 10.0, 1000.0  # ft
_SQRT3 = math.sqrt(3.0)


class WindData(NamedTuple):
    """Wind in the form of the compiled equations, earth axes 1; see `environment.Wind`."""

    X: float  # m/s
    Y: float
    Z: float
    z0: float  # m, roughness length; 0 for no profile
    per_log: float  # 1 / ln(h_ref / z0)
    W_20: float  # m/s, 0 for no turbulence
    x_X: float  # horizontal unit vector along which the u gust blows
    x_Y: float


class GustFilter(NamedTuple):
    """State of the shaping filters, each of unit variance at its output."""

    u: float
    v1: float
    v2: float
    w1: float
    w2: float


@inline
def wind_at(Z: float, gust: Velocity, wind: WindData) -> Velocity:
    """Return the velocity of the air at Z (down), for the gust there."""
    share = 1.0
    if wind.z0 > 0.0:
        share = math.log(max(-Z / wind.z0, 1.0)) * wind.per_log
    return Velocity(share * wind.X + gust.X, share * wind.Y + gust.Y, wind.Z + gust.Z)


@inline
def first_filter(n: FloatArray) -> GustFilter:
    """Return a filter state drawn from the stationary distribution with five normal numbers."""
    return GustFilter(
        n[0],
        n[1] * math.sqrt(0.5),
        (n[1] + n[2]) * math.sqrt(0.125),
        n[3] * math.sqrt(0.5),
        (n[3] + n[4]) * math.sqrt(0.125),
    )


@inline
def next_filter(f: GustFilter, V: float, Z: float, dt: float, n: FloatArray) -> GustFilter:
    """Return the filter state after `dt`, exact for constant airspeed `V` and height `-Z`."""
    length, length_w, _, _ = scales(Z, 0.0)
    a = math.exp(-V * dt / length)
    u = a * f.u + math.sqrt(1.0 - a * a) * n[0]
    v1, v2 = _next_pair(f.v1, f.v2, V * dt / length, n[1], n[2])
    w1, w2 = _next_pair(f.w1, f.w2, V * dt / length_w, n[3], n[4])
    return GustFilter(u, v1, v2, w1, w2)


@inline
def gust_of(f: GustFilter, Z: float, wind: WindData) -> Velocity:
    """Return the gust velocity of a filter state at height `-Z`."""
    _, _, sigma, sigma_w = scales(Z, wind.W_20)
    u = sigma * f.u
    v = sigma * (_SQRT3 * f.v1 + (1.0 - _SQRT3) * f.v2)
    w = sigma_w * (_SQRT3 * f.w1 + (1.0 - _SQRT3) * f.w2)
    return Velocity(u * wind.x_X - v * wind.x_Y, u * wind.x_Y + v * wind.x_X, w)


@inline
def scales(Z: float, W_20: float) -> tuple[float, float, float, float]:
    """Return L_u = L_v and L_w [m], sigma_u = sigma_v and sigma_w [m/s] at height `-Z`."""
    h = min(max(-Z / _FOOT, _LOWEST), _HIGHEST)
    b = 0.177 + 0.000823 * h
    sigma_w = 0.1 * W_20
    return h / b**1.2 * _FOOT, h * _FOOT, sigma_w / b**0.4, sigma_w


@inline
def _next_pair(x1: float, x2: float, d: float, n1: float, n2: float) -> tuple[float, float]:
    """Return the two states of (1 + sqrt(3) T s) / (1 + T s)^2 after d = dt / T.

    x1' = (noise - x1) / T, x2' = (x1 - x2) / T; the output sqrt(3) x1 + (1 - sqrt(3)) x2 has unit
    variance. The noise has the covariance that keeps the stationary one, (2, 1; 1, 1) / 4.
    """
    a = math.exp(-d)
    y1 = a * x1
    y2 = a * (x2 + d * x1)
    aa = a * a
    c11 = 0.5 - 0.5 * aa
    c12 = 0.25 - aa * (0.25 + 0.5 * d)
    c22 = 0.25 - aa * (0.25 + 0.5 * d + 0.5 * d * d)
    l11 = math.sqrt(max(c11, 0.0))
    l21 = c12 / l11 if l11 > 0.0 else 0.0
    l22 = math.sqrt(max(c22 - l21 * l21, 0.0))
    return y1 + l11 * n1, y2 + l21 * n1 + l22 * n2
