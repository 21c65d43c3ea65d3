"""Finished batches on the way to one file: a folder of parts that outlives the process.

Each part is a whole Parquet file that appears by rename, so that a kill, a full disk or a power
cut costs the batches in flight and nothing else. `question.json` says what they answer.
"""

from contextlib import suppress
import fcntl
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

_PART = re.compile(r'(\d{10})\.parquet')
_MANIFEST = 'question.json'


class Parts:
    """The folder FILE.parts of an unfinished ensemble; a context that holds its lock.

    Args:
        output: The file that it will become.
        question: What the ensemble answers.
        batch: Flights in a part; of a resumed ensemble None takes what it began with.
        resume: Go on with what is there; else there must be nothing.
        force: Throw away what is there.

    Raises:
        ConfigError: Unfinished flights are there and neither is chosen, or they answer another
            question, or another process is at it.
        DiscSimError: The folder cannot be made.
    """

    def __init__(
        self, output: Path, question: Study, batch: int | None, *, resume: bool, force: bool
    ) -> None:
        self.output = output
        self.folder = output.with_name(f'{output.name}.parts')
        self.question = question
        if force and not resume:
            shutil.rmtree(self.folder, ignore_errors=True)
        found = self._manifest()
        if found is None:
            self.batch = batch or DEFAULT_BATCH
            self._begin()
        else:
            self.batch = self._continued(found, batch, resume=resume)
        self._lock = self._locked()
        self.done = self._sound_parts()

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
        """Return how many parts there will be."""
        return -(-self.question.size // self.batch)

    @property
    def flights_done(self) -> int:
        """Return how many flights are finished and kept."""
        return sum(len(range(*self.span(number))) for number in self.done)

    def span(self, number: int) -> tuple[int, int]:
        """Return the first flight of a part and the one after its last."""
        start = number * self.batch
        return start, min(start + self.batch, self.question.size)

    def missing(self) -> list[int]:
        """Return the parts that are not there yet."""
        return [number for number in range(self.batches) if number not in self.done]

    def path(self, number: int) -> Path:
        """Return the file of a part."""
        return self.folder / f'{number:010d}.parquet'

    def keep(self, number: int, columns: tables.Columns) -> None:
        """Write a finished part.

        Raises:
            DiscSimError: The system refuses, for instance for lack of space.
        """
        try:
            write_whole(self.path(number), tables.parquet_bytes(columns))
        except OSError as error:
            raise DiscSimError(f'cannot write {self.path(number)} ({reason(error)})') from None
        self.done.add(number)

    def join(self) -> None:
        """Make the one file of all parts, and remove them.

        Raises:
            DiscSimError: The system refuses; the parts are kept.
        """
        joined = self.output.with_name(f'{self.output.name}.joining')
        paths = [self.path(number) for number in range(self.batches)]
        try:
            tables.join(paths, joined, self.output.suffix.lower(), self.question)
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
            found: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            allowed = f'cannot read {path} ({error}); --force begins anew'
            raise ConfigError('output', str(self.output), allowed) from None
        return found

    def _begin(self) -> None:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            content = study_document(self.question) | {'batch': self.batch}
            write_whole(self.folder / _MANIFEST, json.dumps(content, indent=1).encode())
        except OSError as error:
            raise DiscSimError(f'cannot write in {self.folder} ({reason(error)})') from None

    def _continued(self, found: dict[str, Any], batch: int | None, *, resume: bool) -> int:
        begun = int(found.pop('batch', 0))
        if not resume:
            allowed = (
                f'{self.folder} holds an unfinished one; --resume goes on, --force begins anew'
            )
            raise ConfigError('output', str(self.output), allowed)
        different = study_differences(found, study_document(self.question))
        if batch not in {None, begun}:
            different.append(f'batch {begun}, now {batch}')
        if different:
            text = '; '.join(different[:3]) + ('; ...' if len(different) > 3 else '')
            allowed = f'what was begun differs: {text}'
            raise ConfigError('resume', str(self.output), allowed)
        return begun

    def _locked(self) -> int:
        lock = os.open(self.folder / _MANIFEST, os.O_RDONLY)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
            allowed = 'another process is flying it at this moment'
            raise ConfigError('output', str(self.output), allowed) from None
        return lock

    def _sound_parts(self) -> set[int]:
        """Return the parts that are whole; remove what is not, such as leftovers of a kill."""
        sound = set()
        for path in self.folder.iterdir():
            match = _PART.fullmatch(path.name)
            number = int(match[1]) if match else -1
            if match and number < self.batches:
                start, stop = self.span(number)
                if tables.rows_of(path) == stop - start:
                    sound.add(number)
                    continue
            if match or path.suffix == '.part':
                path.unlink()
        return sound


DEFAULT_BATCH = 8192  # flights: half a second on one core, 1 MB
