"""Ctrl-C and SIGTERM for the programs of this package; imports nothing that takes time to load."""

from collections.abc import Callable
import os
import signal


def on_signal(handler: Callable[..., object]) -> None:
    """Handle Ctrl-C and SIGTERM from now on."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)


def exit_on_signal() -> None:
    """End the process with code 0 on Ctrl-C and SIGTERM, while there is nothing to close yet."""
    on_signal(lambda *_: os._exit(0))
