"""Storage of an unfinished sweep: a folder of finished batches that outlives the process.

Each part is a complete Parquet file, or an NPZ file without pyarrow, that appears by a rename; its
digest is beside it. If the process is killed, or the disk is full, or the power fails, only the
batches in progress are lost. The manifest holds the study.
"""

from contextlib import suppress
import fcntl
import hashlib
import json
import os
from pathlib import Path
import re
import shutil
from types import TracebackType
from typing import Any, Self

from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.files import reason, sync_folder, write_whole
from disc_sim_ros.studies import tables
from disc_sim_ros.studies.study import Study, study_differences, study_document

DEFAULT_BATCH = 8192  # flights; half a second on one core, 1 MB
_PART = re.compile(r'(\d{10})\.(parquet|npz)')
_MANIFEST = 'question.json'  # as since 0.1: an older folder must not pass for an empty one


class Parts:
    """The folder FILE.parts of an unfinished sweep; a context manager that holds its lock.

    Args:
        output: The file to make of the parts.
        study: The flights.
        batch: Flights in a part; None for the default, or for that of the sweep to resume.
        resume: Continue an unfinished sweep.
        force: Discard an unfinished sweep.

    Raises:
        ConfigError: There is an unfinished sweep and neither `resume` nor `force` is given, or
            it is of another study, or another process works on it.
        DiscSimError: The folder cannot be made.
    """

    def __init__(
        self, output: Path, study: Study, batch: int | None, *, resume: bool, force: bool
    ) -> None:
        self.output = output
        self.folder = output.with_name(f'{output.name}.parts')
        self.study = study
        self._suffix = tables.part_suffix()
        if force and not resume:
            shutil.rmtree(self.folder, ignore_errors=True)
        manifest = self._manifest()
        if manifest is None:
            self.batch = batch or DEFAULT_BATCH
            self._start()
        else:
            self.batch = self._continue(manifest, batch, resume=resume)
        self._lock = self._acquire_lock()
        self.done = self._complete_parts()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.close(self._lock)

    @property
    def batches(self) -> int:
        """Return the number of all parts."""
        return -(-self.study.size // self.batch)

    @property
    def flights_done(self) -> int:
        """Return the number of flights in the finished parts."""
        return sum(len(range(*self.span(number))) for number in self.done)

    def span(self, number: int) -> tuple[int, int]:
        """Return the first flight of a part and the one after its last."""
        start = number * self.batch
        return start, min(start + self.batch, self.study.size)

    def missing(self) -> list[int]:
        """Return the numbers of the parts that are not finished."""
        return [number for number in range(self.batches) if number not in self.done]

    def path(self, number: int) -> Path:
        """Return the path of a part."""
        return self.folder / f'{number:010d}{self._suffix}'

    def keep(self, number: int, columns: tables.Columns) -> None:
        """Write a finished part.

        Raises:
            DiscSimError: The system refuses, for instance for lack of space.
        """
        content = tables.part_bytes(columns)
        try:
            write_whole(self.path(number), content)
            write_whole(self._digest_path(number), _digest(number, content))
        except OSError as error:
            raise DiscSimError(f'cannot write {self.path(number)} ({reason(error)})') from None
        self.done.add(number)

    def recount(self) -> None:
        """Count the complete parts on disk again, and remove incomplete ones."""
        self.done = self._complete_parts()

    def discard(self) -> None:
        """Remove the folder and all parts."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def join(self) -> None:
        """Join all parts into the output file, and remove them.

        Raises:
            DiscSimError: The system refuses; the parts are kept.
        """
        joined = self.output.with_name(f'{self.output.name}.joining')
        paths = [self.path(number) for number in range(self.batches)]
        try:
            tables.join(paths, joined, self.output.suffix.lower(), self.study)
            joined.replace(self.output)
            sync_folder(self.output.parent)
        except OSError as error:
            with suppress(OSError):
                joined.unlink()
            raise DiscSimError(f'cannot write {self.output} ({reason(error)})') from None
        shutil.rmtree(self.folder, ignore_errors=True)

    def _manifest(self) -> dict[str, Any] | None:
        path = self.folder / _MANIFEST
        try:
            manifest: Any = json.loads(path.read_text(encoding='utf-8'))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, RecursionError) as error:
            allowed = f'cannot read {path} ({error}); --force starts again'
            raise ConfigError('output', str(self.output), allowed) from None
        if isinstance(manifest, dict):
            batch = manifest.get('batch')
            if isinstance(batch, int) and batch >= 1:
                return manifest
        allowed = f'{path} is not as sweep writes it; --force starts again'
        raise ConfigError('output', str(self.output), allowed)

    def _start(self) -> None:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            content = study_document(self.study) | {'batch': self.batch}
            write_whole(self.folder / _MANIFEST, json.dumps(content, indent=1).encode())
        except OSError as error:
            raise DiscSimError(f'cannot write in {self.folder} ({reason(error)})') from None

    def _continue(self, manifest: dict[str, Any], batch: int | None, *, resume: bool) -> int:
        """Return the batch size of the unfinished sweep, if it is one of the same study."""
        stored_batch: int = manifest.pop('batch')
        if not resume:
            allowed = (
                f'{self.folder} holds an unfinished sweep; --resume continues it, --force starts '
                'again'
            )
            raise ConfigError('output', str(self.output), allowed)
        differences = study_differences(manifest, study_document(self.study))
        if batch not in {None, stored_batch}:
            differences.append(f'batch {stored_batch}, now {batch}')
        if differences:
            text = '; '.join(differences[:3]) + ('; ...' if len(differences) > 3 else '')
            allowed = f'the unfinished sweep is of another study: {text}'
            raise ConfigError('resume', str(self.output), allowed)
        return stored_batch

    def _acquire_lock(self) -> int:
        lock = os.open(self.folder / _MANIFEST, os.O_RDONLY)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
            allowed = 'another process works on this sweep at the moment'
            raise ConfigError('output', str(self.output), allowed) from None
        return lock

    def _complete_parts(self) -> set[int]:
        """Return the complete parts, and remove incomplete ones, such as those of a killed run."""
        complete = set()
        for path in self.folder.iterdir():
            match = _PART.fullmatch(path.name)
            number = int(match[1]) if match else -1
            if match and path.suffix != self._suffix:
                pyarrow = 'with' if path.suffix == '.parquet' else 'without'
                allowed = f'{self.folder} was begun {pyarrow} pyarrow: resume it so; or --force'
                raise ConfigError('resume', str(self.output), allowed)
            if match and number < self.batches:
                start, stop = self.span(number)
                if tables.rows_of(path) == stop - start and self._is_as_kept(number):
                    complete.add(number)
                    continue
            if match or path.suffix == '.part':
                path.unlink()
        return complete

    def _digest_path(self, number: int) -> Path:
        return self.folder / f'{number:010d}.sha256'

    def _is_as_kept(self, number: int) -> bool:
        """Return True if a part has the content with which it was written, under its number."""
        try:
            kept = self._digest_path(number).read_bytes()
            return kept == _digest(number, self.path(number).read_bytes())
        except OSError:
            return False


def _digest(number: int, content: bytes) -> bytes:
    return hashlib.sha256(f'{number} '.encode() + content).hexdigest().encode()
