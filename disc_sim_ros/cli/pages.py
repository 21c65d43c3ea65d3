"""Pages of flights: the flags `--html` and `--view`, and the browser that opens a page."""

import argparse
from datetime import datetime
import os
from pathlib import Path
import sys
from typing import TYPE_CHECKING
import webbrowser

from disc_sim_ros.cli import output
from disc_sim_ros.cli.arguments import path
from disc_sim_ros.errors import ConfigError, DiscSimError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from disc_sim_ros.analysis.bag_analysis import Analysis
    from disc_sim_ros.units import System
    from disc_sim_ros.view.shown import ShownFlight

RATE = 200.0  # samples per second of a flight in a page, without --samples
FOLDER = 'flights'  # of pages without a name
NO_BROWSER = 'no browser was opened: there is no screen, or no browser'


def add_page(group: argparse._ActionsContainer) -> None:
    """Add the flags `--html` and `--view`."""
    group.add_argument(
        '--html',
        type=path,
        default=argparse.SUPPRESS,
        metavar='FILE.html',
        help='also write a page that shows the flight in 3D in any browser, one file that needs '
        'no network; needs trimesh',
    )
    group.add_argument(
        '--view',
        action='store_true',
        help='open the page in a browser; without --html the file is flights/DATE_TIME.html',
    )


def _check_html(name: str) -> None:
    output.check_writable('--html', name)


def _check_view(_: object) -> None:
    folder = Path(FOLDER)
    reason = ''
    if folder.exists() and not folder.is_dir():
        reason = 'File exists'
    elif not os.access(folder if folder.exists() else Path(), os.W_OK):
        reason = 'Permission denied'
    if reason:
        raise _no_folder(reason)


CHECKS = {'html': _check_html, 'view': _check_view}  # for `output.check_outputs`


def is_wanted(chosen: argparse.Namespace) -> bool:
    """Return True if one of the flags of `add_page` was given."""
    return hasattr(chosen, 'html') or bool(chosen.view)


def recorded(analysis: 'Analysis', system: 'System') -> 'ShownFlight':
    """Return a flight of a bag for a page.

    Raises:
        DiscSimError: None of its messages has a position.
    """
    from disc_sim_ros.analysis import bag_report  # noqa: PLC0415 - scipy takes half a second
    from disc_sim_ros.view import shown  # noqa: PLC0415

    known = bag_report.document(analysis)
    name = f'{analysis.flight.disc.name}, flight {analysis.flight.number}'
    try:
        return shown.of_recording(
            analysis.trajectory,
            name,
            bag_report.title(analysis, system),
            landed=known['landed'],
            wind_is_known=analysis.wind_is_known,
            turns_with_spin=known['launch']['frame_spins'],
        )
    except ValueError as error:
        raise DiscSimError(f'{name}: {error}') from None


def write(
    chosen: argparse.Namespace, flights: 'Sequence[ShownFlight]', title: str, system: 'System'
) -> str:
    """Write the page that the flags ask for, open it, and return a line about it.

    Args:
        chosen: The flags.
        flights: The flights.
        title: Heading of the page.
        system: Units of the page.

    Raises:
        ConfigError: The file cannot be written.
        ViewerMissingError: trimesh is missing.
    """
    from disc_sim_ros.view.page import page  # noqa: PLC0415 - only with these flags

    content = page(flights, title, system)
    name = getattr(chosen, 'html', None) or _new_name()
    flag = '--html' if hasattr(chosen, 'html') else '--view'
    output.write_whole(flag, name, content)
    if chosen.view and not opened(Path(name)):
        output.note(chosen.prog, f'note: {NO_BROWSER}')
    return f'wrote {name}, {len(content) / 1e6:.1f} MB: open it in a browser'


def opened(page: Path) -> bool:
    """Open a page in the browser of the desktop; return False if there is none."""
    # Without a screen, webbrowser would start a browser for the terminal and wait for its end.
    if os.environ.get('CI') or not (
        sys.platform == 'darwin' or os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')
    ):
        return False
    try:
        return webbrowser.open(page.resolve().as_uri())
    except (webbrowser.Error, OSError):
        return False


def _new_name() -> str:
    """Return the name of a new file in `flights`, below the home of the user where browsers read.

    Raises:
        ConfigError: The folder cannot be made.
    """
    folder = Path(FOLDER)
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise _no_folder(str(error.strerror)) from None
    stem = f'{datetime.now().astimezone():%Y-%m-%d_%H-%M-%S}'
    names = (f'{stem}.html', *(f'{stem}_{number}.html' for number in range(2, 1000)))
    return str(next(folder / name for name in names if not (folder / name).exists()))


def _no_folder(reason: str) -> ConfigError:
    allowed = f'cannot make the folder {FOLDER} ({reason}); give --html FILE.html'
    return ConfigError('--view', FOLDER, allowed)
