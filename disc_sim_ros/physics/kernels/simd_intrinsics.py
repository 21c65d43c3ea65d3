"""Vectors for numba: a type that compiled functions take wherever they take a float.

LLVM turns them into what the processor has: a register of AVX-512, two of AVX2, or plain numbers.
`lanes` says which functions act on them.
"""

from collections.abc import Callable
import math
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.core.typeconv import Conversion
from numba.core.typing import signature
from numba.extending import (
    intrinsic,
    lower_builtin,
    lower_cast,
    models,
    register_model,
    type_callable,
)

WIDTH = 8  # lanes; a multiple of 8
_F64, _I32, _I64 = ir.DoubleType(), ir.IntType(32), ir.IntType(64)
_FLOATS = ir.VectorType(_F64, WIDTH)
_WHOLE = ir.VectorType(_I64, WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)
_ROW = ir.VectorType(_F64, 8)


class Lanes(types.Type):  # type: ignore[misc]
    """WIDTH floats; where a number stands beside them it stands for WIDTH equal ones."""

    def __init__(self) -> None:
        super().__init__(name=f'Lanes({WIDTH})')

    def unify(self, _context: Any, other: types.Type) -> types.Type | None:
        """Return the type that holds both."""
        return self if isinstance(other, types.Number) else None

    def can_convert_from(self, _context: Any, other: types.Type) -> Any:
        """Say that numbers become lanes where lanes are asked for."""
        return Conversion.safe if isinstance(other, types.Number) else None


class Mask(types.Type):  # type: ignore[misc]
    """WIDTH truth values, of a comparison of lanes."""

    def __init__(self) -> None:
        super().__init__(name=f'Mask({WIDTH})')


FLOAT, BOOLEAN, LANES, MASK = types.float64, types.boolean, Lanes(), Mask()


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, _FLOATS)


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, _BITS)


@lower_cast(types.Number, Lanes)  # type: ignore[untyped-decorator]
def _lanes_of_number(context: Any, builder: Any, kind: Any, _lanes: Any, x: Any) -> Any:
    x = context.cast(builder, x, kind, FLOAT)
    one = builder.insert_element(ir.Constant(_FLOATS, ir.Undefined), x, ir.Constant(_I64, 0))
    zeros = ir.Constant(ir.VectorType(_I32, WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(one, one, zeros)


def define(function: Any, result: Any, takes: tuple[Any, ...], emit: Callable[..., Any]) -> None:
    """Let compiled code call `function`.

    Args:
        function: A function or operator.
        result: Numba type of its result.
        takes: Numba types of its arguments; numbers serve as lanes, but not in place of all.
        emit: Writes it, from an LLVM builder and the values of the arguments.
    """
    vectors = any(isinstance(x, Lanes | Mask) for x in takes)

    def typed(*given: Any) -> Any:
        fits = len(given) == len(takes) and all(
            x == y or (y in {LANES, FLOAT} and isinstance(x, types.Number))
            for x, y in zip(given, takes, strict=True)
        )
        own = vectors == any(isinstance(x, Lanes | Mask) for x in given)
        return signature(result, *takes) if fits and own else None

    typers: dict[int, Callable[..., Any]] = {  # numba looks at their signatures
        1: lambda a: typed(a),  # noqa: PLW0108
        2: lambda a, b: typed(a, b),  # noqa: PLW0108
        3: lambda a, b, c: typed(a, b, c),  # noqa: PLW0108
    }
    type_callable(function)(lambda _context: typers[len(takes)])
    lower_builtin(function, *takes)(
        lambda _context, builder, _signature, values: emit(builder, *values)
    )


def call(name: str) -> Callable[..., Any]:
    """Return what emits a call of an intrinsic of LLVM, of a number or of lanes."""

    def emit(builder: Any, x: Any) -> Any:
        full_name = f'llvm.{name}.{"f64" if x.type == _F64 else f"v{WIDTH}f64"}'
        kind = ir.FunctionType(x.type, [x.type])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, full_name), [x])

    return emit


def extreme(symbol: str) -> Callable[..., Any]:
    """Return what emits Python's max ('>') or min ('<'): the first where none is beyond it."""

    def emit(builder: Any, first: Any, *others: Any) -> Any:
        for x in others:
            first = builder.select(builder.fcmp_ordered(symbol, x, first), x, first)
        return first

    return emit


def any_bit(builder: Any, mask: Any) -> Any:
    """Emit whether any lane of a mask is true."""
    bits = builder.bitcast(mask, ir.IntType(WIDTH))
    return builder.icmp_unsigned('!=', bits, ir.Constant(ir.IntType(WIDTH), 0))


