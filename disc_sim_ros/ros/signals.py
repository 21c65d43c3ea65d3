"""Signals that end the programs of this package; imports nothing that takes time to load."""

from collections.abc import Callable
import os
import signal


def on_signal(handler: Callable[..., object]) -> None:
    """Handle SIGINT, SIGQUIT, SIGTERM and, unless started by nohup, the end of the terminal."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGHUP):
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handler)


def exit_on_signal() -> None:
    """End the process with code 0 on these signals, while there is nothing to close yet."""
    on_signal(lambda *_: os._exit(0))
