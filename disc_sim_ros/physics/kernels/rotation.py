"""Rotations as plain arithmetic, for Python and for the compiled equations alike."""

import math
from typing import Any

from disc_sim_ros.arrays import Vector
from disc_sim_ros.physics.kernels.jit import inline

_TURN = 2.0 * math.pi
Quaternion = tuple[float, float, float, float]


@inline
def quaternion_of_half_angles(
    cphi: float, sphi: float, cthe: float, sthe: float, cpsi: float, spsi: float
) -> Quaternion:
    """Return (e0, e1, e2, e3) from cosine and sine of half the roll, pitch and yaw angles."""
    return (
        cphi * cthe * cpsi + sphi * sthe * spsi,
        sphi * cthe * cpsi - cphi * sthe * spsi,
        cphi * sthe * cpsi + sphi * cthe * spsi,
        cphi * cthe * spsi - sphi * sthe * cpsi,
    )


@inline
def rotation_elements(e0: Any, e1: Any, e2: Any, e3: Any) -> tuple[Any, ...]:
    """Return the nine elements, row by row, of the matrix that takes body to earth components.

    For floats and for arrays. The third column is the disc's z axis in axes 1.
    Source: transpose of paper eqn 2, corrected (docs/deviations.md).
    """
    return (
        1 - 2 * (e2 * e2 + e3 * e3),
        2 * (e1 * e2 - e0 * e3),
        2 * (e1 * e3 + e0 * e2),
        2 * (e1 * e2 + e0 * e3),
        1 - 2 * (e1 * e1 + e3 * e3),
        2 * (e2 * e3 - e0 * e1),
        2 * (e1 * e3 - e0 * e2),
        2 * (e2 * e3 + e0 * e1),
        1 - 2 * (e1 * e1 + e2 * e2),
    )


@inline
def wrapped_angle(angle: float) -> float:
    """Return an angle less whole turns, between -pi and pi [rad]: `math.remainder`, to the bit.

    numba does not compile that function.
    """
    size = abs(angle)
    rest = size % _TURN  # exact
    other = _TURN - rest
    if rest > other:
        rest = -other
    elif rest == other:  # half a turn: the nearest even number of turns
        rest -= 2.0 * (0.5 * (size - rest) % _TURN)
    return math.copysign(1.0, angle) * rest


@inline
def rotated(elements: tuple[float, ...], vector: Vector) -> Vector:
    """Return the product of a matrix, given by its elements row by row, and a vector."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = elements
    u, v, w = vector
    return xx * u + xy * v + xz * w, yx * u + yy * v + yz * w, zx * u + zy * v + zz * w


@inline
def cos_sin_degrees(angle: float) -> tuple[float, float]:
    """Return cosine and sine of an angle in degrees, exact at multiples of 90 degrees.

    The sine of the opposite angle is the exact opposite, so that mirrored launches give mirrored
    flights.
    """
    if angle == 0.0:
        return 1.0, angle
    quarter, rest = divmod(abs(angle), 90.0)
    c, s = math.cos(math.radians(rest)), math.sin(math.radians(rest))
    c, s = ((c, s), (-s, c), (-c, -s), (s, -c))[int(quarter) % 4]
    return c, math.copysign(1.0, angle) * s