def lane_by_lane(function: Any) -> None:
    """Let a function of one number take lanes, one after the other: for what is seldom needed."""
    type_callable(function)(lambda _context: lambda x: LANES if x == LANES else None)

    @lower_builtin(function, LANES)  # type: ignore[untyped-decorator]
    def emit(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        act = context.get_function(function, signature(FLOAT, FLOAT))
        found = ir.Constant(_FLOATS, ir.Undefined)
        for lane in _lanes():
            x = act(builder, [builder.extract_element(values[0], lane)])
            found = builder.insert_element(found, x, lane)
        return found


for _function in (math.cos, math.sin, math.log):
    lane_by_lane(_function)


def _lanes() -> list[Any]:
    return [ir.Constant(_I64, lane) for lane in range(WIDTH)]


def _row_pointer(context: Any, builder: Any, kinds: Any, array: Any, i: Any) -> Any:
    """Emit the address of row `i` of an array of shape (n, WIDTH)."""
    data = context.make_array(kinds[0])(context, builder, value=array).data
    i = context.cast(builder, i, kinds[1], types.int64)
    row = builder.gep(data, [builder.mul(i, ir.Constant(_I64, WIDTH))])
    return builder.bitcast(row, _FLOATS.as_pointer())


@intrinsic  # type: ignore[untyped-decorator]
def load(_context: Any, array: Any, i: Any) -> Any:
    """Return row `i` of an array of shape (n, WIDTH) as lanes."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.load(_row_pointer(context, builder, signature.args, *values), align=8)

    return LANES(array, i), emit


@intrinsic  # type: ignore[untyped-decorator]
def store(_context: Any, array: Any, i: Any, lanes: Any) -> Any:
    """Write lanes to row `i` of an array of shape (n, WIDTH)."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        row = _row_pointer(context, builder, signature.args, *values[:2])
        x = context.cast(builder, values[2], signature.args[2], LANES)
        builder.store(x, row, align=8)
        return context.get_dummy_value()

    return types.none(array, i, lanes), emit


@intrinsic  # type: ignore[untyped-decorator]
def pick(_context: Any, table: Any, i: Any, j: Any) -> Any:
    """Return the elements of an array of shape (m, n) at whole lanes `i` and `j`."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        kind = signature.args[0]
        array = context.make_array(kind)(context, builder, value=values[0])
        i, j = (
            builder.fptosi(context.cast(builder, x, t, LANES), _WHOLE)
            for x, t in zip(values[1:], signature.args[1:], strict=True)
        )
        found = ir.Constant(_FLOATS, ir.Undefined)
        for lane in _lanes():
            at = [builder.extract_element(x, lane) for x in (i, j)]
            x = builder.load(cgutils.get_item_pointer(context, builder, kind, array, at))
            found = builder.insert_element(found, x, lane)
        return found

    return LANES(table, i, j), emit


@intrinsic  # type: ignore[untyped-decorator]
def pick_row(_context: Any, table: Any, i: Any) -> Any:
    """Return row `i`, whole lanes, of each lane's table; side by side of shape (n, 8 WIDTH).

    Eight numbers are read at once and then transposed, instead of gathered one by one.
    """

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, value=values[0]).data
        wide = ir.Constant(_WHOLE, [8 * WIDTH] * WIDTH)
        starts = builder.mul(builder.fptosi(values[1], _WHOLE), wide)
        starts = builder.add(starts, ir.Constant(_WHOLE, [8 * lane for lane in range(WIDTH)]))
        rows = []
        for lane in _lanes():
            at = builder.gep(data, [builder.extract_element(starts, lane)])
            rows.append(builder.load(builder.bitcast(at, _ROW.as_pointer()), align=8))
        blocks = [_transposed(builder, rows[k : k + 8]) for k in range(0, WIDTH, 8)]
        columns = [_joined(builder, parts) for parts in zip(*blocks, strict=True)]
        return context.make_tuple(builder, signature.return_type, columns)

    return types.UniTuple(LANES, 8)(table, i), emit


def _shuffled(builder: Any, a: Any, b: Any, order: list[int]) -> Any:
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(_I32, len(order)), order))


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Emit the columns of 8 rows of 8, in three rounds of exchange."""
    for half in (1, 2, 4):
        low = [8 + j - half if j & half else j for j in range(8)]
        high = [8 + j if j & half else j + half for j in range(8)]
        rows = [
            _shuffled(builder, rows[i - half], rows[i], high)
            if i & half
            else _shuffled(builder, rows[i], rows[i + half], low)
            for i in range(8)
        ]
    return rows


def _joined(builder: Any, parts: tuple[Any, ...]) -> Any:
    """Emit vectors one behind the other, as one; their number is a power of two."""
    while len(parts) > 1:
        order = list(range(2 * parts[0].type.count))
        pairs = zip(parts[::2], parts[1::2], strict=True)
        parts = tuple(_shuffled(builder, a, b, order) for a, b in pairs)
    return parts[0]
