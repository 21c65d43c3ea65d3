"""What goes wrong with bags."""

from disc_sim_ros.core.errors import DiscSimError


class BagError(DiscSimError):
    """A bag cannot be written, read or repaired; one line says which, where and why."""


class DamageError(BagError):
    """A part of a file is not what it says it is."""


class WriteError(BagError):
    """The system refuses to write a bag."""

    def __init__(self, message: str, reason: str) -> None:
        """Keep the `reason` alone too."""
        self.reason = reason
        super().__init__(message)
