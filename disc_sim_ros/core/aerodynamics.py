"""Steady aerodynamic coefficients, eqns 19 to 21 and Fig. 3: scalar functions, compiled."""

import math
from typing import NamedTuple

from disc_sim_ros.core._jit import inline
from disc_sim_ros.core.disc import FloatArray


class Linear(NamedTuple):
    """Straight lines of Fig. 3 as the compiled equations take them; see `disc.LinearAero`."""

    CL_0: float
    CL_alpha: float
    CD_0: float
    CD_alpha: float
    alpha_0: float
    CM_0: float
    CM_alpha: float


@inline
def linear_coefficients(alpha: float, line: Linear) -> tuple[float, float, float]:
    """Return C_Lift, C_Drag and C_M at an angle of attack [rad] by the lines of Fig. 3."""
    d_alpha = alpha - line.alpha_0
    return (
        line.CL_0 + line.CL_alpha * alpha,
        line.CD_0 + line.CD_alpha * d_alpha * d_alpha,
        line.CM_0 + line.CM_alpha * alpha,
    )


@inline
def table_coefficients(alpha: float, table: FloatArray) -> tuple[float, float, float]:
    """Return C_Lift, C_Drag and C_M at an angle of attack [rad], linear between the rows.

    Args:
        alpha: Angle of attack [rad].
        table: Columns alpha [rad], C_Lift, C_Drag, C_M; shape (n, 4). It covers every angle.
    """
    last = len(table) - 2
    share = (alpha - table[0, 0]) / (table[last + 1, 0] - table[0, 0])
    i = min(max(int(share * (last + 1)), 0), last)  # right at once if the rows are even
    while i > 0 and alpha < table[i, 0]:
        i -= 1
    while i < last and alpha >= table[i + 1, 0]:
        i += 1
    f = (alpha - table[i, 0]) / (table[i + 1, 0] - table[i, 0])
    return (
        table[i, 1] + f * (table[i + 1, 1] - table[i, 1]),
        table[i, 2] + f * (table[i + 1, 2] - table[i, 2]),
        table[i, 3] + f * (table[i + 1, 3] - table[i, 3]),
    )


@inline
def spin_coefficients(
    advance_ratio: float, alpha: float, terms: FloatArray
) -> tuple[float, float]:
    """Return the rolling moment and side force coefficients that the spin causes (eqn 21).

    Bilinear, held outside the table, odd in the spin.

    Args:
        advance_ratio: r c / (2 V), of either sign.
        alpha: Angle of attack [rad].
        terms: Rolling moment and side force for positive spin, shape (2, 1 + m, 1 + n): row 0
            holds the angles of attack [rad], column 0 the advance ratios.
    """
    i, f = _place(abs(advance_ratio), terms[0, 1:, 0])
    j, g = _place(alpha, terms[0, 0, 1:])
    sign = math.copysign(1.0, advance_ratio)
    C_L = sign * _bilinear(terms[0, 1:, 1:], i, f, j, g)
    C_Side = sign * _bilinear(terms[1, 1:, 1:], i, f, j, g)
    return C_L, C_Side


@inline
def _bilinear(C: FloatArray, i: int, f: float, j: int, g: float) -> float:
    low: float = C[i, j] + g * (C[i, j + 1] - C[i, j])
    high: float = C[i + 1, j] + g * (C[i + 1, j + 1] - C[i + 1, j])
    return low + f * (high - low)


@inline
def _place(x: float, grid: FloatArray) -> tuple[int, float]:
    """Return the cell of `grid` that holds `x` and how far in it is, 0 to 1 outside too."""
    i = 0
    while i < len(grid) - 2 and x >= grid[i + 1]:
        i += 1
    f = (x - grid[i]) / (grid[i + 1] - grid[i])
    return i, min(max(f, 0.0), 1.0)
