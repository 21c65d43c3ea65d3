"""Results of benchmarks/run.py as JSON, as a table in docs/benchmarks.md, as lines of README."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
import json
from pathlib import Path
import textwrap

from lines import Line, number

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / 'docs/benchmarks.json'
PAGES = {ROOT / 'docs/benchmarks.md': False, ROOT / 'README.md': True}  # True: a few lines
BUSY = 1.0  # a higher load average at the start means that other programs run
BEGIN, END = '<!-- benchmarks: written by `make bench` -->', '<!-- end of benchmarks -->'


@dataclass(frozen=True, kw_only=True)
class Machine:
    """The machine of a measurement, and the date."""

    cpu: str
    cores: int
    system: str
    python: str
    numba: str
    numpy: str
    date: str
    load_at_start: float  # average of a minute
    load_at_end: float
    seconds: float  # duration of all benchmarks


@dataclass(frozen=True, kw_only=True)
class Result:
    """The results of one benchmark."""

    command: str
    load: float  # average of the minute before the start
    lines: tuple[Line, ...]


@dataclass(frozen=True, kw_only=True)
class Run:
    """The results of `make bench`."""

    machine: Machine
    results: tuple[Result, ...]


def saved(run: Run) -> str:
    """Return a run as JSON."""
    return json.dumps(asdict(run), indent=1, ensure_ascii=False) + '\n'


def loaded(text: str) -> Run:
    """Return the run that `saved` wrote."""
    document = json.loads(text)
    results = (
        Result(
            command=result['command'],
            load=result['load'],
            lines=tuple(Line(**line) for line in result['lines']),
        )
        for result in document['results']
    )
    return Run(machine=Machine(**document['machine']), results=tuple(results))


def described(machine: Machine) -> str:
    """Return the machine in a sentence."""
    busy = ' Other programs were running: an idle machine is faster and more even.'
    return (
        f'Measured in {machine.seconds / 60:.0f} minutes on {machine.date}: {machine.cpu}, '
        f'{machine.cores} cores, {machine.system}; Python {machine.python}, numba '
        f'{machine.numba}, numpy {machine.numpy}; load average {machine.load_at_start:.1f} when '
        f'it started and {machine.load_at_end:.1f} when it ended.'
        f'{busy if machine.load_at_start > BUSY else ""}'
    )


def section(run: Run, *, short: bool) -> str:
    """Return the text between the markers of a page: a table, or a list of the short lines."""
    if short:
        return '\n'.join(
            item(line) for result in run.results for line in result.lines if line.short
        )
    head = ('measurement', 'this package', 'peer', 'ratio', 'bound', 'load', 'command')
    rows = [
        (*cells(line), bound(line), f'{result.load:.1f}', f'`{result.command}`')
        for result in run.results
        for line in result.lines
    ]
    return f'{table(head, rows)}\n\n{described(run.machine)}'


def item(line: Line) -> str:
    """Return a line as an item of a list in Markdown, at most 99 characters wide."""
    peer = f'; peer: {line.beside}' if line.beside else ''
    return textwrap.fill(f'- {line.what}: {line.ours}{peer}', 99, subsequent_indent='  ')


def cells(line: Line) -> tuple[str, ...]:
    """Return the first cells of the row of a line."""
    ratio = '' if line.ratio is None else number(line.ratio)
    return line.what, line.ours, line.beside, ratio


def bound(line: Line) -> str:
    """Return the bound of a line, and whether it was kept."""
    verdict = {True: 'kept', False: '**not kept**', None: 'not measured'}[line.kept]
    return f'{line.bound}: {verdict}' if line.bound else ''


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Return a table in Markdown."""
    wide = [head, ('---',) * len(head), *rows]
    return '\n'.join(f'| {" | ".join(row)} |' for row in wide)


def replaced(page: str, text: str) -> str:
    """Return a page with other text between its markers.

    Raises:
        ValueError: The page does not have exactly one pair of markers.
    """
    if page.count(BEGIN) != 1 or page.count(END) != 1 or page.index(BEGIN) > page.index(END):
        raise ValueError(f'a page needs one {BEGIN} and one {END} after it')
    before, rest = page.split(BEGIN)
    return f'{before}{BEGIN}\n{text}\n{END}{rest.split(END)[1]}'


def between(page: str) -> str:
    """Return the text between the markers of a page."""
    return page.partition(f'{BEGIN}\n')[2].partition(f'\n{END}')[0]


def write(run: Run) -> None:
    """Write the results, and both pages."""
    pages = {
        page: replaced(page.read_text(encoding='utf-8'), section(run, short=short))
        for page, short in PAGES.items()
    }
    RESULTS.write_text(saved(run), encoding='utf-8')
    for page, text in pages.items():
        page.write_text(text, encoding='utf-8')
