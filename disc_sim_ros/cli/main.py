"""The wrapper of every program: errors in one line, exit codes, Ctrl-C, a closed stdout.

Exit codes: 0 (or what the program returns), 1 for a failure, 2 for bad input, 128 + n for a signal
n. If the reader of stdout closes it, the program ends with 141, as if SIGPIPE had ended it.
"""

from collections.abc import Callable, Sequence
import signal
from typing import TYPE_CHECKING

from disc_sim_ros.cli import output
from disc_sim_ros.errors import ConfigError, DiscSimError

if TYPE_CHECKING:
    import argparse

    from disc_sim_ros.cli.arguments import Parser

FAILED, BAD_INPUT, DIFFERENT = 1, 2, 3  # exit codes; 3: a computed flight is not the recorded one


class UsageError(DiscSimError):
    """Flags that contradict each other, or a flag that is missing; one line says which."""


def run_program(
    parser: 'Parser',
    run: 'Callable[[argparse.Namespace], int]',
    arguments: Sequence[str] | None,
    *,
    in_flags: 'Callable[[ConfigError, argparse.Namespace, Parser], ConfigError] | None' = None,
) -> int:
    """Parse the arguments, run a program and return its exit code.

    Args:
        parser: The command line of the program; its default `outputs` has the checks of the
            files and folders that it writes, see `output.check_outputs`.
        run: The program: takes the parsed arguments and returns an exit code.
        arguments: Words of the command line; None for those of this process.
        in_flags: Returns an error under the name of the flag that gave the refused value; None
            where errors name the flag already.

    Raises:
        SystemExit: `--help` or `--version` (code 0), or bad input (code 2, one line on stderr).
    """
    output.mend_streams()
    try:
        with output.flushed_stdout():
            chosen = parser.parse_args(arguments)
            try:
                output.check_outputs(chosen)
                return run(chosen)
            except UsageError as error:
                parser.error(str(error))
            except ConfigError as error:
                parser.error(str(in_flags(error, chosen, parser) if in_flags else error))
    except DiscSimError as error:
        output.note(parser.prog, f'error: {error}')
        return FAILED
    except output.ClosedStdoutError:
        return 128 + signal.SIGPIPE
    except KeyboardInterrupt as interrupt:
        number = interrupt.args[0] if interrupt.args else signal.SIGINT
        return 128 + int(number)
