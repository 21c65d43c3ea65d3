"""Output of programs: files, complete or not at all, and text on stdout and stderr."""

import argparse
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
import io
import os
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from disc_sim_ros import files
from disc_sim_ros.cli.arguments import path
from disc_sim_ros.errors import ConfigError, DiscSimError, printable
from disc_sim_ros.units import SYSTEMS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLOTS = ('png', 'svg', 'pdf')


def check_outputs(chosen: argparse.Namespace) -> None:
    """Refuse every file and folder that a program cannot write, before it begins its work.

    A parser names them with `set_defaults(outputs={dest: check})`: the `dest` of a flag, and a
    function that takes its value.

    Raises:
        ConfigError: As of the checks.
    """
    checks: Mapping[str, Callable[[str], None]] = getattr(chosen, 'outputs', {})
    for dest, check in checks.items():
        value = getattr(chosen, dest, None)
        if value is not None and value is not False:
            check(value)


def add_units(group: argparse._ActionsContainer) -> None:
    """Add the flag `--units`; its value is a key of `units.SYSTEMS`."""
    group.add_argument(
        '--units',
        choices=tuple(SYSTEMS),
        default='metric',
        help='of what is printed, of plots and pages: m, m/s, rad/s or ft, mph, rpm; data files '
        'and JSON keep SI units',
    )


def add_plot(group: argparse._ActionsContainer) -> None:
    """Add the flag `--plot`."""
    group.add_argument(
        '--plot',
        type=path,
        default=argparse.SUPPRESS,
        metavar='FILE.png',
        help='also write a plot; the name ends in .png, .svg or .pdf',
    )


def check_plot(name: str) -> None:
    """Refuse a plot that cannot be written, before any work is done for it.

    Raises:
        ConfigError: The ending names no format, or as of `check_writable`.
    """
    if _ending(name) not in PLOTS:
        raise ConfigError('--plot', name, 'the name must end in .png, .svg or .pdf')
    check_writable('--plot', name)


def write_plot(name: str, figure: 'Figure') -> None:
    """Write the file of `--plot`.

    Raises:
        ConfigError: As of `write_whole`.
    """
    from disc_sim_ros.analysis import plots  # noqa: PLC0415 - matplotlib takes half a second

    write_whole('--plot', name, plots.image(figure, _ending(name)))


def check_writable(flag: str, name: str) -> None:
    """Refuse a file that cannot be written, before any work is done for it.

    Raises:
        ConfigError: `name` is a folder, or its folder is missing or read-only.
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
            needed.append(folder)  # the new file is made there before it replaces the old one
        for thing in needed:
            if not os.access(thing, os.W_OK):
                raise ConfigError(flag, name, f'no permission to write {thing}')
    except (OSError, RuntimeError) as error:  # a name too long; links in a circle
        reason = getattr(error, 'strerror', None) or 'its links go in a circle'
        raise ConfigError(flag, name, f'cannot write it ({reason})') from None


def write_whole(flag: str, name: str, content: bytes) -> None:
    """Write a file; an existing one stays untouched until the new one is complete.

    Raises:
        ConfigError: The system refuses (no space, no permission, ...); the old file is unchanged.
        ClosedStdoutError: It is a pipe whose reader has closed it.
    """
    try:
        if _is_special(Path(name)):  # it cannot be replaced
            Path(name).write_bytes(content)
        else:
            files.write_whole(Path(name).resolve(), content, keep_mode=True)
    except BrokenPipeError:  # /dev/stdout, whose reader has read enough
        raise ClosedStdoutError from None
    except OSError as error:
        raise ConfigError(flag, name, f'cannot write it ({error.strerror})') from None


class ClosedStdoutError(Exception):
    """The reader of stdout has closed it, as `head` does after its last line."""


def show(text: str) -> None:
    """Print text to stdout at once.

    Raises:
        ClosedStdoutError: The reader has closed stdout.
        DiscSimError: The system refuses, for instance for lack of space.
    """
    with _one_line_errors():
        print(printable(text, lines=True), flush=True)


def note(prog: str, text: str) -> None:
    """Write one line to stderr, after the name of the program."""
    sys.stderr.write(f'{prog}: {printable(text)}\n')


@contextmanager
def flushed_stdout() -> Iterator[None]:
    """Flush stdout at the end of the block, where its errors can still be reported.

    Raises:
        ClosedStdoutError: The reader has closed stdout.
        DiscSimError: The system refuses, for instance for lack of space.
    """
    try:
        yield
    finally:
        with _one_line_errors():
            sys.stdout.flush()


def mend_streams() -> None:
    """Make stdout and stderr accept any text, also where the caller closed them."""
    for name in ('stdout', 'stderr'):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, io.StringIO())  # discarded
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')


def _ending(name: str) -> str:
    return Path(name).suffix.removeprefix('.').lower()


def _is_special(path: Path) -> bool:
    """Return True if `path` is a pipe, a terminal or another device."""
    return path.exists() and not path.is_file()


@contextmanager
def _one_line_errors() -> Iterator[None]:
    """Translate errors of stdout, and discard the rest of its buffer."""
    try:
        yield
    except OSError as error:
        # Python writes the rest of the buffer when it ends, and would fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            raise ClosedStdoutError from None
        raise DiscSimError(f'cannot write to stdout ({error.strerror})') from None
