"""What programs write: files whole or not at all, and text on stdout without tracebacks."""

from collections.abc import Iterator
from contextlib import contextmanager
import io
import os
from pathlib import Path
import signal
import sys
import threading

from disc_sim_ros import files
from disc_sim_ros.errors import ConfigError, DiscSimError


def check_writable(flag: str, name: str) -> None:
    """Refuse a file that cannot be written, before any work is done for it.

    Raises:
        ConfigError: It is a folder, or its folder is missing or closed.
    """
    try:
        path = Path(name)
        if path.is_dir() or not path.name:
            raise ConfigError(flag, name, 'give the name of a file, this is a folder')
        folder = path.resolve().parent
        if not folder.is_dir():
            raise ConfigError(flag, name, f'the folder {folder} does not exist')
        needed = [path] if path.exists() else []
        if not _is_special(path):
            needed.append(folder)  # the new file is made there before it replaces the older
        for thing in needed:
            if not os.access(thing, os.W_OK):
                raise ConfigError(flag, name, f'no permission to write {thing}')
    except (OSError, RuntimeError) as error:  # a name too long; links in a circle
        reason = getattr(error, 'strerror', None) or 'its links go in a circle'
        raise ConfigError(flag, name, f'cannot write it ({reason})') from None


def write_whole(flag: str, name: str, content: bytes) -> None:
    """Write a file; an older one of that name stays untouched until the new one is complete.

    Raises:
        ConfigError: The system refuses (no space, no permission, ...); the older file is whole.
    """
    try:
        if _is_special(Path(name)):  # nothing to keep whole
            Path(name).write_bytes(content)
        else:
            files.write_whole(Path(name).resolve(), content, keep_mode=True)
    except OSError as error:
        raise ConfigError(flag, name, f'cannot write it ({error.strerror})') from None


def show(text: str) -> None:
    """Print text that ends the work of a program.

    A reader who has gone away, as `head` does, ends the program as SIGPIPE would.

    Raises:
        DiscSimError: The system refuses, for instance for lack of space.
    """
    try:
        print(text, flush=True)
    except BrokenPipeError:
        _discard_stdout()
        sys.exit(128 + signal.SIGPIPE)
    except OSError as error:
        _discard_stdout()
        raise DiscSimError(f'cannot write to stdout ({error.strerror})') from None


def mend_streams() -> None:
    """Let stdout and stderr take any text, also where the caller closed them."""
    for name in ('stdout', 'stderr'):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, io.StringIO())  # nobody reads it
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')


@contextmanager
def ended_by_ctrl_c() -> Iterator[None]:
    """Let Ctrl-C end the program at once; compiled code does not look for it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)


def _is_special(path: Path) -> bool:
    """Say whether `path` is a pipe, a terminal or another device."""
    return path.exists() and not path.is_file()


def _discard_stdout() -> None:
    """Give what is left in the buffer of stdout, which Python writes when it ends, to nobody."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
