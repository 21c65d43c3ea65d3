"""The thread that writes a bag: other threads hand messages over and never wait for the disk."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
import threading
from typing import Any

from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError

LARGEST_BACKLOG = 512 * 1024 * 1024  # bytes that wait for the disk; more are dropped
OVERHEAD = 200  # bytes of memory that a waiting message takes beside its data


class BagTopic:
    """A topic of the bag, which messages can name before the thread has added it.

    Attributes:
        id: Its id in the bag; the writing thread sets it before it writes a message of the topic.
    """

    __slots__ = ('id',)

    def __init__(self) -> None:
        self.id = 0


_Message = tuple[BagTopic, bytes, int, int]  # data, log time, publish time [ns]
_Job = tuple[Callable[[BagWriter], Any], Future[Any]]


class WriterThread(threading.Thread):
    """Writes to a bag what other threads hand over, in the order of arrival.

    Attributes:
        failure: Why the bag was closed early; None otherwise.
    """

    def __init__(self, writer: BagWriter, flush_period: float) -> None:
        """Take over a bag, which this thread closes.

        Args:
            writer: The bag.
            flush_period: Longest time between two flushes [s].
        """
        super().__init__(name='bag writer')
        self.failure: BagError | None = None
        self._writer = writer
        self._period = flush_period
        self._queue: deque[_Message | _Job] = deque()
        self._wake = threading.Event()
        self._ending = False
        self._accepted = 0  # bytes of memory, counted by the other threads
        self._written = 0  # bytes of memory, counted by this thread

    @property
    def backlog(self) -> int:
        """Return the bytes of memory that wait for the disk."""
        return self._accepted - self._written

    def put(self, topic: BagTopic, data: bytes, log_time: int, publish_time: int) -> bool:
        """Hand over a message with its times [ns]; return False if it is dropped.

        A message is dropped if too much waits already, or if the thread has failed.
        """
        size = len(data) + OVERHEAD
        if self._accepted + size - self._written > LARGEST_BACKLOG or self.failure is not None:
            return False
        self._accepted += size
        self._queue.append((topic, data, log_time, publish_time))
        if not self._wake.is_set():
            self._wake.set()
        return True

    def add_topic(self, topic: BagTopic, description: Topic) -> None:
        """Add a topic to the bag, before the messages that are put from now on."""

        def add(writer: BagWriter) -> None:
            topic.id = writer.add(description)

        self.call(add)

    def update_topic(self, topic: BagTopic, description: Topic) -> None:
        """Change the description of a topic that was added."""
        self.call(lambda writer: writer.update(topic.id, description))

    def call(self, job: Callable[[BagWriter], Any]) -> Future[Any]:
        """Call `job` with the bag, after all that was put so far; return its future result."""
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
            ending = self._ending  # read before the queue: what was put before `end` is written
            idle = not self._queue
            self._write_queue()
            if ending:
                return
            if idle:
                self._writer.flush()

    def _write_queue(self) -> None:
        queue, writer = self._queue, self._writer
        write = writer.write
        while queue:
            item = queue.popleft()
            if len(item) == 4:
                topic, data, log_time, publish_time = item
                write(topic.id, data, log_time, publish_time)
                self._written += len(data) + OVERHEAD
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
