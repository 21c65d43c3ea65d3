"""Flying an ensemble: batches handed to threads, processes, Dask or any other executor."""

from collections.abc import Callable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
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

import numpy as np

from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.studies import tables
from disc_sim_ros.studies.flying import fly_batch
from disc_sim_ros.studies.storage import DEFAULT_BATCH, Parts
from disc_sim_ros.studies.study import Study, study_differences, study_document

AHEAD = 8  # batches that wait or fly at once where nothing else is said; 1 MB each

Progress = Callable[[int, int], None]  # flights finished, flights altogether
Result = Callable[[int, tables.Columns], None]


class InterruptedSweepError(DiscSimError):
    """Flights could not be finished; those that were are kept, and a resumed run goes on."""


def sweep(
    question: Study,
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
    """Fly an ensemble into one file, and return its path.

    The flights are the same for any executor, number of workers, batch and number of resumptions.
    Until the last has landed, finished batches are in the folder `output`.parts.

    Args:
        question: What is flown.
        output: File to make, NAME.parquet or NAME.csv.
        executor: Any executor of concurrent.futures, of Dask for instance `client.get_executor()`;
            None for threads of this process. It is left open.
        threads: Threads of this process without an executor; None for all cores.
        batch: Flights that are handed out at a time; None for 8192, or what was begun with.
        ahead: Most batches that are handed out and not yet back; give twice the workers.
        resume: Go on with a sweep that was interrupted; begin one if there is none.
        force: Overwrite the file, and throw away an unfinished sweep.
        progress: Called with the flights finished and the flights altogether.

    Raises:
        ConfigError: The file exists, or holds another question.
        InterruptedSweepError: A worker died; what is finished is kept.
        DiscSimError: The system refuses to write; what is finished is kept.
        KeyboardInterrupt: Ctrl-C; what is finished is kept.
    """
    path = Path(output)
    if path.suffix.lower() not in tables.SUFFIXES:
        raise ConfigError('output', str(output), 'the name must end in .parquet or .csv')
    with _opened(path, question, batch, resume=resume, force=force) as parts:
        if parts is None:
            return path
        if progress is not None:
            progress(parts.flights_done, question.size)

        def keep(number: int, columns: tables.Columns) -> None:
            parts.keep(number, columns)
            if progress is not None:
                progress(parts.flights_done, question.size)

        _Work(question, parts.missing(), parts.span, keep).fly(executor, threads, ahead)
        parts.join()
    return path


def collect(
    question: Study,
    *,
    executor: Executor | None = None,
    threads: int | None = None,
    batch: int = DEFAULT_BATCH,
    ahead: int = AHEAD,
) -> tables.Columns:
    """Fly an ensemble and return its columns, each of shape (flights,), without any file.

    Column names carry units; `status` is an index of `quantities.STATUS`.

    Raises:
        InterruptedSweepError: A worker died.
    """
    found: dict[int, tables.Columns] = {}
    numbers = list(range(-(-question.size // batch)))

    def span(number: int) -> tuple[int, int]:
        return number * batch, min((number + 1) * batch, question.size)

    _Work(question, numbers, span, found.__setitem__).fly(executor, threads, ahead)
    return {name: np.concatenate([found[n][name] for n in numbers]) for name in found[0]}


@contextmanager
def _opened(
    path: Path, question: Study, batch: int | None, *, resume: bool, force: bool
) -> Iterator[Parts | None]:
    """Yield the parts of a sweep to fly, or None if the file is finished already."""
    unfinished = path.with_name(f'{path.name}.parts').exists()
    if path.exists() and not force and not (resume and unfinished):
        if not resume:
            allowed = 'the file exists, and nothing is overwritten without --force'
            raise ConfigError('output', str(path), allowed)
        stored = tables.stored_study(path)
        different = ['no question in it'] if stored is None else _different(stored, question)
        if different:
            allowed = f'what it holds differs: {"; ".join(different[:3])}'
            raise ConfigError('resume', str(path), allowed)
        yield None
        return
    with Parts(path, question, batch, resume=resume, force=force) as parts:
        yield parts


def _different(stored: dict[str, object], question: Study) -> list[str]:
    return study_differences(stored, study_document(question))


@dataclass(frozen=True)
class _Work:
    """What is to be flown, in batches, and what becomes of each."""

    question: Study
    numbers: list[int]
    span: Callable[[int], tuple[int, int]]
    keep: Result

    def fly(self, executor: Executor | None, threads: int | None, ahead: int) -> None:
        """Fly the batches, at most `ahead` at a time.

        Raises:
            InterruptedSweepError: A worker died; what is finished is kept.
        """
        try:
            if executor is not None:
                self._drive(executor, 1, ahead)
                return
            # Two batches: one flies on all cores while the other is written.
            with ThreadPoolExecutor(1) as one:
                self._drive(one, threads, min(ahead, 2))
        except Exception as error:
            if isinstance(error, BrokenExecutor | CancelledError) or _is_lost_worker(error):
                raise InterruptedSweepError(f'a worker died ({type(error).__name__})') from error
            raise

    def _drive(self, executor: Executor, threads: int | None, ahead: int) -> None:
        waiting = list(reversed(self.numbers))
        flying: dict[Future[tables.Columns], int] = {}
        try:
            while waiting or flying:
                while waiting and len(flying) < max(ahead, 1):
                    start, stop = self.span(waiting[-1])
                    future = executor.submit(fly_batch, self.question, start, stop, threads)
                    flying[future] = waiting.pop()
                done, _ = wait(flying, return_when=FIRST_COMPLETED)
                for future in done:
                    columns = future.result()
                    self.keep(flying.pop(future), columns)
        except BaseException:
            self._keep_finished(flying)
            raise

    def _keep_finished(self, flying: dict[Future[tables.Columns], int]) -> None:
        """Cancel what waits, and keep what came back in the meantime."""
        for future in flying:
            future.cancel()
        with suppress(DiscSimError):  # a full disk stays full
            for future, number in flying.items():
                if future.done() and not future.cancelled() and future.exception() is None:
                    self.keep(number, future.result())


def _is_lost_worker(error: Exception) -> bool:
    """Say whether an error is Dask's for a worker that died; Dask itself may not be installed."""
    return type(error).__name__ in {'KilledWorker', 'FutureCancelledError'}
