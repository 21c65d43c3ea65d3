"""Check that the stamps of odom are whole periods apart, and its numbers finite."""

import struct
from typing import Any

import numpy as np

STAMP = struct.Struct('<4xiI')  # what a serialised message with a header begins with
NUMBERS = 7 + 36 + 6 + 36  # what an Odometry ends with: pose, twist, each with its covariance
NANOSECONDS = 1_000_000_000


class Stamps:
    """Takes the serialised Odometry of one publisher in order.

    The sequence number of a message shows how many the network lost before it. A throw publishes
    the state again, with the same stamp.

    Attributes:
        count: Messages taken.
        uneven: Stamps that are not a whole number of periods from the first.
        gaps: Stamps further apart than the messages between them, or going back.
        repeated: Messages with the stamp of the one before.
        lost: Messages that the network lost.
        infinite: Messages with a number that is not finite.
        newest: The last stamp [ns].
    """

    def __init__(self, rate: float) -> None:
        """Expect so many messages a simulated second."""
        self.count = self.uneven = self.gaps = self.repeated = self.lost = self.infinite = 0
        self.newest = 0
        self._period = round(NANOSECONDS / rate)
        self._first = self._sequence = 0

    @property
    def span(self) -> float:
        """Return the simulated time from the first stamp to the last [s]."""
        return (self.newest - self._first) / NANOSECONDS

    def take(self, data: bytes, info: dict[str, Any]) -> None:
        """Take a message with its message info."""
        seconds, rest = STAMP.unpack_from(data)
        stamp, sequence = seconds * NANOSECONDS + rest, info['publication_sequence_number']
        if not self.count:
            self._first, self.newest, self._sequence = stamp, stamp, sequence - 1
        messages = sequence - self._sequence
        periods, off = divmod(stamp - self.newest, self._period)
        if self.count:
            self.gaps += not messages - 1 <= periods <= messages
            self.repeated += periods == messages - 1
        self.uneven += off != 0
        self.lost += messages - 1
        numbers = np.frombuffer(data, '<f8', NUMBERS, len(data) - 8 * NUMBERS)
        self.infinite += not np.isfinite(numbers).all()
        self.newest, self._sequence = stamp, sequence
        self.count += 1
