"""numba, which compiles the equations: imported only when something must be compiled.

What `jit` has marked so far is told to numba by `learn`.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
import gc
from typing import Any

from llvmlite import binding, ir  # type: ignore[import-untyped]
import numba
from numba import types
from numba.core import cgutils, codegen
from numba.core.compiler_lock import global_compiler_lock
from numba.extending import overload, register_jitable, typeof_impl
from numba.np import arrayobj, numpy_support

from disc_sim_ros.physics.kernels import jit, native_numba, simd_numba  # noqa: F401
from disc_sim_ros.physics.kernels.machine_code import CompiledFunction, Description

# Compiled functions work in the arrays of their caller: they allocate none, and count no
# references. Counting them, at each use of a table, would take a third of the time of a flight.
_OPTIONS: dict[str, Any] = {'error_model': 'numpy', 'nogil': True, '_nrt': False}
_WITHOUT_PYTHON = {'no_cpython_wrapper': True, 'no_cfunc_wrapper': True}
_I32, _I64, _F64 = ir.IntType(32), ir.IntType(64), ir.DoubleType()
_LEAVES = {types.float64: 'd', types.int64: 'q', types.boolean: '?'}
_learned = 0


def learn() -> None:
    """Let numba compile the functions that are marked with `inline`, `jit` and `by_type`."""
    global _learned  # noqa: PLW0603 - numba itself has one registry for the process
    while _learned < len(jit.MARKED):
        mark = jit.MARKED[_learned]
        _learned += 1
        options = {**_OPTIONS, **_WITHOUT_PYTHON, 'forceinline': mark.inline}
        if mark.otherwise is None:
            register_jitable(**options)(mark.function)
        else:
            _learn_by_type(mark, options)


def _learn_by_type(mark: 'jit.Mark', options: dict[str, Any]) -> None:
    @overload(mark.function, jit_options=options, strict=False)  # type: ignore[untyped-decorator]
    def choose(*kinds: Any) -> Any:
        return mark.of_tuple if isinstance(kinds[-1], types.BaseTuple) else mark.otherwise


@cache
def _dispatcher(function: Callable[..., Any]) -> Any:
    return numba.njit(**_OPTIONS, **_WITHOUT_PYTHON)(function)


@typeof_impl.register(CompiledFunction)  # type: ignore[untyped-decorator]
def _of_entry(entry: CompiledFunction, _context: Any) -> Any:
    """Let compiled functions call an entry."""
    return types.Dispatcher(_dispatcher(entry.function))


def compile_entry(
    function: Callable[..., Any], arguments: tuple[Any, ...]
) -> tuple[Description, bytes, bytes]:
    """Compile a function for arguments of the types of `arguments`.

    Returns:
        What it takes to call it, and two object files: the function, and one that takes its
        arguments from memory.
    """
    learn()
    dispatcher = _dispatcher(function)
    kinds = tuple(map(numba.typeof, arguments))
    with _without_garbage_collection(), _without_loading():
        dispatcher.compile(kinds)
    compiled = dispatcher.overloads[kinds]
    library = compiled.library
    library._optimize_final_module()  # noqa: SLF001 - as `finalize` does
    code = bytes(library.codegen._tm.emit_object(library._final_module))  # noqa: SLF001
    symbol = f'call.{compiled.fndesc.llvm_func_name}'
    needs = [
        function.name
        for function in library.get_function(compiled.fndesc.llvm_func_name).module.functions
        if function.is_declaration and not function.name.startswith('llvm.')
    ]
    return (
        Description(symbol, _result_kind(compiled.signature.return_type), needs),
        code,
        _caller(symbol, compiled, dispatcher.targetdescr.target_context, kinds),
    )


@contextmanager
def _without_garbage_collection() -> Iterator[None]:
    """Let numba make its many small objects without looking for cycles: a twelfth of the time."""
    on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if on:
            gc.enable()


@contextmanager
def _without_loading() -> Iterator[None]:
    """Let numba translate functions to LLVM's code, and neither optimise nor load them.

    It would do so with each of dozens of functions that go into one entry, and with the entry
    again: a fifth of the time. Other threads wait, as they do while numba compiles.
    """
    replaced = [
        (codegen.JITCodeLibrary, '_optimize_final_module'),
        (codegen.JITCodeLibrary, '_finalize_specific'),
        (codegen.JITCPUCodegen, '_add_module'),
        (codegen.JITCPUCodegen, 'set_env'),
    ]
    with global_compiler_lock:
        methods = [getattr(cls, name) for cls, name in replaced]
        for cls, name in replaced:
            setattr(cls, name, lambda *_: None)
        try:
            yield
        finally:
            for (cls, name), method in zip(replaced, methods, strict=True):
                setattr(cls, name, method)


def in_memory(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function as numba itself compiles and calls it, without `machine_code`."""
    learn()
    compiled: Callable[..., Any] = numba.njit(**_OPTIONS)(function)
    return compiled


