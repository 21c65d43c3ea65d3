"""Getting a thread woken in time: timer slack, real-time scheduling, no garbage collection."""

from collections.abc import Callable
from contextlib import suppress
import ctypes
import gc
import os

_PR_SET_TIMERSLACK = 29


def make_punctual(priority: int, warn: Callable[[str], None]) -> None:
    """Have the calling thread woken as exactly as the machine permits.

    Args:
        priority: SCHED_FIFO priority from 1 to 99; 0 leaves the ordinary scheduling.
        warn: Called with a line where the machine does not permit it.
    """
    # Linux rounds sleeps of ordinary threads up by 50 us; another system sleeps as it can.
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    # A full collection stalls all threads for tens of milliseconds: it skips what is old by now.
    gc.collect()
    gc.freeze()
    if priority > 0:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        except (AttributeError, OSError) as error:
            warn(f'realtime_priority: {priority} is not permitted on this machine ({error})')
