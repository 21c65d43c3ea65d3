"""Files that grow by whole pieces: what a write could not finish is taken back."""

import errno
import os
from pathlib import Path
import secrets

from disc_sim_ros.errors import ConfigError


def reason(error: OSError) -> str:
    """Return what the system says, in a few words."""
    return error.strerror or str(error)


class GrowingFile:
    """A new file to which pieces are appended, each whole or not at all."""

    def __init__(self, path: Path) -> None:
        """Make the file; it must not exist yet."""
        self.path = path
        self.size = 0
        self._fd = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR | os.O_CLOEXEC, 0o666)

    def append(self, piece: bytes) -> None:
        """Write a piece at the end.

        Raises:
            OSError: The system refuses; the file is as it was before.
        """
        rest = memoryview(piece)
        try:
            while rest:
                rest = rest[os.write(self._fd, rest) :]
        except OSError:
            os.ftruncate(self._fd, self.size)
            os.lseek(self._fd, self.size, os.SEEK_SET)
            raise
        self.size += len(piece)

    def sync(self) -> None:
        """Wait until the disk has all of it."""
        os.fsync(self._fd)

    def close(self) -> None:
        """Close the file; again does nothing."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1


class Reserve:
    """Room on the disk kept for later: a file without a name, gone with the process."""

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
        """Give the room back; again does nothing."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1
        self.size = 0


def replace(path: Path, text: str) -> None:
    """Write a small file anew; whoever reads it sees the old or the new one, never a part.

    Raises:
        OSError: The system refuses; the old file is untouched.
    """
    part = path.with_name(f'.{path.name}.part')
    try:
        with part.open('wb') as file:
            file.write(text.encode())
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def sync_folder(folder: Path) -> None:
    """Wait until the disk knows the names in a folder."""
    fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)


def new_folder(folder: Path) -> Path:
    """Make the folder of a bag; return its absolute path.

    Raises:
        ConfigError: It exists, or the system refuses.
    """
    try:
        whole = folder.absolute()
        problem = ''
        if not whole.name or whole.name in {'.', '..'}:
            problem = 'give the name of a new folder'
        elif whole.exists() or whole.is_symlink():
            problem = 'it exists already, and is never overwritten'
        else:
            whole.parent.mkdir(parents=True, exist_ok=True)
            whole.mkdir()
    except (OSError, ValueError) as error:
        why = reason(error) if isinstance(error, OSError) else str(error)
        problem = f'the folder cannot be made ({why})'
    if problem:
        raise ConfigError('bag', str(folder), problem)
    return whole
