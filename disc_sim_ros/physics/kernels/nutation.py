"""The nutation of a free disc, which is known: a step integrates only what differs from it.

Eqn 11 without moments gives p + i q = z = z_0 e^(i w t) in despun axes, for the rate of nutation
w = r I_z / I_x. It is by far the fastest motion, and would set the length of all steps. With a
moment that changes slowly, z goes round a slow mean, z = z_0 + z_0' (e^(i w t) - 1) / (i w), where
z_0' is the rate of change at the start less that of the mean. The disc's turns about x and y are
the integral of z. A Runge-Kutta step makes an error of this motion that depends on w h alone:
`dopri5` takes it away again. What is left are moments and rates that do not follow this motion.

Such steps have the order of those of `dopri5`; they are exponential integrators in the sense of
M. Hochbruck and A. Ostermann, "Exponential integrators", Acta Numerica 19 (2010) 209-286.
"""

from typing import NamedTuple

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.equations import PRECESSION, Plant, State
from disc_sim_ros.physics.kernels.jit import inline
from disc_sim_ros.physics.kernels.simd import element, store, where
from disc_sim_ros.physics.kernels.stages import MEMORY, STAGES, TURNS, rate

SLOWEST = 1.0  # rad/s; a slower nutation is not taken apart


class Nutation(NamedTuple):
    """The free motion that a step starts with."""

    p: float  # z_0' [rad/s^2]
    q: float
    rate: float  # w [rad/s], of either sign
    per_rate: float  # 1 / w; 0 where there is no nutation to speak of


@inline
def nutation_of(s: State, plant: Plant, K: FloatArray) -> Nutation:
    """Return the nutation at the start of a step."""
    k = rate(K, 0)
    w = s.r * plant.I_z / plant.I_x
    if plant.model >= PRECESSION:
        return Nutation(0.0 * w, 0.0 * w, w, 0.0 * w)
    slow = abs(w) < SLOWEST
    per_rate = where(slow, 0.0, 1.0 / where(slow, 1.0, w))
    # The slow mean is i m / w for moments (L, M) / I_x = m.
    p = k.p + element(K, MEMORY + 1) * per_rate
    q = k.q - element(K, MEMORY) * per_rate
    return Nutation(p, q, w, per_rate)


@inline
def put_turns(angle: float, K: FloatArray) -> None:
    """Write e^(i angle c) for the time c of each stage: powers of that of a ninetieth.

    Args:
        angle: w h [rad].
        K: Written, see `stages`.
    """
    x = angle * (1.0 / 90.0)
    z = x * x
    c1 = 1.0 - z * (1 / 2 - z * (1 / 24 - z * (1 / 720 - z * (1 / 40320))))
    s1 = x * (1.0 - z * (1 / 6 - z * (1 / 120 - z * (1 / 5040 - z * (1 / 362880)))))
    c2, s2 = _product(c1, s1, c1, s1)
    c4, s4 = _product(c2, s2, c2, s2)
    c8, s8 = _product(c4, s4, c4, s4)
    c9, s9 = _product(c8, s8, c1, s1)
    c18, s18 = _product(c9, s9, c9, s9)
    c27, s27 = _product(c18, s18, c9, s9)
    c36, s36 = _product(c18, s18, c18, s18)
    c72, s72 = _product(c36, s36, c36, s36)
    c80, s80 = _product(c72, s72, c8, s8)
    c90, s90 = _product(c72, s72, c18, s18)
    one, zero = 1.0 + 0.0 * x, 0.0 * x
    turns = (one, zero, c18, s18, c27, s27, c72, s72, c80, s80, c90, s90, c90, s90)
    for i in range(2 * STAGES):
        store(K, TURNS + i, turns[i])


@inline
def _product(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Return the product of two complex numbers, real parts first."""
    return a * c - b * d, a * d + b * c


@inline
def turned(n: Nutation, real: float, imaginary: float) -> tuple[float, float]:
    """Return z_0' times a complex number, for a nutation to speak of, or 0."""
    p, q = _product(n.p, n.q, real, imaginary)
    none = abs(n.per_rate) <= 0.0
    return where(none, 0.0, p), where(none, 0.0, q)


@inline
def moved(x: State, s: State, p: float, q: float, n: Nutation) -> State:
    """Return `x` with p and q added, and the turns i w times smaller, from the attitude of `s`."""
    a, b = 0.5 * q * n.per_rate, -0.5 * p * n.per_rate  # half the turns about x and y
    return State(
        x.X,
        x.Y,
        x.Z,
        x.VX,
        x.VY,
        x.VZ,
        x.e0 - (s.e1 * a + s.e2 * b),
        x.e1 + (s.e0 * a - s.e3 * b),
        x.e2 + (s.e0 * b + s.e3 * a),
        x.e3 + (s.e1 * b - s.e2 * a),
        x.p + p,
        x.q + q,
        x.r,
        x.sigma,
    )


@inline
def forget(s: State, K: FloatArray) -> None:
    """Write that there was no step before."""
    for i in range(5):
        store(K, MEMORY + i, 0.0 * s.X)


@inline
def remember(s: State, end: State, h: float, accepted: bool, plant: Plant, K: FloatArray) -> None:
    """Make the end of an accepted step the beginning of the next, and keep how its moments change.

    The rate of change of (L, M) / I_x at the end is that of the step, and the share of its change
    since the step before.

    Args:
        s: State at the beginning of the step.
        end: State at its end.
        h: Its length [s].
        accepted: Else nothing is written.
        plant: Constants of the flight.
        K: Rates of change of the step; its memory is that of the step before.
    """
    a, b = rate(K, 0), rate(K, STAGES - 1)
    ratio = plant.I_z / plant.I_x
    per_h = 1.0 / max(h, 1e-9)
    L = (b.p + ratio * end.r * end.q - a.p - ratio * s.r * s.q) * per_h
    M = (b.q - ratio * end.r * end.p - a.q + ratio * s.r * s.p) * per_h
    last_h = element(K, MEMORY + 4)
    share = where(last_h > 0.0, h / max(h + last_h, 1e-9), 0.0)
    next_L = L + share * (L - element(K, MEMORY + 2))
    next_M = M + share * (M - element(K, MEMORY + 3))
    memory = (next_L, next_M, L, M, h)
    for i in range(5):
        store(K, MEMORY + i, where(accepted, memory[i], element(K, MEMORY + i)))
    for i in range(len(a)):
        store(K, i, where(accepted, b[i], a[i]))
