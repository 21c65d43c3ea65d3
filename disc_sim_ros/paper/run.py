"""The parts of a run of `paper_figures`; each may run in a process of its own."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import time

from disc_sim_ros import files
from disc_sim_ros.paper import figure_files, report
from disc_sim_ros.paper.figure_files import WrittenFigure
from disc_sim_ros.paper.figures import FIGURES
from disc_sim_ros.paper.statements import table
from disc_sim_ros.paper.statements.rule import Result
from disc_sim_ros.paper.style import DARK, LIGHT

STATEMENTS = 'statements'
PARTS = (*FIGURES, STATEMENTS)


@dataclass(frozen=True)
class Done:
    """A finished part: a figure, or the table of statements."""

    key: str
    title: str
    seconds: float
    figure: WrittenFigure | None = None
    results: tuple[Result, ...] | None = None


def part(key: str, folder: Path, formats: Sequence[str], *, dark: bool) -> Done:
    """Compute one of `PARTS` and write its files.

    Raises:
        OSError: The system refuses to write.
    """
    if key == STATEMENTS:
        started = time.perf_counter()
        results = table.evaluate()
        files.write_whole(folder / 'statements.csv', table.csv(results).encode())
        seconds = time.perf_counter() - started
        return Done(key, 'Table of every statement with a number', seconds, results=results)
    looks = (LIGHT, DARK) if dark else (LIGHT,)
    written = figure_files.write(FIGURES[key], folder, formats, looks)
    return Done(key, written.title, written.seconds, figure=written)


def write_report(done: Sequence[Done], folder: Path, *, dark: bool) -> report.Report:
    """Write report.md and report.html of the parts, in their order, and return the report."""
    ordered = sorted(done, key=lambda one: PARTS.index(one.key))
    figures = tuple(one.figure for one in ordered if one.figure is not None)
    results = next((one.results for one in ordered if one.results is not None), None)
    paper_report = report.Report(figures, results, dark)
    files.write_whole(folder / 'report.md', report.markdown(paper_report).encode())
    files.write_whole(folder / 'report.html', report.html(paper_report).encode())
    return paper_report
