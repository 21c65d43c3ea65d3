"""Simulated time: whole steps from a first stamp, exact to the nanosecond however long it runs."""

from fractions import Fraction

import numpy as np

from disc_sim_ros.units import NANOSECONDS


class SimClock:
    """Counts steps and converts them to nanoseconds.

    Attributes:
        counter: An int64 array of shape (1,) with the steps, which a compiled loop counts up.
    """

    def __init__(self, start: int, rate: float) -> None:
        """Start at a stamp.

        Args:
            start: The first stamp [ns].
            rate: Steps per simulated second [Hz].
        """
        self.counter = np.zeros(1, dtype=np.int64)
        self._counter = self.counter.data  # a memoryview is ten times as fast
        self._start = start
        self._num, self._den = _period(rate)

    @property
    def steps(self) -> int:
        """Return or set the steps since the start or the last `restart`."""
        return self._counter[0]

    @steps.setter
    def steps(self, steps: int) -> None:
        self._counter[0] = steps

    @property
    def fraction(self) -> tuple[int, int, int]:
        """Return r, num, den [ns]: k steps from now the stamp is `now` + (r + k num) // den."""
        return self.steps * self._num % self._den, self._num, self._den

    def restart(self, rate: float) -> None:
        """Count steps anew from the present stamp, at another rate [Hz]."""
        self._start = self.now
        self._num, self._den = _period(rate)
        self.steps = 0

    def jump(self, shift: int) -> None:
        """Move the stamps of this step and of all later ones by a time [ns]."""
        self._start += shift

    @property
    def period(self) -> int:
        """Return the time of one step [ns], rounded down."""
        return self._num // self._den

    @property
    def now(self) -> int:
        """Return the present stamp [ns]."""
        return self.at(self.steps)

    def at(self, step: int) -> int:
        """Return the stamp of a step since the last `restart` [ns], rounded down."""
        return self._start + step * self._num // self._den

    def step_at(self, stamp: int) -> int:
        """Return the first step not before a stamp [ns], at least the present one."""
        step = -(-(stamp - self._start) * self._den // self._num)
        return max(step, self.steps)


def _period(rate: float) -> tuple[int, int]:
    """Return numerator and denominator of the period of a rate [Hz], in nanoseconds."""
    # 1000.0 Hz is 1000 Hz: rates that people write are fractions of small numbers.
    period = NANOSECONDS / Fraction(rate).limit_denominator(1_000_000)
    return period.numerator, period.denominator
