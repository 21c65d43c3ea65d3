"""Steady aerodynamic coefficients, eqns 19 to 21 and Fig. 3, as compiled functions."""

from typing import NamedTuple

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.jit import inline
from disc_sim_ros.physics.kernels.simd import any_of, at, floor, table_row, where


class Linear(NamedTuple):
    """Straight lines of Fig. 3 in the form of the compiled equations; see `disc.LinearAero`."""

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
        table: See `disc.Disc.table_rows`. It covers every angle.
    """
    last = len(table) - 2.0
    rows_per_rad = (last + 1.0) / (table[len(table) - 1, 0] - table[0, 0])
    share = (alpha - table[0, 0]) * rows_per_rad
    i = floor(min(max(0.0, share), last))  # the right row at once if the rows are even
    low, CL, CD, CM, high, CL_alpha, CD_alpha, CM_alpha = table_row(table, i)
    while any_of(((alpha < low) & (i > 0.0)) | ((alpha >= high) & (i < last))):
        i = where(alpha < low, max(i - 1.0, 0.0), where(alpha >= high, min(i + 1.0, last), i))
        low, CL, CD, CM, high, CL_alpha, CD_alpha, CM_alpha = table_row(table, i)
    d_alpha = alpha - low
    return CL + CL_alpha * d_alpha, CD + CD_alpha * d_alpha, CM + CM_alpha * d_alpha


@inline
def spin_coefficients(
    advance_ratio: float, alpha: float, terms: FloatArray
) -> tuple[float, float]:
    """Return the rolling moment and side force coefficients due to spin (eqn 21).

    Bilinear inside the table, constant outside, odd in the spin.

    Args:
        advance_ratio: r c / (2 V), of either sign.
        alpha: Angle of attack [rad].
        terms: Rolling moment and side force for positive spin, shape (2, 1 + m, 1 + n): row 0
            holds the angles of attack [rad], column 0 the advance ratios.
    """
    i, f = _place(abs(advance_ratio), terms[0, 1:, 0])
    j, g = _place(alpha, terms[0, 0, 1:])
    sign = where(advance_ratio < 0.0, -1.0, 1.0)
    C_L = sign * _bilinear(terms[0, 1:, 1:], i, f, j, g)
    C_Side = sign * _bilinear(terms[1, 1:, 1:], i, f, j, g)
    return C_L, C_Side


@inline
def _bilinear(C: FloatArray, i: float, f: float, j: float, g: float) -> float:
    low: float = at(C, i, j) + g * (at(C, i, j + 1.0) - at(C, i, j))
    high: float = at(C, i + 1.0, j) + g * (at(C, i + 1.0, j + 1.0) - at(C, i + 1.0, j))
    return low + f * (high - low)


@inline
def _place(x: float, grid: FloatArray) -> tuple[float, float]:
    """Return the cell of `grid` that contains `x`, and the fraction of the way across it, 0 to 1.

    Outside the grid these are the nearest cell and its nearest edge.
    """
    i, low, high = 0.0, grid[0], grid[1]
    for k in range(1, len(grid) - 1):
        beyond = x >= grid[k]
        i = where(beyond, float(k), i)
        low = where(beyond, grid[k], low)
        high = where(beyond, grid[k + 1], high)
    f = (x - low) / (high - low)
    return i, min(max(f, 0.0), 1.0)
