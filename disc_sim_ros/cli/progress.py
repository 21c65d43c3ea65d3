"""A progress bar for long computations, with the rate and the time left."""

import sys
import time
from typing import TextIO

_WIDTH = 24
_EVERY_TERMINAL, _EVERY_LOG = 0.1, 10.0  # s between two lines


class ProgressBar:
    """Shows finished and all flights, the rate and the time left.

    Args:
        prog: Name of the program, for lines that are not on a terminal.
        stream: Stream to write to; None for stderr. On a terminal the bar is one line that is
            updated, otherwise a new line appears every 10 s.
    """

    def __init__(self, prog: str, stream: TextIO | None = None) -> None:
        self._stream = stream or sys.stderr
        self._terminal = self._stream.isatty()
        self._prog = prog
        self._first: tuple[float, int] | None = None
        self._last_shown = time.monotonic()
        self._shown = False
        self.done = 0
        self.total = 0

    @property
    def new(self) -> int:
        """Return the number of flights finished since the first call."""
        return self.done - self._first[1] if self._first else 0

    def finish(self) -> None:
        """End the line of the bar."""
        if self._shown and self._terminal:
            self._stream.write('\n')
            self._stream.flush()
            self._shown = False

    def __call__(self, done: int, total: int) -> None:
        """Show the number of finished flights and of all flights."""
        self.done, self.total = done, total
        now = time.monotonic()
        if self._first is None:
            self._first = (now, done)
        every = _EVERY_TERMINAL if self._terminal else _EVERY_LOG
        if now - self._last_shown < every and not (self._terminal and done == total):
            return
        self._last_shown, self._shown = now, True
        text = progress_text(done, total, done - self._first[1], now - self._first[0])
        self._stream.write(f'\r\x1b[K{text}' if self._terminal else f'{self._prog}: {text}\n')
        self._stream.flush()


def progress_text(done: int, total: int, new: int, seconds: float) -> str:
    """Return a line with the bar, the share, the flights, the rate and the time left."""
    full = _WIDTH * done // max(total, 1)
    text = f'[{"#" * full}{"." * (_WIDTH - full)}] {done / max(total, 1):4.0%} '
    text += f'{done} of {total} flights'
    if new and seconds > 0.0:
        rate = new / seconds
        text += f', {rate:.0f}/s, {duration((total - done) / rate)} left'
    return text


def duration(seconds: float) -> str:
    """Return a duration to read: 8 s, 3 min 20 s, 2 h 5 min."""
    whole = round(seconds)
    if whole < 60:
        return f'{whole} s'
    if whole < 3600:
        return f'{whole // 60} min {whole % 60} s'
    return f'{whole // 3600} h {whole % 3600 // 60} min'
