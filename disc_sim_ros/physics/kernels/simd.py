"""One source of the equations, for one disc or for WIDTH of them side by side.

Compiled functions take lanes, vectors of WIDTH floats, wherever they take a float: `+ - * /`,
comparisons, `min`, `max`, `abs`, `math.sqrt` and the functions below act on all lanes at once,
each lane rounded as that float alone would be. So both give the same bits. What does not act on
lanes is `if`: in its place stands `where` and, around what is seldom needed, `if any_of(...)`.
"""

import math
import operator
from typing import Any

from numba.extending import overload

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.kernels import simd_intrinsics
from disc_sim_ros.physics.kernels.simd_intrinsics import BOOLEAN, FLOAT, LANES, MASK, WIDTH, define

__all__ = ['WIDTH', 'any_of', 'at', 'element', 'floor', 'store', 'table_row', 'where']


def where(condition: Any, a: Any, b: Any) -> Any:
    """Return `a` where the condition holds, else `b`; both are computed."""
    return a if condition else b


def any_of(condition: Any) -> bool:
    """Say whether the condition holds in any lane."""
    return bool(condition)


def floor(x: Any) -> Any:
    """Return the greatest whole number up to `x`, as a float."""
    return float(math.floor(x))


def element(row: FloatArray, j: int) -> Any:
    """Return element `j` of an array of shape (n,); of shape (n, WIDTH), the lanes of its row."""
    return row[j]


def store(array: FloatArray, i: int, lanes: Any) -> None:
    """Write lanes to row `i` of an array of shape (n, WIDTH)."""
    array[i] = lanes


def at(table: FloatArray, i: Any, j: Any) -> Any:
    """Return an element of an array of shape (m, n); `i` and `j` are whole floats."""
    return table[int(i), int(j)]


def table_row(table: FloatArray, i: Any) -> tuple[Any, ...]:
    """Return row `i`, a whole float, of an array of shape (n, 8).

    For lanes, the row of each lane's own table; these stand side by side, shape (n, 8 WIDTH).
    """
    r = table[int(i)]
    return r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7]


for _function in (operator.add, operator.iadd):
    define(_function, LANES, (LANES, LANES), lambda builder, x, y: builder.fadd(x, y))
define(operator.sub, LANES, (LANES, LANES), lambda builder, x, y: builder.fsub(x, y))
define(operator.mul, LANES, (LANES, LANES), lambda builder, x, y: builder.fmul(x, y))
define(operator.truediv, LANES, (LANES, LANES), lambda builder, x, y: builder.fdiv(x, y))
define(operator.neg, LANES, (LANES,), lambda builder, x: builder.fneg(x))
define(abs, LANES, (LANES,), simd_intrinsics.call('fabs'))
define(math.sqrt, LANES, (LANES,), simd_intrinsics.call('sqrt'))
for _count in (2, 3):
    define(max, LANES, (LANES,) * _count, simd_intrinsics.extreme('>'))
    define(min, LANES, (LANES,) * _count, simd_intrinsics.extreme('<'))
for _function, _symbol in (
    (operator.lt, '<'),
    (operator.le, '<='),
    (operator.gt, '>'),
    (operator.ge, '>='),
):
    define(
        _function,
        MASK,
        (LANES, LANES),
        lambda builder, x, y, symbol=_symbol: builder.fcmp_ordered(symbol, x, y),
    )
define(operator.and_, MASK, (MASK, MASK), lambda builder, x, y: builder.and_(x, y))
define(operator.or_, MASK, (MASK, MASK), lambda builder, x, y: builder.or_(x, y))
define(any_of, BOOLEAN, (MASK,), simd_intrinsics.any_bit)
define(any_of, BOOLEAN, (BOOLEAN,), lambda _builder, condition: condition)
for _kind, _condition in ((FLOAT, BOOLEAN), (LANES, MASK)):
    define(floor, _kind, (_kind,), simd_intrinsics.call('floor'))
    define(
        where,
        _kind,
        (_condition, _kind, _kind),
        lambda builder, condition, a, b: builder.select(condition, a, b),
    )


# Numba takes Python functions here, so that lambdas stand around its intrinsics.
@overload(element, strict=False)  # type: ignore[untyped-decorator]
def _element(row: Any, j: Any) -> Any:
    if row.ndim == 2:
        return lambda row, j: simd_intrinsics.load(row, j)  # noqa: PLW0108
    return lambda row, j: row[j]


@overload(store, strict=False)  # type: ignore[untyped-decorator]
def _store(array: Any, i: Any, lanes: Any) -> Any:
    return lambda array, i, lanes: simd_intrinsics.store(array, i, lanes)  # noqa: PLW0108


@overload(at, strict=False)  # type: ignore[untyped-decorator]
def _at(table: Any, i: Any, j: Any) -> Any:
    if LANES in {i, j}:
        return lambda table, i, j: simd_intrinsics.pick(table, i, j)  # noqa: PLW0108
    return at


@overload(table_row, strict=False)  # type: ignore[untyped-decorator]
def _table_row(table: Any, i: Any) -> Any:
    if i == LANES:
        return lambda table, i: simd_intrinsics.pick_row(table, i)  # noqa: PLW0108
    return table_row
