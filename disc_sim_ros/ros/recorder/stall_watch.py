"""A thread that notices when the process did not run: stopped, suspended or starved."""

import math
import threading
import time

PERIOD = 0.02  # s between two beats
SHORTEST = 0.04  # s that a beat comes late, a stall: a stop of 0.1 s cost 100 messages of 101
EFFECT = 2.0  # s after a stall in which the middleware tells of what ended meanwhile


class StallWatch(threading.Thread):
    """Beats in a sleep of its own, so that neither locks nor work of other threads delay it.

    Attributes:
        longest: Longest time without a beat, beyond the period [s].
    """

    def __init__(self) -> None:
        super().__init__(name='stall watch', daemon=True)
        self.longest = 0.0
        self._beat = time.monotonic()
        self._effect_until = -math.inf
        self._ended = threading.Event()

    def run(self) -> None:
        """Beat until the end."""
        self._beat = time.monotonic()
        while not self._ended.wait(PERIOD):
            self._note(time.monotonic())

    def is_recent(self) -> bool:
        """Return True in a stall that this thread has not noted yet, and just after one."""
        now = time.monotonic()
        return now < self._effect_until or now - self._beat > SHORTEST

    def end(self) -> None:
        """End the thread, with the last beat; harmless if it never began."""
        if self.is_alive():
            self._ended.set()
            self.join()
            self._note(time.monotonic())

    def _note(self, now: float) -> None:
        late = now - self._beat - PERIOD
        self._beat = now
        self.longest = max(self.longest, late)
        if late > SHORTEST:
            self._effect_until = now + EFFECT
