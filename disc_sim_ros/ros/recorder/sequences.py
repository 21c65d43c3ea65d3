"""Gaps in the sequence numbers of publishers that a message does not name."""


class Sequences:
    """Follows the numbers of the publishers of one topic, each of which counts by one.

    rclpy does not tell which publisher sent a message. A number that none of them has next belongs
    to the one whose next number is the nearest below. If it belongs to another, the next number of
    that one corrects the sum. No count is too large, unless a loss comes before all have been
    heard; without a loss there is no gap.
    """

    def __init__(self) -> None:
        """Follow no publisher yet."""
        self._next: list[int] = []

    def forget(self) -> None:
        """Begin anew: a publisher came or left."""
        self._next = []

    def gap(self, number: int, publishers: int) -> int:
        """Return how many messages are missing before one, as far as the numbers tell.

        Args:
            number: Of the message.
            publishers: How many there are. The first message of each tells of no gap.
        """
        following = self._next
        if number in following:
            following[following.index(number)] = number + 1
            return 0
        if len(following) < publishers:
            following.append(number + 1)
            return 0
        below = max((n for n in following if n < number), default=None)
        if below is None:  # of a publisher of which no event has told yet
            self._next = [number + 1]
            return 0
        following[following.index(below)] = number + 1
        return number - below
