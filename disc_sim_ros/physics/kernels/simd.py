"""One source of the equations, for one disc or for WIDTH discs in SIMD registers.

A compiled function takes a SIMD vector, one float in each of WIDTH lanes, wherever it takes a
float. `+ - * /`, comparisons, `min`, `max`, `abs`, `math.sqrt` and the functions below act on all
lanes at once, and each lane is rounded as a single float is: both give the same bits. `if` does
not act on lanes. Use `where` in its place and, around rare work, `if any_of(...)`.

These are the functions that plain Python runs. `simd_numba` tells numba how to compile them, for
floats and for vectors.
"""

import math
from typing import Any

from disc_sim_ros.arrays import FloatArray

WIDTH = 8  # lanes; a multiple of 8


def where(condition: Any, a: Any, b: Any) -> Any:
    """Return `a` where the condition holds, else `b`; both are computed."""
    return a if condition else b


def any_of(condition: Any) -> bool:
    """Return True if the condition holds in any lane."""
    return bool(condition)


def floor(x: Any) -> Any:
    """Return the greatest whole number up to `x`, as a float."""
    return float(math.floor(x))


def element(row: FloatArray, j: int) -> Any:
    """Return element `j` of an array of shape (n,), or row `j` of shape (n, WIDTH) as a vector."""
    return row[j]


def store(array: FloatArray, i: int, vector: Any) -> None:
    """Write element `i` of an array of shape (n,), or a vector to row `i` of (n, WIDTH)."""
    array[i] = vector


def at(table: FloatArray, i: Any, j: Any) -> Any:
    """Return an element of an array of shape (m, n); `i` and `j` are whole floats."""
    return table[int(i), int(j)]


def table_row(table: FloatArray, i: Any) -> tuple[Any, ...]:
    """Return row `i`, a whole float, of an array of shape (n, 8).

    For a vector `i`, each lane has a table of its own; shape (n, 8 WIDTH), side by side.
    """
    r = table[int(i)]
    return r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7]
