"""An rclpy that lacks a private part: what a later version may look like.

Each function renames one part and makes rclpy itself use the new name, so that rclpy goes on to
work. In a process: `Recorder(..., before=without('take_message'))`.
"""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import rclpy._rclpy_pybind11 as _rclpy
import rclpy.event_handler
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

_TEST = Path(__file__).parents[1]


def without(part: str) -> str:
    """Return Python code that removes a part, for the start of a process."""
    return (
        f'import sys; sys.path.insert(0, {str(_TEST)!r})\n'
        f'from ros.rclpy_without import PARTS; PARTS[{part!r}](setattr, delattr); del sys.path[0]'
    )


def take_message(set_: Callable, delete: Callable) -> None:
    """Rename `Subscription.handle.take_message`."""
    original = SingleThreadedExecutor._take_subscription

    class Handle:
        """The handle of a subscription as the executor knows it."""

        def __init__(self, handle):
            self._handle = handle

        def __enter__(self):
            return self._handle.__enter__()

        def __exit__(self, *error):
            return self._handle.__exit__(*error)

        def take_message(self, message_type, raw):
            return self._handle.take_message_renamed(message_type, raw)

    def take_subscription(self, subscription):
        renamed = SimpleNamespace(
            handle=Handle(subscription.handle),
            msg_type=subscription.msg_type,
            raw=subscription.raw,
            callback=subscription.callback,
            _callback_type=subscription._callback_type,
        )
        return original(self, renamed)

    set_(_rclpy.Subscription, 'take_message_renamed', _rclpy.Subscription.take_message)
    delete(_rclpy.Subscription, 'take_message')
    set_(SingleThreadedExecutor, '_take_subscription', take_subscription)


def event_handle(set_: Callable, delete: Callable) -> None:
    """Rename `_rclpy_pybind11.EventHandle`."""
    set_(rclpy.event_handler, '_rclpy', SimpleNamespace(**vars(_rclpy)))
    delete(_rclpy, 'EventHandle')


def parameter_overrides(set_: Callable, delete: Callable) -> None:
    """Rename `Node._parameter_overrides`, an attribute that nodes get when they are made."""
    initialise, declare = Node.__init__, Node.declare_parameters

    def renamed_init(self, *args, **kwargs):
        initialise(self, *args, **kwargs)
        self._overrides_renamed = self.__dict__.pop('_parameter_overrides')

    def renamed_declare(self, namespace, parameters, ignore_override=False):  # noqa: FBT002
        renamed = self.__dict__.get('_overrides_renamed')
        if renamed is None:  # while the node is made
            return declare(self, namespace, parameters, ignore_override)
        self._parameter_overrides = renamed
        try:
            return declare(self, namespace, parameters, ignore_override)
        finally:
            del self._parameter_overrides

    set_(Node, '__init__', renamed_init)
    set_(Node, 'declare_parameters', renamed_declare)


PARTS: dict[str, Callable[[Callable, Callable], None]] = {
    'take_message': take_message,
    'EventHandle': event_handle,
    '_parameter_overrides': parameter_overrides,
}
