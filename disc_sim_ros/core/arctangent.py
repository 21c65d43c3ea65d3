"""The angle of a vector, in plain arithmetic, so that lanes reckon it as fast as anything else."""

import math

from disc_sim_ros.core._jit import inline
from disc_sim_ros.core.lanes import where

_TAN_22_5, _TAN_67_5 = math.sqrt(2.0) - 1.0, math.sqrt(2.0) + 1.0
_TINY = 1e-300


@inline
def arctangent(y: float, x: float) -> float:
    """Return atan2(y, x) for x >= 0 [rad], to 3e-16; 0 where both are 0 or below 1e-300.

    An angle is reckoned from 0, 45 or 90 degrees, whichever is within 22.5 degrees. There a
    polynomial in t^2 meets (atan(t) / t - 1) / t^2 in the Chebyshev points, within 4e-17 of
    atan(t) / t.
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
