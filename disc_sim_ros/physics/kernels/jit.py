"""The one door to numba: every compiled function is compiled by a decorator of this module.

(`simd_numba` tells numba how to compile SIMD vectors, and `native` calls of C functions;
`code_cache` keeps machine code on disk.)

Without numba, or with NUMBA_DISABLE_JIT=1, each decorator returns the plain Python function: the
same equations, some hundred times slower.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
import sys
from typing import Any, TypeVar

import numpy as np


@contextmanager
def _without_scipy() -> Iterator[None]:
    """Let the block import numba, which imports scipy only to check its version, without scipy.

    `from disc_sim_ros import fly` then does not import scipy, which flights do not need.
    """
    if 'scipy' in sys.modules:
        yield
        return
    sys.modules['scipy'] = None  # type: ignore[assignment]  # an import of it then fails
    try:
        yield
    finally:
        del sys.modules['scipy']


COMPILED = False
NUMBA_ERROR = ''  # why numba cannot be used; '' where it can, or is switched off
try:
    with _without_scipy():
        import numba
        import numba.extending

    if not numba.config.DISABLE_JIT:
        from disc_sim_ros.physics.kernels import code_cache, simd_numba  # noqa: F401

        COMPILED = True
except Exception as error:  # it is missing, or does not fit this numpy: that can raise anything
    NUMBA_ERROR = f'{type(error).__name__}: {error}'

F = TypeVar('F', bound=Callable[..., Any])

# Compiled functions work in the arrays of their caller: they allocate none, and count no
# references. Counting them, at each use of a table, would take a third of the time of a flight.
_OPTIONS: dict[str, Any] = {'error_model': 'numpy', 'nogil': True, '_nrt': False}


def inline(function: F) -> F:
    """Compile a function into each compiled function that calls it; Python calls it as it is."""
    if COMPILED:
        numba.extending.register_jitable(forceinline=True, **_OPTIONS)(function)
    return function


def by_type(of_tuple: F, otherwise: F) -> F:
    """Return a function that is one of two, by the type of its last argument, when it is compiled.

    Args:
        of_tuple: What it is where that argument is a tuple; plain Python.
        otherwise: What it is for an array; plain Python, with the same names of arguments.
    """

    def chosen(*arguments: Any) -> Any:
        return (of_tuple if isinstance(arguments[-1], tuple) else otherwise)(*arguments)

    if COMPILED:
        options = {'forceinline': True, **_OPTIONS}

        @numba.extending.overload(chosen, jit_options=options, strict=False)  # type: ignore[untyped-decorator]
        def choose(*kinds: Any) -> Any:
            return of_tuple if isinstance(kinds[-1], numba.types.BaseTuple) else otherwise

    return _typed(chosen, of_tuple)


def jit(function: F) -> F:
    """Compile a function that compiled functions call."""
    return _typed(numba.njit(**_OPTIONS)(function), function) if COMPILED else function


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
        compiled = numba.njit(**_OPTIONS)(function)
        code_cache.enable(compiled, sources)
        return _typed(compiled, function)

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
    if not COMPILED or not isinstance(function, numba.core.dispatcher.Dispatcher):
        return True
    folder = function.stats.cache_path
    name = function.py_func.__name__
    on_disk = folder is not None and any(Path(folder).glob(f'*.{name}-*.nbc'))
    return on_disk or bool(function.signatures)


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
