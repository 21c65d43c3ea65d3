"""Tells numba how to compile the functions of `native`."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import lower_builtin, type_callable

from disc_sim_ros.physics.kernels import native

_I32, _I64 = ir.IntType(32), ir.IntType(64)
_CALL = [types.int64] * 5


@type_callable(native.call)  # type: ignore[untyped-decorator]
def _type_call(_context: Any) -> Callable[..., Any]:
    return lambda address, a, b, c, d: types.int32


@lower_builtin(native.call, *_CALL)  # type: ignore[untyped-decorator]
def _call(_context: Any, builder: Any, _signature: Any, values: Any) -> Any:
    function = ir.FunctionType(_I32, [_I64] * 4).as_pointer()
    return builder.call(builder.inttoptr(values[0], function), values[1:])


def _define_load(function: Callable[[int], float], result: Any, llvm: Any) -> None:
    """Let compiled code read a number at any address."""
    type_callable(function)(lambda _context: lambda address: result)

    @lower_builtin(function, types.int64)  # type: ignore[untyped-decorator]
    def emit(_context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        return builder.load(builder.inttoptr(values[0], llvm.as_pointer()), align=1)


_define_load(native.load_byte, types.uint8, ir.IntType(8))
_define_load(native.load_int32, types.int32, _I32)
_define_load(native.load_float, types.float64, ir.DoubleType())
