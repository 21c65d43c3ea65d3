"""Steady aerodynamic coefficients, eqns 19 to 21 and Fig. 3, as compiled functions."""

from typing import Any, NamedTuple

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels.jit import by_type, inline
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


class Row(NamedTuple):
    """The line between two rows of a table: see `disc.Disc.table_rows`."""

    alpha: float  # rad, here the line begins
    C_Lift: float  # there
    C_Drag: float
    C_M: float
    end: float  # rad, here the line ends
    C_Lift_alpha: float  # slopes [1/rad]
    C_Drag_alpha: float
    C_M_alpha: float


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
def row_of(table: FloatArray, i: float) -> Row:
    """Return row `i`, a whole float, of a table."""
    low, CL, CD, CM, high, CL_alpha, CD_alpha, CM_alpha = table_row(table, i)
    return Row(low, CL, CD, CM, high, CL_alpha, CD_alpha, CM_alpha)


@inline
def search(alpha: float, table: FloatArray) -> tuple[float, Row]:
    """Return the number, a whole float, and the row that holds at an angle of attack [rad]."""
    last = len(table) - 2.0
    rows_per_rad = (last + 1.0) / (table[len(table) - 1, 0] - table[0, 0])
    share = (alpha - table[0, 0]) * rows_per_rad
    i = floor(min(max(0.0, share), last))  # the right row at once if the rows are even
    row = row_of(table, i)
    while any_of(((alpha < row.alpha) & (i > 0.0)) | ((alpha >= row.end) & (i < last))):
        i = where(
            alpha < row.alpha, max(i - 1.0, 0.0), where(alpha >= row.end, min(i + 1.0, last), i)
        )
        row = row_of(table, i)
    return i, row


def _of_row(alpha: float, table: Any) -> Row:
    return table  # type: ignore[no-any-return]


def _of_table(alpha: float, table: Any) -> Row:
    _, row = search(alpha, table)
    return row


_line_at = by_type(_of_row, _of_table)  # the line of a table at an angle; a Row is its own line


@inline
def table_coefficients(alpha: float, table: FloatArray) -> tuple[float, float, float]:
    """Return C_Lift, C_Drag and C_M at an angle of attack [rad], linear between the rows.

    Args:
        alpha: Angle of attack [rad].
        table: See `disc.Disc.table_rows`. It covers every angle. Or one `Row`, whose line then
            holds at every angle.
    """
    row = _line_at(alpha, table)
    d_alpha = alpha - row.alpha
    return (
        row.C_Lift + row.C_Lift_alpha * d_alpha,
        row.C_Drag + row.C_Drag_alpha * d_alpha,
        row.C_M + row.C_M_alpha * d_alpha,
    )


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
