"""How many lines a node writes about one thing: bursts, then one a period, and none uncounted."""

from dataclasses import dataclass


@dataclass(slots=True)
class LineLimit:
    """Admits a burst of lines and then one a period; counts the lines that it leaves out.

    Attributes:
        burst: Lines that may follow one another at once.
        period: Time after which one more is admitted [s].
    """

    burst: int
    period: float
    _left_out: int = 0
    _spent: float = 0.0  # lines of the burst that are used up
    _last: float = float('-inf')

    def admit(self, text: str, now: float) -> str | None:
        """Return the line to write, with the number of those left out before it; None for none.

        Args:
            text: The line.
            now: By a clock that does not go back [s].
        """
        self._spent = max(self._spent - (now - self._last) / self.period, 0.0)
        self._last = now
        if self._spent > self.burst - 1:
            self._left_out += 1
            return None
        self._spent += 1.0
        more, self._left_out = self._left_out, 0
        return f'{text} ({more} such lines left out before it)' if more else text
