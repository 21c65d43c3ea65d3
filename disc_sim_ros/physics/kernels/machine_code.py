"""Compiled functions as Python calls them, without numba: machine code that is loaded from disk.

A call writes its arguments into one block of memory, in slots of 8 bytes, and the machine code
reads them there, and writes its result behind them. To import numba and to prepare it for a call
would take three times as long as Python and numpy take to start.
"""

from collections.abc import Callable, Sequence
import ctypes
from functools import cache, update_wrapper
import importlib
import logging
import operator
from pathlib import Path
import struct
import threading
from typing import Any, NamedTuple

import llvmlite.binding as llvm  # type: ignore[import-untyped]
import numpy as np

from disc_sim_ros.physics.kernels import code_cache

# The kind of an argument tells which version of a function takes it: 'd' for a float, 'q' for an
# int, '?' for a bool, (class, kinds) for a tuple, and (type, dimensions, layout, read-only) for an
# array.
Kind = Any
_LOG = logging.getLogger(__name__)  # without handlers it writes the bare line to stderr
SLOT = 8  # bytes
_LEAVES: dict[type, str] = {
    float: 'd',
    np.float64: 'd',
    int: 'q',
    np.int64: 'q',
    bool: '?',
}
_flat_kinds: dict[tuple[type, tuple[type, ...]], Kind] = {}  # of tuples without tuples and arrays


class Description(NamedTuple):
    """What is known of machine code besides its bytes."""

    symbol: str  # the function that takes the block of memory
    result: Any  # its kind; for a named tuple (module, name, kinds), for nothing ''
    needs: list[str]  # functions of the C library that it calls


def flatten(value: Any, slots: list[Any]) -> Kind:
    """Append the numbers of an argument to `slots`, and return its kind.

    Raises:
        TypeError: Compiled functions do not take it.
    """
    cls = type(value)
    leaf = _LEAVES.get(cls)
    if leaf is not None:
        slots.append(value)
        return leaf
    if cls is np.ndarray:
        return _flatten_array(value, slots)
    if cls is np.bool_:
        slots.append(bool(value))
        return '?'
    if not issubclass(cls, tuple):
        raise TypeError(f'compiled functions take no {cls.__name__}')
    key = cls, tuple(map(type, value))
    kind = _flat_kinds.get(key)
    if kind is not None:
        slots.extend(value)
        return kind
    kind = cls, tuple([flatten(part, slots) for part in value])
    if all(map(_LEAVES.__contains__, key[1])):
        _flat_kinds[key] = kind
    return kind


def _flatten_array(array: Any, slots: list[Any]) -> Kind:
    memory = array.__array_interface__
    address, read_only = memory['data']
    shape = memory['shape']
    slots.append(address)
    slots.extend(shape)
    layout = 'C'
    if memory['strides'] is not None:
        layout = 'F' if array.flags.f_contiguous else 'A'
    slots.extend(array.strides)
    return memory['typestr'], len(shape), layout, read_only


def slot_format(kind: Kind) -> str:
    """Return the slots of a kind in the notation of `struct`."""
    if isinstance(kind, str):
        return 'd' if kind == 'd' else 'q'
    if isinstance(kind[0], type):
        return ''.join(map(slot_format, kind[1]))
    dimensions: int = kind[1]
    return 'q' * (1 + 2 * dimensions)


class MachineCode:
    """One version of a function, for arguments of some kinds."""

    def __init__(self, kinds: tuple[Kind, ...], about: Description, code: Sequence[bytes]) -> None:
        """Load machine code into memory.

        Args:
            kinds: Kinds of its arguments.
            about: What it takes to call it.
            code: Object files.

        Raises:
            OSError: The C library lacks a function that it calls.
        """
        self._engine = _engine()  # after which LLVM knows the symbols of this process
        for name in about.needs:
            if llvm.address_of_symbol(name) is None:
                raise OSError(f'the C library has no {name}')
        for data in code:
            self._engine.add_object_file(llvm.ObjectFileRef.from_data(data))
        self._engine.finalize_object()
        address = self._engine.get_function_address(about.symbol)
        self.run = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)(address)
        self.kinds = kinds
        self.have_arrays = list(map(_has_arrays, kinds))
        self.arguments = [struct.Struct(f'={slot_format(kind)}') for kind in kinds]
        sizes = [form.size for form in self.arguments]
        self.places = [sum(sizes[:i]) for i in range(len(sizes) + 1)]  # the last of the result
        form, self.result = _reader(about.result, 0)
        self.results = struct.Struct(f'={form}')
        self.size = max(self.places[-1] + self.results.size, SLOT)
        self._idle: list[_Call] = []

    def __call__(self, arguments: tuple[Any, ...]) -> Any:
        """Return the result for arguments, or `_OTHER_KIND` if one is of another kind."""
        try:
            call = self._idle.pop()
        except IndexError:  # all are in use by other threads
            call = _Call(self)
        result = call(arguments)
        self._idle.append(call)
        return result


