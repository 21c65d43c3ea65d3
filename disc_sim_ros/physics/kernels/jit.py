"""The one door to numba: everything that is compiled is compiled through here.

(What numba has to know of `lanes` stands in `simd_intrinsics`.)

With NUMBA_DISABLE_JIT=1 both decorators return the plain Python function.

Numba keys its cache on the file of the outermost function alone, so that a change of the
equations in another file would go on flying the old ones. The cache therefore lives in a folder
named after the digest of all sources of this folder.
"""

from collections.abc import Callable
import hashlib
import os
from pathlib import Path
import shutil
import sys
import time
from typing import Any, TypeVar

import numba

F = TypeVar('F', bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {'error_model': 'numpy', 'nogil': True}
COMPILED = not numba.config.DISABLE_JIT
_NEEDED = 20 << 20  # bytes of free space; the machine code is about 2 MB
_KEEP_UNUSED_S = 30 * 86400.0  # caches of older sources go after a month without use


def inline(function: F) -> F:
    """Compile a scalar function into each place that calls it: arguments cost nothing."""
    return _typed(numba.njit(forceinline=True, **_OPTIONS)(function), function)


def jit(function: F) -> F:
    """Compile a function that compiled functions call."""
    return _typed(numba.njit(**_OPTIONS)(function), function)


def entry(function: F) -> F:
    """Compile a function that Python calls, and keep the machine code on disk."""
    if not COMPILED:
        return function
    folder = _cache_folder()
    if folder is None:
        return _typed(numba.njit(**_OPTIONS)(function), function)
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        return _typed(numba.njit(cache=True, **_OPTIONS)(function), function)
    finally:
        numba.config.CACHE_DIR = before


def is_compiled(function: Callable[..., Any]) -> bool:
    """Say whether calling `function` (from `entry`) needs no compilation first.

    True when plain Python is asked for, when this process has compiled it already or when the
    cache on disk holds it.
    """
    if not isinstance(function, numba.core.dispatcher.Dispatcher):
        return True
    folder = function.stats.cache_path
    name = function.py_func.__name__
    on_disk = folder is not None and any(Path(folder).glob(f'*.{name}-*.nbc'))
    return on_disk or bool(function.signatures)


def _typed(compiled: object, function: F) -> F:
    """Tell the type checker that compiling keeps the signature."""
    return compiled  # type: ignore[return-value]


def _cache_folder() -> Path | None:
    """Return the writable cache folder of these very sources, or None where there is none."""
    home = os.environ.get('NUMBA_CACHE_DIR') or os.environ.get('XDG_CACHE_HOME')
    try:
        base = Path(home) if home else Path.home() / '.cache'
        folder = base / 'disc_sim_ros' / _SOURCE_DIGEST
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            _remove_unused(folder.parent)
        elif time.time() - folder.stat().st_mtime > _KEEP_UNUSED_S / 2:
            folder.touch()
        usable = os.access(folder, os.W_OK) and shutil.disk_usage(folder).free > _NEEDED
    except (OSError, RuntimeError):  # unwritable, or no home at all
        return None
    return folder if usable else None  # without a folder it is compiled in memory


def _remove_unused(base: Path) -> None:
    for folder in base.iterdir():
        if time.time() - folder.stat().st_mtime > _KEEP_UNUSED_S:
            shutil.rmtree(folder, ignore_errors=True)


def source_digest(folder: Path) -> str:
    """Return a short digest of all Python sources of a folder, and of what compiles them."""
    digest = hashlib.sha256(f'{numba.__version__} {sys.version}'.encode())
    for path in sorted(folder.glob('*.py')):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


_SOURCE_DIGEST = source_digest(Path(__file__).parent)
