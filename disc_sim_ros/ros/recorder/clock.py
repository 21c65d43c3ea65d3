"""The time by which messages are recorded: that of the wall clock, without its jumps."""

import threading
import time

STEP = 500_000_000  # ns; a faster change of the wall clock is no correction of its rate
LONGEST_WAY = 60_000_000_000  # ns; nothing waits so long to be taken


class LogClock:
    """Tells the time of the wall clock as if nobody had set it since this was made.

    A machine without a clock of its own begins in 1970 and is set when the network is there: a
    bag of both times would be replayed for decades, and one set back in the wrong order.

    Attributes:
        shift: By how much the wall clock was set [ns].
    """

    def __init__(self) -> None:
        self.shift = 0
        self._lock = threading.Lock()
        self._now = time.time_ns()
        self._offset = self._now - time.monotonic_ns()
        self._before = 0, 0  # the shift before, and until when something may have come by it

    def now(self) -> int:
        """Return the time [ns]; called often, it sees when the wall clock is set."""
        with self._lock:
            wall = time.time_ns()
            offset = wall - time.monotonic_ns()
            if abs(offset - self._offset) > STEP:
                self._before = self.shift, self._now + LONGEST_WAY
                self.shift += offset - self._offset
            self._offset = offset
            self._now = wall - self.shift
            return self._now

    def of(self, arrived: int) -> int:
        """Return the time [ns] of what arrived by the wall clock, about the last `now` or before.

        Of what came just before the clock was set, the time is one by the clock as it was.
        """
        shift, until = self._before
        shifts = {self.shift, shift} if self._now < until else {self.shift}
        times = [arrived - shift for shift in shifts]
        sound = [t for t in times if self._now - LONGEST_WAY < t < self._now + STEP]
        return max(sound, default=self._now)
