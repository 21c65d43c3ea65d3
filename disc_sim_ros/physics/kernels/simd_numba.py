"""SIMD vectors for numba: a type that compiled functions take wherever they take a float.

LLVM turns a vector into what the processor has: one register of AVX-512, two of AVX2, or single
numbers. At the end of this file numba learns to compile the functions of `simd`.
"""

from collections.abc import Callable
import math
import operator
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
    overload,
    register_model,
    type_callable,
)

from disc_sim_ros.physics.kernels import simd
from disc_sim_ros.physics.kernels.simd import WIDTH

_F64, _I32, _I64 = ir.DoubleType(), ir.IntType(32), ir.IntType(64)
_FLOATS = ir.VectorType(_F64, WIDTH)
_WHOLE = ir.VectorType(_I64, WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)
_ROW = ir.VectorType(_F64, 8)


class SimdFloats(types.Type):  # type: ignore[misc]
    """WIDTH floats; a number beside a vector stands for WIDTH equal ones."""

    def __init__(self) -> None:
        super().__init__(name=f'SimdFloats({WIDTH})')

    def unify(self, _context: Any, other: types.Type) -> types.Type | None:
        """Return the type that holds both."""
        return self if isinstance(other, types.Number) else None

    def can_convert_from(self, _context: Any, other: types.Type) -> Any:
        """Allow a number where a vector is expected."""
        return Conversion.safe if isinstance(other, types.Number) else None


class SimdMask(types.Type):  # type: ignore[misc]
    """WIDTH truth values: the result of a comparison of vectors."""

    def __init__(self) -> None:
        super().__init__(name=f'SimdMask({WIDTH})')


FLOAT, BOOLEAN, SIMD, MASK = types.float64, types.boolean, SimdFloats(), SimdMask()


@register_model(SimdFloats)
class _FloatsModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, _FLOATS)


@register_model(SimdMask)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, _BITS)


@lower_cast(types.Number, SimdFloats)  # type: ignore[untyped-decorator]
def _vector_of_number(context: Any, builder: Any, kind: Any, _simd: Any, x: Any) -> Any:
    x = context.cast(builder, x, kind, FLOAT)
    one = builder.insert_element(ir.Constant(_FLOATS, ir.Undefined), x, ir.Constant(_I64, 0))
    zeros = ir.Constant(ir.VectorType(_I32, WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(one, one, zeros)


def define(function: Any, result: Any, takes: tuple[Any, ...], emit: Callable[..., Any]) -> None:
    """Let compiled code call `function`.

    Args:
        function: A function or an operator.
        result: numba's type of its result.
        takes: numba's types of its arguments; a number serves as a vector, if one is a vector.
        emit: Emits its code, from an LLVM builder and the values of the arguments.
    """
    vectors = any(isinstance(x, SimdFloats | SimdMask) for x in takes)

    def typed(*given: Any) -> Any:
        fits = len(given) == len(takes) and all(
            x == y or (y in {SIMD, FLOAT} and isinstance(x, types.Number))
            for x, y in zip(given, takes, strict=True)
        )
        same_kind = vectors == any(isinstance(x, SimdFloats | SimdMask) for x in given)
        return signature(result, *takes) if fits and same_kind else None

    typers: dict[int, Callable[..., Any]] = {  # numba inspects their signatures
        1: lambda a: typed(a),  # noqa: PLW0108
        2: lambda a, b: typed(a, b),  # noqa: PLW0108
        3: lambda a, b, c: typed(a, b, c),  # noqa: PLW0108
    }
    type_callable(function)(lambda _context: typers[len(takes)])
    lower_builtin(function, *takes)(
        lambda _context, builder, _signature, values: emit(builder, *values)
    )


def call(name: str) -> Callable[..., Any]:
    """Return an emitter of a call of an LLVM intrinsic, for a number or a vector."""

    def emit(builder: Any, x: Any) -> Any:
        full_name = f'llvm.{name}.{"f64" if x.type == _F64 else f"v{WIDTH}f64"}'
        kind = ir.FunctionType(x.type, [x.type])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, full_name), [x])

    return emit


