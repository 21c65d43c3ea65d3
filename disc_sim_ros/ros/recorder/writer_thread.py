"""The thread that writes a bag: messages go in, the disk is its business."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
import threading
from typing import Any

from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError

LARGEST_BACKLOG = 512 * 1024 * 1024  # bytes that wait for the disk; more are dropped
_OVERHEAD = 200  # bytes of memory that a waiting message takes beside its data

_Message = tuple[int, bytes, int, int]  # topic id, data, log time, publish time [ns]
_Job = tuple[Callable[[BagWriter], Any], Future[Any]]


class BagThread(threading.Thread):
    """Writes into a bag what other threads hand over, in the order in which it came.

    Attributes:
        failure: Why the bag has ended early; None as long as all is well.
    """

    def __init__(self, writer: BagWriter, flush_period: float) -> None:
        """Take a bag, which this thread closes, and the longest time between flushes [s]."""
        super().__init__(name='bag')
        self.failure: BagError | None = None
        self._writer = writer
        self._period = flush_period
        self._queue: deque[_Message | _Job] = deque()
        self._wake = threading.Event()
        self._ending = False
        self._taken = 0  # bytes that came, by the other threads
        self._written = 0  # bytes that went, by this thread

    @property
    def backlog(self) -> int:
        """Bytes of memory that wait for the disk."""
        return self._taken - self._written

    def put(self, topic_id: int, data: bytes, log_time: int, publish_time: int) -> bool:
        """Hand over a message; return whether it was taken: not where too much waits already."""
        size = len(data) + _OVERHEAD
        if self._taken + size - self._written > LARGEST_BACKLOG or self.failure is not None:
            return False
        self._taken += size
        self._queue.append((topic_id, data, log_time, publish_time))
        if not self._wake.is_set():
            self._wake.set()
        return True

    def call(self, job: Callable[[BagWriter], Any]) -> Future[Any]:
        """Have something done with the bag behind all that was put so far."""
        future: Future[Any] = Future()
        self._queue.append((job, future))
        self._wake.set()
        return future

    def end(self) -> None:
        """Ask the thread to write what waits, close the bag and end; `join` waits for it."""
        self._ending = True
        self._wake.set()

    def run(self) -> None:
        """Write until asked to end, or until the disk refuses."""
        try:
            self._write_until_end()
        except Exception as error:  # whatever it is, the bag is closed
            self.failure = _as_bag_error(error)
        try:
            self._writer.close()
        except Exception as error:
            self.failure = self.failure or _as_bag_error(error)
        self._refuse_jobs()

    def _write_until_end(self) -> None:
        while True:
            self._wake.wait(self._period)
            self._wake.clear()
            ending = self._ending  # before the look at the queue: what came until then is there
            quiet = not self._queue
            self._write_queue()
            if ending:
                return
            if quiet:
                self._writer.flush()

    def _write_queue(self) -> None:
        queue, writer = self._queue, self._writer
        write = writer.write
        while queue:
            item = queue.popleft()
            if len(item) == 4:
                write(*item)
                self._written += len(item[1]) + _OVERHEAD
            else:
                job, future = item
                try:
                    future.set_result(job(writer))
                except Exception as error:
                    future.set_exception(_as_bag_error(error))
                    raise

    def _refuse_jobs(self) -> None:
        error = self.failure or BagError('the bag is closed')
        for item in self._queue:
            if len(item) == 2:
                item[1].set_exception(error)


def _as_bag_error(error: Exception) -> BagError:
    if isinstance(error, BagError):
        return error
    return BagError(f'the bag cannot be written ({type(error).__name__}: {error})')
