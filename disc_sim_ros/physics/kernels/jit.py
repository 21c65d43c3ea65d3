"""The one door to the compiler: every compiled function is marked by a decorator of this module.

A warm start runs the machine code of `machine_code` and imports no compiler. `compiler` imports
numba, and lets it compile what is marked here, where machine code is missing; `simd_numba` tells
numba how to compile SIMD vectors, and `native_numba` calls of C functions. `code_cache` keeps
machine code on disk.

Without numba, or with NUMBA_DISABLE_JIT=1, each decorator returns the plain Python function: the
same equations, some hundred times slower.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
import os
from pathlib import Path
import sys
from typing import Any, NamedTuple, TypeVar

import numpy as np


class Mark(NamedTuple):
    """A function that compiled functions may call."""

    function: Callable[..., Any]
    inline: bool  # it is compiled into each caller
    of_tuple: Callable[..., Any] | None = None  # what it is if its last argument is a tuple ...
    otherwise: Callable[..., Any] | None = None  # ... or an array, if that makes a difference


MARKED: list[Mark] = []
NUMBA_ERROR = ''  # why numba cannot be used; '' where it can, or is switched off


@contextmanager
def _without_scipy() -> Iterator[None]:
    """Let the block import numba, which imports scipy only to check its version, without scipy."""
    if 'scipy' in sys.modules:
        yield
        return
    sys.modules['scipy'] = None  # type: ignore[assignment]  # an import of it then fails
    try:
        yield
    finally:
        del sys.modules['scipy']


def import_compiler() -> None:
    """Import numba and tell it what is marked, for functions that numba.njit compiles.

    Raises:
        Exception: numba is missing, or does not fit this numpy: that can raise anything.
    """
    with _without_scipy():
        import numba  # noqa: F401, PLC0415 - it takes longer than all the rest of a start
    from disc_sim_ros.physics.kernels import compiler  # noqa: PLC0415

    compiler.learn()


def _can_compile() -> bool:
    """Return True if functions are compiled; where machine code is at hand, numba can do it."""
    global NUMBA_ERROR  # noqa: PLW0603 - this is its definition
    if os.environ.get('NUMBA_DISABLE_JIT', '0') not in {'', '0'}:
        return False
    try:
        from disc_sim_ros.physics.kernels import code_cache, machine_code  # noqa: F401, PLC0415

        if 'numba' in sys.modules or not code_cache.has_code():
            with _without_scipy():
                import numba  # noqa: PLC0415

            return not numba.config.DISABLE_JIT
    except Exception as error:
        NUMBA_ERROR = f'{type(error).__name__}: {error}'
        return False
    return True


F = TypeVar('F', bound=Callable[..., Any])
COMPILED = _can_compile()


def inline(function: F) -> F:
    """Compile a function into each compiled function that calls it; Python calls it as it is."""
    MARKED.append(Mark(function, inline=True))
    return function


def by_type(of_tuple: F, otherwise: F) -> F:
    """Return a function that is one of two, by the type of its last argument, when it is compiled.

    Args:
        of_tuple: What it is where that argument is a tuple; plain Python.
        otherwise: What it is for an array; plain Python, with the same names of arguments.
    """

    def chosen(*arguments: Any) -> Any:
        return (of_tuple if isinstance(arguments[-1], tuple) else otherwise)(*arguments)

    MARKED.append(Mark(chosen, True, of_tuple, otherwise))  # noqa: FBT003
    return _typed(chosen, of_tuple)


def jit(function: F) -> F:
    """Compile a function, which compiled functions then call; Python calls it as it is."""
    MARKED.append(Mark(function, inline=False))
    return function


def entry(function: F) -> F:
    """Compile a function that Python calls, and keep its machine code on disk."""
    return entry_with()(function)


def entry_with(*sources: Path) -> Callable[[F], F]:
    """Return `entry` for a function that also calls functions outside this folder.

    Args:
        sources: The files of those functions: a change of one of them costs a compilation.
    """

    def compile_entry(function: F) -> F:
        if not COMPILED:
            return _silent(function)
        from disc_sim_ros.physics.kernels.machine_code import CompiledFunction  # noqa: PLC0415

        return _typed(CompiledFunction(function, sources), function)

    return compile_entry


def _silent(function: F) -> F:
    """Return the plain function, whose overflows give inf without a warning, as compiled ones."""

    @wraps(function)
    def silent(*arguments: Any) -> Any:
        with np.errstate(all='ignore'):
            return function(*arguments)

    return _typed(silent, function)


def is_compiled(function: Callable[..., Any]) -> bool:
    """Return True if a call of `function` (from `entry`) needs no compilation first.

    That is so in plain Python, after this process has compiled it, and if its machine code is on
    disk.
    """
    return bool(getattr(function, 'is_compiled', True))


def note_before(*functions: Callable[..., Any], seconds: int) -> str:
    """Return one line for users on why the next call takes long; '' if it does not.

    Args:
        functions: What the call runs, each from `entry`.
        seconds: How long their compilation takes, about [s].
    """
    if NUMBA_ERROR:
        return (
            f'numba cannot be imported ({NUMBA_ERROR}): flights run in plain Python, hundreds of '
            'times slower; "pip install numba" makes them fast'
        )
    if all(map(is_compiled, functions)):
        return ''
    return f'compiling the equations of motion, once on this machine, about {seconds} s'


def _typed(compiled: object, function: F) -> F:
    """Tell the type checker that compilation keeps the signature."""
    return compiled  # type: ignore[return-value]
