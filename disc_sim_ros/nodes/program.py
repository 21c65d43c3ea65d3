"""What the programs of this package have in common: signals, the start of ROS, plain errors."""

from collections.abc import Callable
import re
import signal

import rclpy
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.logging import set_logger_level
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from disc_sim_ros.core.errors import ConfigError


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


def plainly(error: Exception) -> str:
    """Return an error as one line, without where in the sources of ROS it was found."""
    text = ' '.join(re.sub(r', at /[^\s,]+', '', str(error)).split())
    if type(error).__name__ == 'UnknownROSArgsError':
        return f'unknown arguments after --ros-args: {text}'
    return re.sub('^(failed to initialize rcl|Failed to parse ROS arguments): ', '', text)
