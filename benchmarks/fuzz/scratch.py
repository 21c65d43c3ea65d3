"""A folder in memory, where there is one: targets write thousands of small files."""

import atexit
from pathlib import Path
import shutil
import tempfile

_MEMORY = Path('/dev/shm')  # noqa: S108 - a folder of our own is made in it


def folder() -> Path:
    """Return a new folder that goes with the process."""
    place = Path(tempfile.mkdtemp(prefix='fuzz-', dir=_MEMORY if _MEMORY.is_dir() else None))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return place