def extreme(symbol: str) -> Callable[..., Any]:
    """Return an emitter of Python's max ('>') or min ('<'): of equals, the first counts."""

    def emit(builder: Any, first: Any, *others: Any) -> Any:
        for x in others:
            first = builder.select(builder.fcmp_ordered(symbol, x, first), x, first)
        return first

    return emit


def any_bit(builder: Any, mask: Any) -> Any:
    """Emit the test whether any lane of a mask is true."""
    bits = builder.bitcast(mask, ir.IntType(WIDTH))
    return builder.icmp_unsigned('!=', bits, ir.Constant(ir.IntType(WIDTH), 0))


def lane_by_lane(function: Any) -> None:
    """Let a function of one number take a vector, lane after lane: for rare work."""
    type_callable(function)(lambda _context: lambda x: SIMD if x == SIMD else None)

    @lower_builtin(function, SIMD)  # type: ignore[untyped-decorator]
    def emit(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        act = context.get_function(function, signature(FLOAT, FLOAT))
        result = ir.Constant(_FLOATS, ir.Undefined)
        for lane in _lane_numbers():
            x = act(builder, [builder.extract_element(values[0], lane)])
            result = builder.insert_element(result, x, lane)
        return result


for _function in (math.cos, math.sin, math.log):
    lane_by_lane(_function)


def _lane_numbers() -> list[Any]:
    return [ir.Constant(_I64, lane) for lane in range(WIDTH)]


def _row_pointer(context: Any, builder: Any, kinds: Any, array: Any, i: Any) -> Any:
    """Emit the address of row `i` of an array of shape (n, WIDTH)."""
    data = context.make_array(kinds[0])(context, builder, value=array).data
    i = context.cast(builder, i, kinds[1], types.int64)
    row = builder.gep(data, [builder.mul(i, ir.Constant(_I64, WIDTH))])
    return builder.bitcast(row, _FLOATS.as_pointer())


@intrinsic  # type: ignore[untyped-decorator]
def load(_context: Any, array: Any, i: Any) -> Any:
    """Return row `i` of an array of shape (n, WIDTH) as a vector."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.load(_row_pointer(context, builder, signature.args, *values), align=8)

    return SIMD(array, i), emit


@intrinsic  # type: ignore[untyped-decorator]
def store(_context: Any, array: Any, i: Any, vector: Any) -> Any:
    """Write a vector to row `i` of an array of shape (n, WIDTH)."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        row = _row_pointer(context, builder, signature.args, *values[:2])
        x = context.cast(builder, values[2], signature.args[2], SIMD)
        builder.store(x, row, align=8)
        return context.get_dummy_value()

    return types.none(array, i, vector), emit


@intrinsic  # type: ignore[untyped-decorator]
def pick(_context: Any, table: Any, i: Any, j: Any) -> Any:
    """Return the elements of an array of shape (m, n) at vectors `i` and `j` of whole numbers."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        kind = signature.args[0]
        array = context.make_array(kind)(context, builder, value=values[0])
        i, j = (
            builder.fptosi(context.cast(builder, x, t, SIMD), _WHOLE)
            for x, t in zip(values[1:], signature.args[1:], strict=True)
        )
        result = ir.Constant(_FLOATS, ir.Undefined)
        for lane in _lane_numbers():
            place = [builder.extract_element(x, lane) for x in (i, j)]
            x = builder.load(cgutils.get_item_pointer(context, builder, kind, array, place))
            result = builder.insert_element(result, x, lane)
        return result

    return SIMD(table, i, j), emit


@intrinsic  # type: ignore[untyped-decorator]
def pick_row(_context: Any, table: Any, i: Any) -> Any:
    """Return row `i`, a vector of whole numbers, of tables side by side, shape (n, 8 WIDTH).

    Eight numbers are read at once and then transposed, instead of gathered one by one.
    """

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, value=values[0]).data
        wide = ir.Constant(_WHOLE, [8 * WIDTH] * WIDTH)
        starts = builder.mul(builder.fptosi(values[1], _WHOLE), wide)
        starts = builder.add(starts, ir.Constant(_WHOLE, [8 * lane for lane in range(WIDTH)]))
        rows = []
        for lane in _lane_numbers():
            first = builder.gep(data, [builder.extract_element(starts, lane)])
            rows.append(builder.load(builder.bitcast(first, _ROW.as_pointer()), align=8))
        blocks = [_transposed(builder, rows[k : k + 8]) for k in range(0, WIDTH, 8)]
        columns = [_joined(builder, parts) for parts in zip(*blocks, strict=True)]
        return context.make_tuple(builder, signature.return_type, columns)

    return types.UniTuple(SIMD, 8)(table, i), emit


def _shuffled(builder: Any, a: Any, b: Any, order: list[int]) -> Any:
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(_I32, len(order)), order))


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Emit the columns of 8 rows of 8, in three rounds of exchanges."""
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
    """Emit the concatenation of vectors, whose number is a power of two."""
    while len(parts) > 1:
        order = list(range(2 * parts[0].type.count))
        pairs = zip(parts[::2], parts[1::2], strict=True)
        parts = tuple(_shuffled(builder, a, b, order) for a, b in pairs)
    return parts[0]


for _add in (operator.add, operator.iadd):
    define(_add, SIMD, (SIMD, SIMD), lambda builder, x, y: builder.fadd(x, y))
define(operator.sub, SIMD, (SIMD, SIMD), lambda builder, x, y: builder.fsub(x, y))
define(operator.mul, SIMD, (SIMD, SIMD), lambda builder, x, y: builder.fmul(x, y))
define(operator.truediv, SIMD, (SIMD, SIMD), lambda builder, x, y: builder.fdiv(x, y))
define(operator.neg, SIMD, (SIMD,), lambda builder, x: builder.fneg(x))
define(abs, SIMD, (SIMD,), call('fabs'))
define(math.sqrt, SIMD, (SIMD,), call('sqrt'))
for _count in (2, 3):
    define(max, SIMD, (SIMD,) * _count, extreme('>'))
    define(min, SIMD, (SIMD,) * _count, extreme('<'))
for _compare, _symbol in (
    (operator.lt, '<'),
    (operator.le, '<='),
    (operator.gt, '>'),
    (operator.ge, '>='),
):
    define(
        _compare,
        MASK,
        (SIMD, SIMD),
        lambda builder, x, y, symbol=_symbol: builder.fcmp_ordered(symbol, x, y),
    )
define(operator.and_, MASK, (MASK, MASK), lambda builder, x, y: builder.and_(x, y))
define(operator.or_, MASK, (MASK, MASK), lambda builder, x, y: builder.or_(x, y))
define(simd.any_of, BOOLEAN, (MASK,), any_bit)
define(simd.any_of, BOOLEAN, (BOOLEAN,), lambda _builder, condition: condition)
for _kind, _condition in ((FLOAT, BOOLEAN), (SIMD, MASK)):
    define(simd.floor, _kind, (_kind,), call('floor'))
    define(
        simd.where,
        _kind,
        (_condition, _kind, _kind),
        lambda builder, condition, a, b: builder.select(condition, a, b),
    )


# numba expects a Python function here, so each intrinsic is wrapped in a lambda.
@overload(simd.element, strict=False)  # type: ignore[untyped-decorator]
def _element(row: Any, j: Any) -> Any:
    if row.ndim == 2:
        return lambda row, j: load(row, j)  # noqa: PLW0108
    return lambda row, j: row[j]


@overload(simd.store, strict=False)  # type: ignore[untyped-decorator]
def _store(array: Any, i: Any, vector: Any) -> Any:
    if array.ndim == 1:
        return simd.store
    return lambda array, i, vector: store(array, i, vector)  # noqa: PLW0108


@overload(simd.at, strict=False)  # type: ignore[untyped-decorator]
def _at(table: Any, i: Any, j: Any) -> Any:
    if SIMD in {i, j}:
        return lambda table, i, j: pick(table, i, j)  # noqa: PLW0108
    return simd.at


@overload(simd.table_row, strict=False)  # type: ignore[untyped-decorator]
def _table_row(table: Any, i: Any) -> Any:
    if i == SIMD:
        return lambda table, i: pick_row(table, i)  # noqa: PLW0108
    return simd.table_row