def _result_kind(kind: Any) -> Any:
    if kind in _LEAVES:
        return _LEAVES[kind]
    if isinstance(kind, types.NoneType):
        return ''
    cls = getattr(kind, 'instance_class', None)  # of a named tuple
    parts = [_result_kind(part) for part in kind]
    return [cls.__module__, cls.__qualname__, parts] if cls else ['builtins', '', parts]


def _caller(symbol: str, compiled: Any, context: Any, kinds: tuple[Any, ...]) -> bytes:
    """Return the object file of an int32 function that takes the address of the arguments."""
    target = compiled.library.codegen
    module = target._create_empty_module(symbol)  # noqa: SLF001 - with the target of the library
    function = ir.Function(module, ir.FunctionType(_I32, [_I64.as_pointer()]), symbol)
    builder = ir.IRBuilder(function.append_basic_block())
    memory = _Memory(context, builder, function.args[0])
    values = [memory.load(kind) for kind in kinds]
    callee = context.declare_function(module, compiled.fndesc)
    result_type = compiled.signature.return_type
    status, result = context.call_conv.call_function(builder, callee, result_type, kinds, values)
    memory.store(result_type, result)
    builder.ret(status.code)
    parsed = binding.parse_assembly(cgutils.normalize_ir_text(str(module)))
    return bytes(target._tm.emit_object(parsed))  # noqa: SLF001 - the target machine


class _Memory:
    """Emits the code that reads and writes one slot after the other."""

    def __init__(self, context: Any, builder: Any, start: Any) -> None:
        self._context, self._builder, self._start = context, builder, start
        self._slot = 0

    def _next(self) -> Any:
        place = self._builder.gep(self._start, [ir.Constant(_I64, self._slot)])
        self._slot += 1
        return place

    def _whole(self) -> Any:
        return self._builder.load(self._next())

    def load(self, kind: Any) -> Any:
        """Return a value of one of numba's types."""
        builder = self._builder
        if kind == types.float64:
            return builder.load(builder.bitcast(self._next(), _F64.as_pointer()))
        if kind == types.int64:
            return self._whole()
        if kind == types.boolean:
            return builder.icmp_unsigned('!=', self._whole(), ir.Constant(_I64, 0))
        if isinstance(kind, types.Array):
            return self._array(kind)
        return self._context.make_tuple(builder, kind, [self.load(part) for part in kind])

    def _array(self, kind: Any) -> Any:
        builder, context = self._builder, self._context
        array = context.make_array(kind)(context, builder)
        pointer = context.get_data_type(kind.dtype).as_pointer()
        arrayobj.populate_array(
            array,
            data=builder.inttoptr(self._whole(), pointer),
            shape=[self._whole() for _ in range(kind.ndim)],
            strides=[self._whole() for _ in range(kind.ndim)],
            itemsize=ir.Constant(_I64, numpy_support.as_dtype(kind.dtype).itemsize),
            meminfo=None,
        )
        return array._getvalue()  # noqa: SLF001 - as all users of make_array

    def store(self, kind: Any, value: Any) -> None:
        """Write a value of one of numba's types."""
        builder = self._builder
        if kind == types.float64:
            builder.store(value, builder.bitcast(self._next(), _F64.as_pointer()))
        elif kind == types.int64:
            builder.store(value, self._next())
        elif kind == types.boolean:
            builder.store(builder.zext(value, _I64), self._next())
        elif not isinstance(kind, types.NoneType):
            for i, part in enumerate(kind):
                self.store(part, builder.extract_value(value, i))
