"""What the programs of this package have in common: signals, start and service of ROS, errors."""

from collections.abc import Callable
from contextlib import suppress
import re
import signal
import threading
import time

import rclpy
from rclpy._rclpy_pybind11 import InvalidHandle, RCLError
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.logging import set_logger_level
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok, remove_ros_args

from disc_sim_ros.errors import ConfigError

LONGEST_WAIT = 0.5  # s until a signal is heard


def on_signal(handler: Callable[..., object]) -> None:
    """Have Ctrl-C and SIGTERM handled from now on."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)


def init(args: list[str]) -> None:
    """Initialise ROS with the arguments of a program, its name first.

    Raises:
        ConfigError: An argument that is not for ROS.
        RuntimeError: ROS does not understand an argument.
    """
    set_logger_level('rcl', LoggingSeverity.FATAL)  # it would tell a part of the error, too
    other = remove_ros_args(args)[1:]
    if other:
        raise ConfigError(
            'arguments', ' '.join(other), 'parameters are -p NAME:=VALUE after --ros-args'
        )
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    set_logger_level('rcl', LoggingSeverity.UNSET)


def serve(node: Node, goes_on: Callable[[], bool]) -> None:
    """Take messages and calls of a node as long as asked to, whatever the wall clock does.

    The DDS of the wheels on PyPI waits until a time of the wall clock. Where that is set back
    meanwhile, a wait of half a second takes as long as it was set back, and with it timers,
    services and Ctrl-C: so a thread that sleeps by the steady clock ends every wait.
    """
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    threading.Thread(target=_wake, args=(executor,), daemon=True).start()
    try:
        while goes_on():
            executor.spin_once(LONGEST_WAIT)
    except RCLError:
        if ok():
            raise
    finally:
        executor.shutdown()


def _wake(executor: SingleThreadedExecutor) -> None:
    with suppress(InvalidHandle, RCLError):  # the end
        while executor.get_nodes():
            executor.wake()
            time.sleep(LONGEST_WAIT)


def plainly(error: Exception) -> str:
    """Return an error as one line, without where in the sources of ROS it was found."""
    text = ' '.join(re.sub(r', at /[^\s,]+', '', str(error)).split())
    if type(error).__name__ == 'UnknownROSArgsError':
        return f'unknown arguments after --ros-args: {text}'
    return re.sub('^(failed to initialize rcl|Failed to parse ROS arguments): ', '', text)
