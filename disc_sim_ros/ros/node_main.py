"""What the `main` of each node shares: signals, the start of ROS, the executor, exit codes."""

from collections.abc import Callable, Sequence
from contextlib import suppress
import gc
import re
import sys
import threading
import time
from typing import Protocol

import rclpy
from rclpy.duration import Duration
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import set_logger_level
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok, remove_ros_args, try_shutdown

from disc_sim_ros.errors import BagError, ConfigError, DiscSimError
from disc_sim_ros.ros.signals import exit_on_signal, on_signal

LONGEST_WAIT = 0.5  # s until a signal takes effect
LAST_DELIVERY = 0.2  # s for subscribers to get what was published last ...
LAST_DELIVERY_UNDER_LOAD = 3.5  # ... on a machine that wakes sleepers later than this on average:
LATE = 0.02  # s; Fast DDS repeats what a subscriber lacks every 3 s
_FATAL, _UNSET = 50, 0  # log levels of rcl


class ProgramNode(Protocol):
    """What `run` needs of a node, beside `rclpy.node.Node`."""

    @property
    def is_working(self) -> bool:
        """Return False once the node cannot go on."""

    def start(self) -> None:
        """Start the threads of the node."""

    def stop(self) -> str:
        """End them; return a last line for people, or ''; raise DiscSimError if they failed."""

    def destroy_node(self) -> None:
        """Leave the graph."""


def run(program: str, make_node: Callable[[], ProgramNode], args: Sequence[str] | None) -> int:
    """Run a node until Ctrl-C, SIGTERM or its own end.

    Args:
        program: Name of the program, which stands before each line on stderr.
        make_node: Makes the node.
        args: Arguments with the name of the program first; those of the process where None.

    Returns:
        The exit code: 0, 1 if the node failed, 2 for bad arguments or parameters.
    """
    exit_on_signal()
    signals: list[int] = []  # not an Event: a handler may interrupt itself
    try:
        init(list(sys.argv if args is None else args))
        on_signal(lambda number, _: signals.append(number))
        node = make_node()
    except (DiscSimError, ParameterException, RuntimeError) as error:  # rclpy's are RuntimeErrors
        sys.stderr.write(f'{program}: error: {one_line(error)}\n')
        try_shutdown()
        return 1 if isinstance(error, BagError) and not isinstance(error, ConfigError) else 2
    gc.collect()
    gc.freeze()  # a full collection would stall the node for tens of milliseconds
    node.start()
    try:
        serve(node, lambda: not signals and node.is_working)  # type: ignore[arg-type]
    finally:
        code = _stop(program, node)
        wait_for_subscribers(node)  # type: ignore[arg-type]
        node.destroy_node()
        try_shutdown()
    return code


def init(args: list[str]) -> None:
    """Initialise ROS with the arguments of a program, its name first.

    Raises:
        ConfigError: An argument that is not for ROS.
        RuntimeError: ROS does not accept an argument.
    """
    set_logger_level('rcl', _FATAL)  # it would print a part of the error, too
    other = remove_ros_args(args)[1:]
    if other:
        raise ConfigError(
            'arguments', ' '.join(other), 'parameters are -p NAME:=VALUE after --ros-args'
        )
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    set_logger_level('rcl', _UNSET)


def serve(node: Node, keep_running: Callable[[], bool]) -> None:
    """Run the callbacks of a node while `keep_running()`, even if the wall clock is set.

    The DDS of the wheels on PyPI waits until a time of the wall clock. If that clock is set back
    meanwhile, a wait of half a second takes as much longer, and with it timers, services and
    Ctrl-C. So a thread that sleeps by the steady clock ends every wait.
    """
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    threading.Thread(target=_wake, args=(executor,), daemon=True).start()
    try:
        while keep_running():
            executor.spin_once(LONGEST_WAIT)
    except RuntimeError:  # rclpy's, if another thread has shut ROS down
        if ok():
            raise
    finally:
        executor.shutdown()


def _wake(executor: SingleThreadedExecutor) -> None:
    with suppress(RuntimeError):  # rclpy's, once the executor is shut down
        while executor.get_nodes():
            executor.wake()
            time.sleep(LONGEST_WAIT)


def _stop(program: str, node: ProgramNode) -> int:
    try:
        last_line = node.stop()
    except DiscSimError as error:
        sys.stderr.write(f'{program}: error: {error}\n')
        return 1
    if last_line:
        sys.stderr.write(f'{program}: {last_line}\n')
    return 0


def wait_for_subscribers(node: Node) -> None:
    """Wait until reliable subscribers have every message, at most `LAST_DELIVERY`.

    A publisher that is destroyed takes along what was not delivered yet. On a machine under load
    that were up to 570 messages of a topic at 1 kHz, and a recorder cannot know of them.
    """
    if not any(publisher.get_subscription_count() for publisher in node.publishers):
        return
    end = time.monotonic() + (LAST_DELIVERY_UNDER_LOAD if _lateness() > LATE else LAST_DELIVERY)
    for publisher in node.publishers:
        left = max(end - time.monotonic(), 0.0)
        with suppress(RuntimeError):  # the middleware does not support it
            publisher.wait_for_all_acked(Duration(seconds=left))


def _lateness() -> float:
    """Return by how much this process wakes too late from a short sleep, on average [s]."""
    naps, nap = 5, 0.005
    start = time.monotonic()
    for _ in range(naps):
        time.sleep(nap)
    return (time.monotonic() - start) / naps - nap


def one_line(error: Exception) -> str:
    """Return an error as one line, without its place in the sources of ROS."""
    text = ' '.join(re.sub(r', at /[^\s,]+', '', str(error)).split())
    if type(error).__name__ == 'UnknownROSArgsError':
        return f'unknown arguments after --ros-args: {text}'
    return re.sub('^(failed to initialize rcl|Failed to parse ROS arguments): ', '', text)
