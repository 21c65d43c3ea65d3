"""The time by which messages are recorded: that of the wall clock, without its jumps."""

import threading
import time

STEP = 500_000_000  # ns; a larger change at once is a jump, a smaller one corrects the rate
LONGEST_WAY = 60_000_000_000  # ns; no message waits longer to be taken


class LogClock:
    """The wall clock as if it had not been set since this clock was made.

    A machine without a battery-backed clock begins in 1970 and is set once the network is up: a
    bag with both times would take decades to play; one set back would be out of order.

    Attributes:
        shift: Sum of the jumps of the wall clock so far [ns].
    """

    def __init__(self) -> None:
        self.shift = 0
        self._lock = threading.Lock()
        self._now = time.time_ns()
        self._offset = self._now - time.monotonic_ns()
        self._previous = 0, 0  # the shift before the last jump, and until when it may still apply

    def now(self) -> int:
        """Return the time [ns]; only frequent calls detect each jump of the wall clock."""
        with self._lock:
            wall = time.time_ns()
            offset = wall - time.monotonic_ns()
            if abs(offset - self._offset) > STEP:
                self._previous = self.shift, self._now + LONGEST_WAY
                self.shift += offset - self._offset
            self._offset = offset
            self._now = wall - self.shift
            return self._now

    def at(self, received: int) -> int:
        """Return the time of a message that arrived at a time of the wall clock [ns].

        It arrived about the last call of `now`, or before it. The time of a message that arrived
        just before a jump is one by the wall clock before that jump.
        """
        shift, until = self._previous
        shifts = {self.shift, shift} if self._now < until else {self.shift}
        times = [received - shift for shift in shifts]
        plausible = [t for t in times if self._now - LONGEST_WAY < t < self._now + STEP]
        return max(plausible, default=self._now)
