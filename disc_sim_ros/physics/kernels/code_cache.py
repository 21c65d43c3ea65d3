"""The cache of machine code on disk. What is read from it is checked first.

numba keys its cache on the source file of the outermost function alone: after a change of the
equations in another file it would fly the old ones. The cache therefore lives in a folder that is
named after a digest of all sources in this folder. A change elsewhere keeps the machine code.

numba reads its files with pickle. An empty or torn file, after a power cut or from a full disk,
raises an error at every start; a changed byte could fly anything. Here the machine code carries a
checksum, and what cannot be read or does not match is discarded and compiled again.
"""

from collections.abc import Sequence
import contextlib
import hashlib
import logging
import os
from pathlib import Path
import pickle
import shutil
import sys
import time
from typing import Any

import llvmlite  # type: ignore[import-untyped]
import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.serialize import dumps

_NEEDED = 20 << 20  # bytes of free space; the machine code is about 2 MB
_KEEP_UNUSED_S = 30 * 86400.0  # caches of older sources are removed after a month without use
_LOG = logging.getLogger(__name__)  # without handlers it writes the bare line to stderr


def enable(dispatcher: Any, sources: Sequence[Path] = ()) -> None:
    """Let a compiled function keep its machine code on disk, where there is a place for it.

    Args:
        dispatcher: The function. numba itself notices changes of its file.
        sources: Other files outside this folder whose functions it calls.
    """
    folder = cache_folder()
    if folder is None:
        return  # it is compiled in memory
    if sources:
        digest = hashlib.sha256(b''.join(path.read_bytes() for path in sources))
        folder /= digest.hexdigest()[:16]
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        dispatcher._cache = _CheckedCache(dispatcher.py_func)  # noqa: SLF001 - as enable_caching()
    finally:
        numba.config.CACHE_DIR = before


def cache_folder() -> Path | None:
    """Return the writable cache folder of these very sources, or None where there is none."""
    home = os.environ.get('NUMBA_CACHE_DIR') or os.environ.get('XDG_CACHE_HOME')
    try:
        if not home and not Path.home().is_dir():
            return None  # a home directory is never made
        base = Path(home) if home else Path.home() / '.cache'
        folder = base / 'disc_sim_ros' / SOURCE_DIGEST
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            _remove_unused(folder.parent)
        elif time.time() - folder.stat().st_mtime > _KEEP_UNUSED_S / 2:
            folder.touch()
        usable = os.access(folder, os.W_OK) and shutil.disk_usage(folder).free > _NEEDED
    except (OSError, RuntimeError):  # not writable, or no home at all
        return None
    return folder if usable else None


def _remove_unused(base: Path) -> None:
    for folder in base.iterdir():
        if time.time() - folder.stat().st_mtime > _KEEP_UNUSED_S:
            shutil.rmtree(folder, ignore_errors=True)


def source_digest(folder: Path) -> str:
    """Return a short digest of all Python sources in a folder, and of what compiles them."""
    compilers = f'{numba.__version__} {llvmlite.__version__} {sys.version}'
    digest = hashlib.sha256(compilers.encode())
    for path in sorted(folder.glob('*.py')):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


SOURCE_DIGEST = source_digest(Path(__file__).parent)


class _CheckedCode(CompileResultCacheImpl):  # type: ignore[misc]
    """Machine code as numba stores it, with a checksum of its bytes."""

    def reduce(self, cres: Any) -> tuple[bytes, bytes]:
        """Return the checksum and the bytes of a compiled function."""
        code = dumps(super().reduce(cres))
        return hashlib.sha256(code).digest(), code

    def rebuild(self, target_context: Any, payload: tuple[bytes, bytes]) -> Any:
        """Return the compiled function of what `reduce` returned.

        Raises:
            ValueError: The bytes do not match their checksum.
        """
        checksum, code = payload
        if hashlib.sha256(code).digest() != checksum:
            raise ValueError('wrong checksum')
        return super().rebuild(target_context, pickle.loads(code))  # noqa: S301 - checked


class _CheckedCache(FunctionCache):  # type: ignore[misc]
    """numba's cache of one function, which never raises: damage and full disks cost time only."""

    _impl_class = _CheckedCode

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled function of a signature; None where it must be compiled.

        The method of numba first loads all that a compilation needs, scipy too: half a second.
        Machine code needs none of it, and a compilation loads it itself.
        """
        try:
            return self._load_overload(sig, target_context)
        except Exception as error:  # a damaged pickle can raise nearly anything
            _LOG.warning(
                '%s: damaged machine code (%s: %s) is discarded, and compiled again in about 10 s',
                self.cache_path, type(error).__name__, error,
            )  # fmt: skip
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled function of a signature, if the disk takes it."""
        try:
            super().save_overload(sig, data)
        except Exception as error:  # a full disk, or an index that is damaged once more
            _LOG.warning('%s: cannot keep machine code: %s', self.cache_path, error)
