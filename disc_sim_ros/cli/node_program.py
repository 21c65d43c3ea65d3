"""The wrapper of the nodes' executables. It imports little: Ctrl-C must end them at any time."""

from collections.abc import Callable, Sequence
import sys

from disc_sim_ros import __version__
from disc_sim_ros.ros.signals import exit_on_signal


def run_node(
    usage: str, start: Callable[[list[str]], int], arguments: Sequence[str] | None, prog: str
) -> int:
    """Run a ROS node and return its exit code.

    Ctrl-C and SIGTERM end it with code 0, also while Python still imports it.

    Args:
        usage: The text of `--help`; '{prog}' stands for the name of the program.
        start: Imports and runs the node; takes the words of the command line, `prog` first.
        arguments: Words of the command line; None for those of this process.
        prog: Name of the program.
    """
    exit_on_signal()
    words = sys.argv[1:] if arguments is None else list(arguments)
    if {'-h', '--help'} & set(words):
        sys.stdout.write(usage.format(prog=prog))
        return 0
    if '--version' in words:
        sys.stdout.write(f'{prog} {__version__}\n')
        return 0
    return start([prog, *words])
