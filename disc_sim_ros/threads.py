"""Threads that compute side by side, and that Ctrl-C in the main thread never blocks.

The locks, conditions and executors of the standard library are partly written in Python. If
KeyboardInterrupt comes after the main thread has acquired such a lock and before the block that
releases it, other threads wait for this lock without end, and so does the end of the program.
`queue.SimpleQueue` has no such moment, and `ctrl_c_waits` holds Ctrl-C back.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext, suppress
import os
from queue import Empty, SimpleQueue
import signal
import threading
from typing import Any, TypeVar
import weakref

_T = TypeVar('_T')


class Threads:
    """A fixed number of threads; `close` ends them.

    One thread is the calling one.
    """

    def __init__(self, wanted: int | None = None, most: int | None = None) -> None:
        """Start the threads.

        Args:
            wanted: Number of threads; None for one per core.
            most: The largest number that is of use; None for any.
        """
        count = wanted or os.cpu_count() or 1
        self.count = count if most is None else max(min(count, most), 1)
        self._jobs: _Jobs = SimpleQueue()
        started = self.count if self.count > 1 else 0
        with ctrl_c_waits() if started else nullcontext():
            for _ in range(started):
                threading.Thread(target=_follow, args=(self._jobs,), daemon=True).start()
        self._end = weakref.finalize(self, _end, self._jobs, started)  # also without `close`

    def close(self) -> None:
        """End the threads."""
        self._end()

    def run(self, work: Iterable[Callable[[], _T]], *, leave: bool = False) -> list[_T]:
        """Call functions side by side, and return their results in their order.

        After Ctrl-C or an error no more of them begin. It is raised when those that run have
        ended.

        Args:
            work: The functions.
            leave: Wait for none of them after Ctrl-C or an error: they take long, and what they
                still do changes nothing that the caller uses.

        Raises:
            BaseException: One of the functions raised it.
        """
        if self.count == 1:
            return [function() for function in work]
        run = _Run(work)
        try:
            for number in range(len(run.work)):
                self._jobs.put((run, number))
            for _ in run.work:
                run.await_one()
        except BaseException:
            run.stop = True
            while not leave and len(run.ends) < len(run.starts):
                with suppress(Empty):
                    run.done.get(timeout=0.1)
            raise
        return run.results


class _Run:
    """The functions of one call of `Threads.run`, and what became of them."""

    def __init__(self, work: Iterable[Callable[[], Any]]) -> None:
        self.work = list(work)
        self.results: list[Any] = [None] * len(self.work)
        self.done: SimpleQueue[BaseException | None] = SimpleQueue()
        self.starts: list[int] = []  # numbers of functions; appending is one step for all threads
        self.ends: list[int] = []
        self.stop = False

    def call(self, number: int) -> None:
        """Call a function, unless the run is stopped."""
        error = None
        self.starts.append(number)  # before the look at `stop`: the caller counts them after it
        try:
            if not self.stop:
                self.results[number] = self.work[number]()
        except BaseException as raised:
            error = raised
        self.ends.append(number)
        self.done.put(error)

    def await_one(self) -> None:
        """Wait for the end of one more function, and raise what it raised."""
        error = self.done.get()
        if error is not None:
            raise error


_Jobs = SimpleQueue[tuple[_Run, int] | None]


def _follow(jobs: '_Jobs') -> None:
    """Work until `None` comes."""
    while (job := jobs.get()) is not None:
        run, number = job
        run.call(number)
        del job, run  # the results belong to the caller alone


def _end(jobs: '_Jobs', count: int) -> None:
    for _ in range(count):
        jobs.put(None)


@contextmanager
def ctrl_c_waits() -> Iterator[None]:
    """Hold Ctrl-C back until the end of the block; in the main thread, which alone handles it.

    To block SIGINT is not enough: another thread, such as that of an executor, may take it, and
    Python then runs the handler in the main thread all the same.
    """
    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(handler):
        yield
        return
    held: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: held.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if held:
            signal.raise_signal(signal.SIGINT)
