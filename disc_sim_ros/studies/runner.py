"""Runs a study: batches of flights in threads, processes, Dask or any other executor."""

from collections.abc import Callable, Iterator
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

import numpy as np

from disc_sim_ros.errors import ConfigError, DiscSimError, InterruptedSweepError
from disc_sim_ros.studies import tables
from disc_sim_ros.studies.executors import submitted
from disc_sim_ros.studies.flying import fly_batch
from disc_sim_ros.studies.storage import DEFAULT_BATCH, Parts
from disc_sim_ros.studies.study import Study, study_differences, study_document

_PATIENCE = 60.0  # s, longest wait for batches that fly when a sweep stops
AHEAD = 8  # default of the most batches submitted at a time; 1 MB each

Progress = Callable[[int, int], None]  # finished flights, all flights
Result = Callable[[int, tables.Columns], None]


def sweep(
    study: Study,
    output: str | Path,
    *,
    executor: Executor | None = None,
    threads: int | None = None,
    batch: int | None = None,
    ahead: int = AHEAD,
    resume: bool = False,
    force: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Fly a study into one file, and return its path.

    The flights are the same for any executor, number of workers, batch and number of resumptions.
    Finished batches stay in the folder `output`.parts until all flights are finished.

    Args:
        study: The flights.
        output: File to make, NAME.parquet or NAME.csv.
        executor: Any executor of concurrent.futures, with Dask for instance
            `client.get_executor()`; None for threads of this process. It is left open.
        threads: Threads of this process, without an executor; None for all cores.
        batch: Flights in a batch; None for 8192, or for that of the sweep to resume.
        ahead: Most batches submitted at a time; give twice the number of workers.
        resume: Continue an interrupted sweep; start one if there is none.
        force: Overwrite the file, and discard an unfinished sweep.
        progress: Called with the number of finished flights and the number of all flights.

    Raises:
        ConfigError: The file exists, or holds another study.
        InterruptedSweepError: A worker died; finished flights are kept.
        DiscSimError: The system refuses to write; finished flights are kept.
        KeyboardInterrupt: Ctrl-C; finished flights are kept.
    """
    path = Path(output)
    tables.check_output(path)
    with _opened(path, study, batch, resume=resume, force=force) as parts:
        if parts is None:
            return path
        if progress is not None:
            progress(parts.flights_done, study.size)

        def keep(number: int, columns: tables.Columns) -> None:
            parts.keep(number, columns)
            if progress is not None:
                progress(parts.flights_done, study.size)

        try:
            _Work(study, parts.missing(), parts.span, keep).fly(executor, threads, ahead)
        except BaseException as error:
            # Ctrl-C can come between the last part on disk and the line that counts it.
            parts.recount()
            if isinstance(error, ConfigError) and not parts.flights_done:
                parts.discard()  # the flights are refused: nothing is left on disk
            if progress is not None:
                progress(parts.flights_done, study.size)
            raise
        parts.join()
    return path


def collect(
    study: Study,
    *,
    executor: Executor | None = None,
    threads: int | None = None,
    batch: int = DEFAULT_BATCH,
    ahead: int = AHEAD,
) -> tables.Columns:
    """Fly a study and return its columns, each of shape (flights,), without a file.

    Column names carry units; `status` is an index of `columns.STATUS`.

    Raises:
        InterruptedSweepError: A worker died.
    """
    batches: dict[int, tables.Columns] = {}
    numbers = list(range(-(-study.size // batch)))

    def span(number: int) -> tuple[int, int]:
        return number * batch, min((number + 1) * batch, study.size)

    _Work(study, numbers, span, batches.__setitem__).fly(executor, threads, ahead)
    return {name: np.concatenate([batches[n][name] for n in numbers]) for name in batches[0]}


@contextmanager
def _opened(
    path: Path, study: Study, batch: int | None, *, resume: bool, force: bool
) -> Iterator[Parts | None]:
    """Yield the parts of a sweep to fly, or None if the file is finished already."""
    unfinished = path.with_name(f'{path.name}.parts').exists()
    if path.exists() and not force and not (resume and unfinished):
        if not resume:
            allowed = 'the file exists; --force overwrites it'
            raise ConfigError('output', str(path), allowed)
        stored = tables.stored_study(path)
        differences = ['it holds no study'] if stored is None else _differences(stored, study)
        if differences:
            allowed = f'the file holds another study: {"; ".join(differences[:3])}'
            raise ConfigError('resume', str(path), allowed)
        yield None
        return
    with Parts(path, study, batch, resume=resume, force=force) as parts:
        yield parts


def _differences(stored: dict[str, object], study: Study) -> list[str]:
    return study_differences(stored, study_document(study))


@dataclass(frozen=True)
class _Work:
    """The batches to fly, and the function that takes the result of each."""

    study: Study
    numbers: list[int]
    span: Callable[[int], tuple[int, int]]
    keep: Result

    def fly(self, executor: Executor | None, threads: int | None, ahead: int) -> None:
        """Fly the batches, at most `ahead` at a time.

        Raises:
            InterruptedSweepError: A worker died; finished batches are kept.
        """
        try:
            if executor is not None:
                self._drive(executor, 1, ahead)
                return
            # At most two batches: one is flown on all cores while the other is written.
            with ThreadPoolExecutor(1) as one:
                self._drive(one, threads, min(ahead, 2))
        except Exception as error:
            if isinstance(error, BrokenExecutor | CancelledError) or _is_lost_worker(error):
                raise InterruptedSweepError(f'a worker died ({type(error).__name__})') from error
            raise

    def _drive(self, executor: Executor, threads: int | None, ahead: int) -> None:
        waiting = list(reversed(self.numbers))
        flying: dict[Future[tables.Columns], int] = {}
        finished: SimpleQueue[Future[tables.Columns]] = SimpleQueue()
        try:
            while waiting or flying:
                while waiting and len(flying) < max(ahead, 1):
                    start, stop = self.span(waiting[-1])
                    future = submitted(
                        executor, finished, fly_batch, self.study, start, stop, threads
                    )
                    flying[future] = waiting.pop()
                future = finished.get()
                columns = future.result()
                self.keep(flying.pop(future), columns)
        except BaseException:
            self._keep_finished(flying)
            raise

    def _keep_finished(self, flying: dict[Future[tables.Columns], int]) -> None:
        """Cancel the waiting batches; keep those that have finished, and those that are flying."""
        running = [future for future in flying if not future.cancel()]
        with suppress(DiscSimError):  # for instance a disk that is still full
            # The end of the executor waits for them, too.
            for future in wait(running, timeout=_PATIENCE).done:
                if not future.cancelled() and future.exception() is None:
                    self.keep(flying[future], future.result())


def _is_lost_worker(error: Exception) -> bool:
    """Return True for the errors that Dask raises for a dead worker; Dask may not be installed."""
    return type(error).__name__ in {'KilledWorker', 'FutureCancelledError'}
