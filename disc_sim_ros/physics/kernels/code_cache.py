"""The cache of machine code on disk. What is read from it is checked first.

Machine code of old equations must not fly. The cache therefore lives in a folder that is named
after a digest of all sources in this folder and of what compiles them. A change elsewhere keeps
the machine code, unless it is in the function itself or in a file that it names.

After a power cut or on a full disk a file can be empty or torn. Each file therefore begins with a
checksum, and what does not match is discarded and compiled again.
"""

from collections.abc import Callable, Sequence
import contextlib
import hashlib
import importlib.util
import json
import logging
import os
from pathlib import Path
import shutil
import sys
import time
from typing import Any

import llvmlite  # type: ignore[import-untyped]
import numpy as np

_NEEDED = 20 << 20  # bytes of free space; the machine code is about 2 MB
_KEEP_UNUSED_S = 30 * 86400.0  # caches of older sources are removed after a month without use
_LOG = logging.getLogger(__name__)  # without handlers it writes the bare line to stderr
_HERE = Path(__file__).parent
_END = '.code'  # of the names of files


class Place:
    """Where the machine code of one function is kept."""

    def __init__(self, folder: Path, name: str) -> None:
        """Take a folder, and the beginning of the names of the files of this function."""
        self._folder, self._name = folder, name

    def has_any(self) -> bool:
        """Return True if there is machine code for any kind of arguments."""
        return any(self._folder.glob(f'{self._name}-*{_END}'))

    def _path(self, key: str) -> Path:
        return self._folder / f'{self._name}-{_digest(key.encode())}{_END}'

    def read(self, key: str) -> list[Any] | None:
        """Return what was kept under a key, the description, then object files, or None."""
        path = self._path(key)
        try:
            data = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            self.discard(key, error)
            return None
        checksum, content = data[:32], data[32:]
        if hashlib.sha256(content).digest() != checksum:
            self.discard(key, ValueError('wrong checksum'))
            return None
        head, _, code = content.partition(b'\n')
        description, *lengths = json.loads(head)
        parts = []
        for length in lengths:
            parts.append(code[:length])
            code = code[length:]
        return [description, *parts]

    def write(self, key: str, description: Sequence[Any], code: Sequence[bytes]) -> None:
        """Keep a description and object files under a key, if the disk takes them."""
        head = json.dumps([description, *map(len, code)]).encode()
        content = b''.join([head, b'\n', *code])
        path = self._path(key)
        part = path.with_name(f'{path.name}.{os.getpid()}')
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            part.write_bytes(hashlib.sha256(content).digest() + content)
            part.replace(path)  # whole, also for processes that start now
        except OSError as error:
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)
            _LOG.warning('%s: cannot keep machine code: %s', path.parent, error)

    def discard(self, key: str, error: Exception) -> None:
        """Remove what is kept under a key, and say so."""
        path = self._path(key)
        _LOG.warning(
            '%s: damaged machine code (%s: %s) is discarded, and compiled again in about 10 s',
            path.parent, type(error).__name__, error,
        )  # fmt: skip
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)


def place(function: Callable[..., Any], sources: Sequence[Path] = ()) -> Place | None:
    """Return where the machine code of a function is kept, or None where it stays in memory.

    Args:
        function: The function in plain Python.
        sources: Other files outside this folder whose functions it calls.
    """
    folder = cache_folder()
    if folder is None:
        return None
    own = Path(function.__code__.co_filename)
    files = [*sources] if own.parent == _HERE else [own, *sources]
    if files:
        try:
            folder /= _digest(*(path.read_bytes() for path in files))
        except OSError:  # it is in no file, as in an interactive session
            return None
    return Place(folder, f'{function.__module__.rpartition(".")[2]}.{function.__qualname__}')


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


def has_code() -> bool:
    """Return True if these very sources and compilers have put machine code on disk before."""
    folder = cache_folder()
    return folder is not None and any(folder.rglob(f'*{_END}'))


def source_digest(folder: Path) -> str:
    """Return a short digest of all Python sources in a folder, and of what compiles them."""
    sources = (path.read_bytes() for path in sorted(folder.glob('*.py')))
    return _digest(*_compilers(), *sources)


def _compilers() -> list[bytes]:
    """Return what tells the versions of the compilers, without an import of numba."""
    versions = f'{llvmlite.__version__} {np.__version__} {sys.version}'
    settings = sorted(f'{k}={v}' for k, v in os.environ.items() if k in _SETTINGS)
    result = [versions.encode(), *map(str.encode, settings)]
    with contextlib.suppress(ImportError, ValueError, OSError):
        spec = importlib.util.find_spec('numba')
        if spec is not None and spec.origin:
            origin = Path(spec.origin)
            for path in (origin, origin.with_name('_version.py')):
                result += [path.read_bytes()] if path.is_file() else []
    return result


# Settings of numba that change the machine code.
_SETTINGS = {'NUMBA_OPT', 'NUMBA_CPU_NAME', 'NUMBA_CPU_FEATURES', 'NUMBA_ENABLE_AVX',
             'NUMBA_LOOP_VECTORIZE', 'NUMBA_SLP_VECTORIZE', 'NUMBA_BOUNDSCHECK'}  # fmt: skip


def _digest(*parts: bytes) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()[:16]


SOURCE_DIGEST = source_digest(_HERE)
