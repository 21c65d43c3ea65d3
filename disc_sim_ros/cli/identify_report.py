"""The folder that `identify --report` writes."""

import argparse
import base64
from collections.abc import Sequence
from datetime import UTC, datetime
import html
import json
from pathlib import Path
import shlex
from typing import TYPE_CHECKING

from disc_sim_ros import __version__, files
from disc_sim_ros.cli import pages
from disc_sim_ros.units import System

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from disc_sim_ros.estimation.identification.crossvalidation import LeftOut
    from disc_sim_ros.estimation.identification.identify import Identification


def provenance(chosen: argparse.Namespace, words: Sequence[str]) -> list[str]:
    """Return what made a result: version, date, command."""
    day = datetime.now(UTC).strftime('%Y-%m-%d')
    return [
        f'Identified by disc_sim_ros {__version__} on {day} from:',
        *(f'  {source}' for source in chosen.throws),
        f'Command: {chosen.prog} {shlex.join(words)}',
    ]


def write(
    folder: Path,
    result: 'Identification',
    misses: 'Sequence[LeftOut]',
    lines: Sequence[str],
    system: System,
) -> None:
    """Write a new folder with report.html, report.json and, if it can be made, throws.html.

    The pages are in a system of units, report.json in SI units.
    """
    from disc_sim_ros.estimation.identification import plots, report  # noqa: PLC0415

    figures = [
        plots.paths(result, system),
        plots.residuals(result, system),
        plots.correlations(result),
    ]
    text = report.text(result, misses, system)
    document = json.dumps(report.document(result, misses), allow_nan=False, indent=1)
    pictures = '\n'.join(_picture(figure) for figure in figures if figure is not None)
    throws = _page_of_throws(result, system)
    link = '<p><a href="throws.html">The fitted flights in 3D</a></p>' if throws else ''
    escaped = html.escape('\n'.join([*lines, '', text]))
    page = (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        '<title>Identification of a disc</title>'
        '<style>body{font:16px sans-serif;max-width:60em;margin:1em auto;padding:0 1em}'
        'img{max-width:100%;background:#fff}pre{white-space:pre-wrap}'
        ':root{color-scheme:light dark}</style>'
        f'<h1>Identification of a disc</h1><pre>{escaped}</pre>{link}{pictures}</html>'
    )
    with files.whole_folder('--report', folder) as made:
        made.mkdir()
        (made / 'report.html').write_text(page, encoding='utf-8')
        (made / 'report.json').write_text(document, encoding='utf-8')
        if throws:
            (made / 'throws.html').write_bytes(throws)


def _page_of_throws(result: 'Identification', system: System) -> bytes:
    """Return a page of the fitted flights; empty without the package for pages."""
    from disc_sim_ros.view.page import ViewerMissingError, page  # noqa: PLC0415
    from disc_sim_ros.view.shown import ShownFlight  # noqa: PLC0415

    flights = [
        ShownFlight(
            throw.name,
            f'fitted to {throw.times[-1]:.2f} s of measurements',
            result.flight(k, pages.RATE),
            landed=False,
        )
        for k, throw in enumerate(result.problem.throws)
    ]
    try:
        return page(flights, 'Throws fitted by identify', system)
    except ViewerMissingError:
        return b''


def _picture(figure: 'Figure') -> str:
    from disc_sim_ros.analysis.plots import image  # noqa: PLC0415 - matplotlib is slow

    data = base64.b64encode(image(figure, 'png', dpi=110)).decode()
    return f'<p><img alt="plot" src="data:image/png;base64,{data}"></p>'
