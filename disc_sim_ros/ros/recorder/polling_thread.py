"""The thread that takes messages from the subscriptions of the recorder."""

from collections.abc import Callable
import threading
import time

from disc_sim_ros.errors import DiscSimError

TURN = 0.0005  # s for other threads where more messages wait than one round takes


class PollingThread(threading.Thread):
    """Takes messages again and again.

    Attributes:
        failure: Why it ended early; None otherwise.
    """

    def __init__(self, take: Callable[[], bool], period: float) -> None:
        """Prepare the thread.

        Args:
            take: Takes messages; returns True if more wait.
            period: Time to sleep if none wait [s].
        """
        super().__init__(name='polling')
        self.failure: DiscSimError | None = None
        self._take = take
        self._period = period
        self._ending = False

    def run(self) -> None:
        """Take messages until asked to end."""
        try:
            while not self._ending:
                time.sleep(TURN if self._take() else self._period)
        except Exception as error:  # whatever it is, the bag is closed and the failure reported
            self.failure = DiscSimError(f'cannot take messages ({type(error).__name__}: {error})')

    def end(self) -> None:
        """End the thread and wait for it."""
        self._ending = True
        if self.is_alive():
            self.join()
