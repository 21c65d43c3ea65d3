"""Which steps are due by the steady clock: absolute deadlines, catching up, slipping."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
import ctypes
import gc
import math
import os

CATCH_UP = 0.1  # s of wall time whose steps are made up for after a stall
RECENT = 1000  # deadlines
_PR_SET_TIMERSLACK = 29


class Pacer:
    """Compares the steps that are done with the steady clock.

    Deadlines are absolute, so that lateness does not add up. After a stall of more than `CATCH_UP`
    the pacer gives up the rest, which is called a slip: the simulation then runs behind the wall
    clock by that much.

    Attributes:
        slipped: Wall time given up so far [s].
        slips: Number of slips so far.
        missed: Number of deadlines met later than one step, so far.
        restarts: Number of calls of `restart`.
        period: Wall time of a step [s].
        epoch: The deadline of step n is epoch + n period, by the steady clock [s].
        done: Number of steps done since.
        recent: Lateness at the last deadlines [s].
        worst: Greatest lateness since the last call of `take_worst` [s].
    """

    def __init__(self, step: float, rate: float, now: float) -> None:
        """Start counting at `now` [s] for steps of `step` [s] at `rate` times real time."""
        self.slipped = 0.0
        self.slips = 0
        self.missed = 0
        self.worst = 0.0
        self.restarts = 0
        self.recent: deque[float] = deque(maxlen=RECENT)
        self.restart(step, rate, now)

    def restart(self, step: float, rate: float, now: float) -> None:
        """Count anew from `now`: after a pause, a throw or a change of rate."""
        self.period = step / rate  # s of wall time for a step
        self.epoch = now
        self.done = 0
        self.restarts += 1

    def due(self, now: float, steps: int = 1) -> int:
        """Return how many steps are due at `now`, after slipping if the stall was too long.

        Args:
            now: The steady clock [s].
            steps: The deadline is that of the last of so many steps; before it none is due.
        """
        late = now - self.epoch - (self.done + steps) * self.period
        if late < 0.0:
            return 0
        self.worst = max(self.worst, late)
        self.recent.append(late)
        if late > self.period:
            self.missed += 1
        if late > CATCH_UP:
            lost = late - CATCH_UP
            self.epoch += lost
            self.slipped += lost
            self.slips += 1
        return math.floor((now - self.epoch) / self.period + 1e-9) - self.done

    def count(self, steps: int) -> None:
        """Count steps that are done."""
        self.done += steps

    def add(self, steps: int, lateness: list[float]) -> None:
        """Count steps that are done, and the lateness at the deadlines where they were due [s]."""
        self.done += steps
        self.recent.extend(lateness)
        self.missed += sum(late > self.period for late in lateness)
        self.worst = max(self.worst, *lateness) if lateness else self.worst

    def wait(self, now: float, steps: int) -> float:
        """Return how long to sleep until `steps` more are due [s]; negative if they are late."""
        return self.epoch + (self.done + steps) * self.period - now

    def take_worst(self) -> float:
        """Return the greatest lateness since the last call [s]."""
        worst, self.worst = self.worst, 0.0
        return worst

    def quantile(self, share: float) -> float:
        """Return the lateness that a share of the last deadlines did not exceed [s]."""
        recent = sorted(self.recent.copy())
        return recent[min(int(share * len(recent)), len(recent) - 1)] if recent else 0.0


def configure_thread(priority: int, warn: Callable[[str], None]) -> None:
    """Make the calling thread wake up as exactly as the machine permits.

    Args:
        priority: SCHED_FIFO priority from 1 to 99; 0 keeps the ordinary scheduling.
        warn: Called with a line where the machine does not permit the priority.
    """
    # Linux rounds sleeps of ordinary threads up by 50 us; other systems sleep as they can.
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    # A full collection stalls all threads for tens of milliseconds: exempt all present objects.
    gc.collect()
    gc.freeze()
    if priority > 0:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        except (AttributeError, OSError) as error:
            warn(f'realtime_priority: {priority} is not permitted on this machine ({error})')
