"""Files and folders that appear whole or not at all, and stay through a power cut."""

from collections.abc import Iterator
from contextlib import contextmanager
import errno
import os
from pathlib import Path
import secrets
import shutil

from disc_sim_ros.errors import ConfigError


def reason(error: OSError) -> str:
    """Return what the system reports, in a few words."""
    if error.errno:  # libraries put more than that into the message
        return os.strerror(error.errno)
    return next(iter(str(error).splitlines()), type(error).__name__)


# ---- files ----


def write_whole(path: Path, content: bytes, *, keep_mode: bool = False) -> None:
    """Write a file by rename: a reader sees the old content or the new one, never a part.

    Args:
        path: The file. It replaces an older one of that name.
        content: Its bytes, on the disk before the file gets its name.
        keep_mode: Give the new file the permissions of the old one.

    Raises:
        OSError: The system refuses; the old file is untouched.
    """
    part = path.with_name(f'.{secrets.token_hex(8)}.part')
    try:
        with part.open('xb') as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if keep_mode and path.exists():
            shutil.copymode(path, part)
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


class GrowingFile:
    """A new file to which blocks of bytes are appended, each whole or not at all."""

    def __init__(self, path: Path) -> None:
        """Make the file; it must not exist yet."""
        self.path = path
        self.size = 0
        self._fd = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR | os.O_CLOEXEC, 0o666)

    def append(self, block: bytes) -> None:
        """Write a block at the end.

        Raises:
            OSError: The system refuses; the file is as it was before.
        """
        rest = memoryview(block)
        try:
            while rest:
                rest = rest[os.write(self._fd, rest) :]
        except OSError:
            os.ftruncate(self._fd, self.size)
            os.lseek(self._fd, self.size, os.SEEK_SET)
            raise
        self.size += len(block)

    def sync(self) -> None:
        """Wait until the disk has all of it."""
        os.fsync(self._fd)

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1


class Reserve:
    """Room on the disk kept for later: a file without a name, which ends with the process."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._fd = -1
        self.size = 0

    def hold(self, size: int) -> None:
        """Keep at least `size` bytes.

        Raises:
            OSError: There is no such room.
        """
        if size <= self.size:
            return
        if self._fd < 0:
            path = self._folder / f'.{secrets.token_hex(8)}.reserve'
            self._fd = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR | os.O_CLOEXEC, 0o600)
            path.unlink()
        try:
            os.posix_fallocate(self._fd, 0, size)
        except OSError as error:
            if error.errno == errno.ENOSPC:
                raise
            return  # this file system cannot keep room
        self.size = size

    def release(self) -> None:
        """Give the room back; a second call does nothing."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1
        self.size = 0


# ---- folders ----


def sync_folder(folder: Path) -> None:
    """Wait until the disk has the names in a folder."""
    fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)


def check_new_folder(flag: str, folder: Path) -> None:
    """Refuse a folder that exists, before any work is done for it.

    Args:
        flag: What the user calls it in the error, such as 'bag' or 'OUT'.
        folder: Its path.

    Raises:
        ConfigError: It exists, the path has no name of a folder, or the nearest folder above it
            that exists is a file or read-only.
    """
    problem = ''
    try:
        if not folder.absolute().name or folder.name == '..':
            problem = 'give the name of a new folder'
        elif folder.exists() or folder.is_symlink():
            problem = 'it exists already, and is never overwritten'
        else:
            _check_parent(folder)
    except (OSError, ValueError) as error:  # a name too long, or with a NUL
        problem = _not_made(error)
    if problem:
        raise ConfigError(flag, str(folder), problem)


def _check_parent(folder: Path) -> None:
    """Raise the OSError that making a folder with its parents would raise, if it is known."""
    parent = next(path for path in folder.absolute().parents if path.exists())
    if not parent.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR))
    if not os.access(parent, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def new_folder(flag: str, folder: Path) -> Path:
    """Make a folder with its parents; return its absolute path.

    Raises:
        ConfigError: It exists, or the system refuses.
    """
    check_new_folder(flag, folder)
    try:
        path = folder.absolute()
        path.parent.mkdir(parents=True, exist_ok=True)
        path.mkdir()
    except (OSError, ValueError) as error:
        raise ConfigError(flag, str(folder), _not_made(error)) from None
    return path


@contextmanager
def whole_folder(flag: str, folder: Path) -> Iterator[Path]:
    """Give a place to make a folder in; it gets its name when the block ends without an error.

    Yields:
        The path at which to make the folder, with the last name of `folder` already.

    Raises:
        ConfigError: It exists, before or after the work, or its parent cannot be made.
        OSError: It cannot be renamed.
    """
    check_new_folder(flag, folder)
    shelter = folder.absolute().parent / f'.{secrets.token_hex(8)}.part'
    try:
        shelter.mkdir(parents=True)
    except (OSError, ValueError) as error:
        raise ConfigError(flag, str(folder), _not_made(error)) from None
    try:
        made = shelter / folder.name
        yield made
        check_new_folder(flag, folder)  # again: some time has passed
        made.rename(folder)
        sync_folder(folder.absolute().parent)
    finally:
        shutil.rmtree(shelter, ignore_errors=True)


def _not_made(error: Exception) -> str:
    why = reason(error) if isinstance(error, OSError) else str(error)
    return f'the folder cannot be made ({why})'