class _Call:
    """The memory of one call at a time, which holds the arguments of the call before."""

    def __init__(self, code: MachineCode) -> None:
        self._code = code
        self._memory = ctypes.create_string_buffer(code.size)
        self._address = ctypes.addressof(self._memory)
        self._last: list[Any] = [_NOTHING] * len(code.kinds)

    def __call__(self, arguments: tuple[Any, ...]) -> Any:
        """Run the code; other threads go on meanwhile. Only what has changed is written.

        Returns:
            The result, or `_OTHER_KIND` where an argument is of another kind.

        Raises:
            TypeError: Compiled functions do not take an argument.
            RuntimeError: The code ended with an error.
        """
        code, memory, last = self._code, self._memory, self._last
        i = 0
        for argument in arguments:
            if argument is not last[i]:
                slots: list[Any] = []
                if flatten(argument, slots) != code.kinds[i]:
                    return _OTHER_KIND
                code.arguments[i].pack_into(memory, code.places[i], *slots)
                keep = not code.have_arrays[i] or _memory(argument) <= _SMALL
                last[i] = argument if keep else _NOTHING
            i += 1
        if i != len(last):
            return _OTHER_KIND
        if code.run(self._address):
            raise RuntimeError('compiled code failed')
        return code.result(code.results.unpack_from(memory, code.places[-1]))


_NOTHING = object()
_OTHER_KIND = object()
_SMALL = 1 << 16  # bytes of the arrays that a call keeps until the next


def _has_arrays(kind: Kind) -> bool:
    if isinstance(kind, str):
        return False
    return any(map(_has_arrays, kind[1])) if isinstance(kind[0], type) else True


def _memory(value: Any) -> int:
    """Return the memory of the arrays in an argument [bytes]."""
    if isinstance(value, tuple):
        return sum([_memory(part) for part in value if isinstance(part, tuple | np.ndarray)])
    return int(value.nbytes)


@cache
def _target() -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple()


def _engine() -> Any:
    """Return a new place for machine code, whose names other machine code does not see."""
    return llvm.create_mcjit_compiler(llvm.parse_assembly(''), _target().create_target_machine())


@cache
def processor() -> str:
    """Return the name and the features of this processor: code for another may not run."""
    return f'{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}'


def _reader(kind: Any, start: int) -> tuple[str, Callable[[Any], Any]]:
    """Return the slots of a result, and the function that reads it from all numbers.

    Args:
        kind: Its kind.
        start: Place of its first slot among the numbers.
    """
    if kind == '':
        return '', lambda _: None
    if kind == '?':
        return 'q', lambda numbers: bool(numbers[start])
    if isinstance(kind, str):
        return kind, operator.itemgetter(start)
    module, name, parts = kind
    make = getattr(importlib.import_module(module), name)._make if name else tuple
    if all(part in {'d', 'q'} for part in parts if isinstance(part, str)) and not any(
        isinstance(part, list) for part in parts
    ):
        end = start + len(parts)
        return ''.join(parts), lambda numbers: make(numbers[start:end])
    form, readers = '', []
    for part in parts:
        slots, read = _reader(part, start + len(form))
        form += slots
        readers.append(read)
    return form, lambda numbers: make([read(numbers) for read in readers])


class CompiledFunction:
    """A compiled function that Python calls, with machine code for each kind of arguments."""

    def __init__(self, function: Callable[..., Any], sources: Sequence[Path]) -> None:
        """Take a function of arguments that are floats, ints, bools, arrays and tuples of them.

        Args:
            function: The function in plain Python.
            sources: Files outside this folder whose functions it calls.
        """
        update_wrapper(self, function)
        self.function = function
        self.hits = 0  # versions that were found on disk
        self._sources = sources
        self._versions: dict[tuple[Kind, ...], MachineCode] = {}
        self._latest: MachineCode | None = None  # the version that was called last
        self._otherwise: Callable[..., Any] | None = None  # what runs where this cannot be done
        self._lock = threading.Lock()

    def __call__(self, *arguments: Any) -> Any:
        """Call the function; compile it before, if this version is not on disk."""
        code = self._latest
        result = _OTHER_KIND if code is None else code(arguments)
        if result is _OTHER_KIND:
            kinds = tuple([flatten(argument, []) for argument in arguments])
            code = self._versions.get(kinds) or self._load(kinds, arguments)
            if code is None:
                return self._in_memory(arguments)
            self._latest = code
            result = code(arguments)
        return result

    def _in_memory(self, arguments: tuple[Any, ...]) -> Any:
        if self._otherwise is None:
            from disc_sim_ros.physics.kernels import compiler  # noqa: PLC0415 - numba is slow

            self._otherwise = compiler.in_memory(self.function)
        return self._otherwise(*arguments)

    @property
    def is_compiled(self) -> bool:
        """Return True if any version is in memory or on disk."""
        place = code_cache.place(self.function, self._sources)
        return bool(self._versions) or (place is not None and place.has_any())

    def _load(self, kinds: tuple[Kind, ...], arguments: tuple[Any, ...]) -> MachineCode | None:
        """Return the version for some kinds; None where this numba must call it itself."""
        if self._otherwise is not None:
            return None
        with self._lock:
            if kinds in self._versions:
                return self._versions[kinds]
            place = code_cache.place(self.function, self._sources)
            key = f'{kinds} {processor()}'
            version = None
            if place is not None and (entry := place.read(key)) is not None:
                try:
                    about, *code = entry
                    version = MachineCode(kinds, Description(*about), code)
                except OSError as error:
                    place.discard(key, error)
                else:
                    self.hits += 1
            if version is None:
                from disc_sim_ros.physics.kernels import compiler  # noqa: PLC0415 - numba is slow

                try:
                    description, *code = compiler.compile_entry(self.function, arguments)
                except Exception as error:  # it uses parts of numba that are not promised
                    _LOG.warning(
                        '%s: numba compiles it in memory (%s: %s)',
                        self.function.__name__, type(error).__name__, error,
                    )  # fmt: skip
                    return None
                if place is not None:
                    place.write(key, description, code)
                version = MachineCode(kinds, description, code)
            self._versions[kinds] = version
            return version
