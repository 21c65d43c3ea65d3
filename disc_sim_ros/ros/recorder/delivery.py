"""The way of a message from its subscription to the writing thread, and where it waits."""

from collections import deque
from collections.abc import Callable
import threading

from disc_sim_ros.bags.transforms import tf_message
from disc_sim_ros.ros.recorder.clock import LogClock
from disc_sim_ros.ros.recorder.stall_watch import StallWatch
from disc_sim_ros.ros.recorder.topic_recorder import TopicRecorder
from disc_sim_ros.ros.recorder.writer_thread import LARGEST_BACKLOG, OVERHEAD, WriterThread

_Message = tuple[TopicRecorder, bytes, int, int]  # data, received, sent [ns]


class Delivery:
    """Passes messages to the writing thread.

    While paused it keeps only the last messages of each latched topic. With simulated time it
    keeps messages until the first `/clock`.

    Attributes:
        lock: Held while messages are delivered; callers of the methods hold it.
        clock: The clock of arrivals.
        stalls: The watch of this process.
        paused: Whether messages are not recorded.
        skipped: Messages that came while paused and are not recorded.
    """

    def __init__(
        self, thread: WriterThread, *, paused: bool, simulated_time: Callable[[], int] | None
    ) -> None:
        """Begin.

        Args:
            thread: The thread that writes the bag.
            paused: Begin paused.
            simulated_time: Returns the log time [ns], 0 or less while it is unknown; None to
                record the time of arrival.
        """
        self.lock = threading.RLock()
        self.clock = LogClock()
        self.stalls = StallWatch()
        self.paused = paused
        self.skipped = 0
        self._thread = thread
        self._simulated_time = simulated_time
        self._waiting: list[_Message] = []  # for the first `/clock`
        self._waiting_bytes = 0
        self._latched: dict[str, deque[_Message]] = {}  # by label, while paused

    @property
    def waiting(self) -> int:
        """Return the number of messages that wait for the first `/clock`."""
        return len(self._waiting)

    def deliver(self, recorder: TopicRecorder, data: bytes, received: int, sent: int) -> None:
        """Record a message or keep it; `received` and `sent` in ns, `sent` 0 if unknown."""
        if self.paused:
            if recorder.latched:
                self._keep_latched(recorder, data, received, sent)
            else:
                self.skipped += 1
            return
        if self._simulated_time is not None:
            now = self._simulated_time()
            if now <= 0:
                self._wait(recorder, data, received, sent)
                return
            if self._waiting:
                self._release(now)
            received = now
        self._put(recorder, data, received, sent)

    def resume(self) -> None:
        """Record from now on, beginning with the latched messages that were kept."""
        self.paused = False
        latched, self._latched = self._latched, {}
        for messages in latched.values():
            for recorder, data, _, sent in messages:
                self.deliver(recorder, data, self.clock.now(), sent)

    def release_waiting(self) -> None:
        """Record the messages that wait for the first `/clock`, if it has come."""
        if self._waiting and self._simulated_time is not None:
            now = self._simulated_time()
            if now > 0:
                self._release(now)

    def release_without_clock(self) -> int:
        """Record the waiting messages by their time of arrival; return how many they are."""
        return self._release(None)

    def _release(self, now: int | None) -> int:
        waiting, self._waiting = self._waiting, []
        self._waiting_bytes = 0
        for recorder, data, received, sent in waiting:
            self._put(recorder, data, received if now is None else now, sent)
        return len(waiting)

    def _put(self, recorder: TopicRecorder, data: bytes, log_time: int, sent: int) -> None:
        if not self._thread.put(recorder.topic, data, log_time, sent or log_time):
            recorder.count_dropped()
        elif recorder.tf_topic is not None and (message := tf_message(data)) is not None:
            self._thread.put(recorder.tf_topic, message, log_time, sent or log_time)

    def _keep_latched(
        self, recorder: TopicRecorder, data: bytes, received: int, sent: int
    ) -> None:
        """Keep as many messages of a latched topic as it has publishers, the last ones."""
        messages = self._latched.get(recorder.label, ())
        most = max(recorder.publisher_count, 1)
        message = (recorder, data, received, sent)
        self._latched[recorder.label] = deque([*messages, message], maxlen=most)

    def _wait(self, recorder: TopicRecorder, data: bytes, received: int, sent: int) -> None:
        if self._waiting_bytes > LARGEST_BACKLOG:
            recorder.count_dropped()
            return
        self._waiting.append((recorder, data, received, sent))
        self._waiting_bytes += len(data) + OVERHEAD
