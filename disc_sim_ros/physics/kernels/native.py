"""C functions and memory by address, for functions that numba compiles.

Import this module only where `jit.COMPILED`. Addresses are integers, arguments of the compiled
function, so that its machine code can be kept on disk. They must be right: nothing checks them.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import intrinsic

_I32, _I64 = ir.IntType(32), ir.IntType(64)


@intrinsic  # type: ignore[untyped-decorator]
def call(_: Any, address: Any, a: Any, b: Any, c: Any, d: Any) -> tuple[Any, Callable[..., Any]]:
    """Call a C function of at most four integers or pointers that returns an int.

    `call(address, a, b, c, d) -> int32`. Where all arguments are passed in registers, as on x86-64
    and 64-bit ARM, a function that takes fewer does not notice the rest.
    """

    def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
        function = ir.FunctionType(_I32, [_I64] * 4).as_pointer()
        return builder.call(builder.inttoptr(values[0], function), values[1:])

    return types.int32(*[types.int64] * 5), generate


def _load(type_: Any, llvm: Any) -> Any:
    """Return an intrinsic that reads a number at any address, aligned or not."""

    @intrinsic  # type: ignore[untyped-decorator]
    def load(_: Any, address: Any) -> tuple[Any, Callable[..., Any]]:
        def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
            place = builder.inttoptr(values[0], llvm.as_pointer())
            return builder.load(place, align=1)

        return type_(types.int64), generate

    return load


load_byte = _load(types.uint8, ir.IntType(8))
load_int32 = _load(types.int32, _I32)
load_float = _load(types.float64, ir.DoubleType())
