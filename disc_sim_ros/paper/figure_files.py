"""A figure of the paper as one object, and the files that are written for it."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
import time
from typing import Generic, TypeVar

from matplotlib.figure import Figure

from disc_sim_ros.files import write_whole
from disc_sim_ros.paper import crosscheck, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.style import DARK, LIGHT, Look

FORMATS = ('png', 'svg')

Data = TypeVar('Data')


@dataclass(frozen=True, kw_only=True)
class PaperFigure(Generic[Data]):
    """A figure of the paper, or one of our own that belongs to it.

    Attributes:
        key: Its name for `paper_figures --only`.
        title: Its title.
        conditions: Model, damping and moment axes, in sentences.
        compute: Computes the data.
        plot: Draws the data in the colours of a look.
        findings: Returns the results, in sentences.
        table: Returns the data as CSV, with units in the header.
        example: Returns the flight that is integrated a second time.
    """

    key: str
    title: str
    conditions: str
    compute: Callable[[], Data]
    plot: Callable[[Data, Look], Figure]
    findings: Callable[[Data], list[str]]
    table: Callable[[Data], str]
    example: Callable[[Data], Curve]


@dataclass(frozen=True)
class WrittenFigure:
    """The files and the results of one figure.

    Attributes:
        key: Its name for `paper_figures --only`.
        title: Its title.
        conditions: Model, damping and moment axes.
        findings: The results, in sentences.
        files: Names of its files.
        example: Label of the flight that was integrated a second time.
        distance: Largest distance of the second integration from that flight [m].
        seconds: Run time [s].
    """

    key: str
    title: str
    conditions: str
    findings: tuple[str, ...]
    files: tuple[str, ...]
    example: str
    distance: float
    seconds: float


def stem(key: str) -> str:
    """Return the first part of the file names of a figure: fig05, models, roll_rate."""
    return f'fig{int(key):02d}' if key.isdigit() else key


def picture(key: str, kind: str, look: Look) -> str:
    """Return the name of a picture."""
    return f'{stem(key)}{"_dark" if look is DARK else ""}.{kind}'


def write(
    figure: PaperFigure[Data], folder: Path, formats: Sequence[str], looks: Sequence[Look]
) -> WrittenFigure:
    """Compute a figure and write its pictures and its CSV file.

    Raises:
        OSError: The system refuses.
    """
    started = time.perf_counter()
    data = figure.compute()
    files = [f'{stem(figure.key)}.csv']
    write_whole(folder / files[0], figure.table(data).encode())
    for look in looks:
        sheet = figure.plot(data, look)
        for kind in formats:
            files.append(picture(figure.key, kind, look))
            write_whole(folder / files[-1], style.image(sheet, kind, look))
    example = figure.example(data)
    return WrittenFigure(
        figure.key,
        figure.title,
        ' '.join(figure.conditions.split()),
        tuple(figure.findings(data)),
        tuple(files),
        example.label,
        crosscheck.largest_distance(example.flight),
        time.perf_counter() - started,
    )


def main(*figures: PaperFigure[Data]) -> int:
    """Write some figures alone: `python -m disc_sim_ros.paper.fig05_typical_flight DIR`."""
    titles = '; '.join(figure.title for figure in figures)
    parser = argparse.ArgumentParser(description=titles)
    parser.add_argument('folder', nargs='?', default='paper_figures', help='folder to write to')
    folder = Path(parser.parse_args().folder)
    folder.mkdir(parents=True, exist_ok=True)
    for figure in figures:
        written = write(figure, folder, FORMATS, (LIGHT, DARK))
        print('\n'.join((written.title, written.conditions, *written.findings, *written.files)))
    return 0
