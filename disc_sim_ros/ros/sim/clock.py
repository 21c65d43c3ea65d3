"""Simulated time: whole steps from a first stamp, exact to the nanosecond for ever."""

from fractions import Fraction

NANOSECONDS = 1_000_000_000


class SimClock:
    """Counts steps and says what they are in nanoseconds.

    Attributes:
        steps: Steps since the last `restart`.
    """

    def __init__(self, start: int, rate: float) -> None:
        """Begin at a stamp [ns] with a number of steps a second."""
        self._start = start
        self.restart(rate)

    def restart(self, rate: float) -> None:
        """Go on from the present stamp with another rate."""
        if hasattr(self, 'steps'):
            self._start = self.now
        # 1000.0 Hz is 1000 Hz: rates that people write are fractions of small numbers.
        period = NANOSECONDS / Fraction(rate).limit_denominator(1_000_000)
        self._num, self._den = period.numerator, period.denominator
        self.steps = 0

    @property
    def now(self) -> int:
        """Return the present stamp [ns]."""
        return self.at(self.steps)

    def at(self, step: int) -> int:
        """Return the stamp of a step since the last `restart` [ns]."""
        return self._start + step * self._num // self._den

    def step_at(self, stamp: int) -> int:
        """Return the first step not before a stamp [ns], or the present one."""
        step = -(-(stamp - self._start) * self._den // self._num)
        return max(step, self.steps)
