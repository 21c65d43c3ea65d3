"""A CSV file of measured throws as a program reads it: what it leaves out is said."""

from typing import TYPE_CHECKING

from disc_sim_ros.cli import output

if TYPE_CHECKING:
    from disc_sim_ros.estimation.throw_csv import Columns


def read(source: str, thing: str, prog: str) -> 'dict[str, Columns]':
    """Return the measurements of each throw, by its name; note the columns that are not read.

    Args:
        source: The file.
        thing: What it is to the user, for errors.
        prog: Name of the program, for the note on stderr.

    Raises:
        ConfigError: As of `throw_csv.read`.
    """
    from disc_sim_ros.estimation import throw_csv  # noqa: PLC0415 - numpy is slow

    measured = throw_csv.read(source, thing)
    if measured.unread:
        output.note(prog, f'{source}: columns that are not read: {", ".join(measured.unread)}')
    return measured.throws
