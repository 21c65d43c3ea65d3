"""Folders in the virtual environment that the first test run makes and later ones find."""

from collections.abc import Callable
import fcntl
import hashlib
from pathlib import Path
import shutil
import sys


def made_once(name: str, content: bytes, make: Callable[[Path], None]) -> Path:
    """Return a folder in the cache of this environment, made now or by an earlier test run.

    Args:
        name: What is in it; the name of the folder begins with it.
        content: What it is made from. Another content has another folder.
        make: Fills the empty folder. If it fails, the next call makes the folder again.
    """
    cache = Path(sys.prefix) / 'cache'
    cache.mkdir(exist_ok=True)
    folder = cache / f'{name}_{hashlib.sha256(content).hexdigest()[:16]}'
    with folder.with_suffix('.lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # two test runs may come at once
        if not (folder / 'ready').exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            make(folder)
            (folder / 'ready').touch()
    return folder
