"""Files that programs write: whole or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import shutil
import sys

from disc_sim_ros.core.errors import ConfigError


def check_writable(flag: str, name: str) -> None:
    """Refuse a file that cannot be written, before any work is done for it.

    Raises:
        ConfigError: It is a folder, or its folder is missing or closed.
    """
    path = Path(name)
    if path.is_dir() or not path.name:
        raise ConfigError(flag, name, 'give the name of a file, this is a folder')
    folder = path.resolve().parent
    if not folder.is_dir():
        raise ConfigError(flag, name, f'the folder {folder} does not exist')
    writable = path if path.exists() else folder
    if not os.access(writable, os.W_OK):
        raise ConfigError(flag, name, f'no permission to write {writable}')


def write_whole(flag: str, name: str, content: bytes) -> None:
    """Write a file; an older one of that name stays untouched until the new one is complete.

    Raises:
        ConfigError: The system refuses (no space, no permission, ...); the older file is whole.
    """
    path = Path(name).resolve()
    try:
        if path.exists() and not path.is_file():  # a pipe or a device: nothing to keep whole
            path.write_bytes(content)
            return
        part = path.with_name(f'.{path.name}.{os.getpid()}.part')
        try:
            with part.open('xb') as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            if path.exists():
                shutil.copymode(path, part)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise ConfigError(flag, name, f'cannot write it ({error.strerror})') from None


@contextmanager
def quiet_pipe() -> Iterator[None]:
    """End without a traceback when the reader of stdout goes away, as `head` does."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(141)  # as if SIGPIPE had ended it
