"""Results of benchmarks/run.py as JSON, and as the tables of docs/benchmarks.md and README.md."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
import json
from pathlib import Path

from lines import Line, number

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / 'docs/benchmarks.json'
PAGES = {ROOT / 'docs/benchmarks.md': False, ROOT / 'README.md': True}  # True: the short table
BUSY = 1.0  # load average at the start, from which others are at work
BEGIN, END = '<!-- benchmarks: written by `make bench` -->', '<!-- end of benchmarks -->'


@dataclass(frozen=True, kw_only=True)
class Machine:
    """What was measured on, and when."""

    cpu: str
    cores: int
    system: str
    python: str
    numba: str
    numpy: str
    date: str
    load_at_start: float  # average of a minute
    load_at_end: float
    seconds: float  # that it took


@dataclass(frozen=True, kw_only=True)
class Result:
    """What one benchmark found."""

    command: str
    load: float  # average of the minute before it began
    lines: tuple[Line, ...]


@dataclass(frozen=True, kw_only=True)
class Run:
    """What `make bench` found."""

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
    busy = ' Other work kept it busy: a quiet machine is faster and more even.'
    return (
        f'Measured in {machine.seconds / 60:.0f} minutes on {machine.date}: {machine.cpu}, '
        f'{machine.cores} cores, {machine.system}; Python {machine.python}, numba '
        f'{machine.numba}, numpy {machine.numpy}; load average {machine.load_at_start:.1f} when '
        f'it began and {machine.load_at_end:.1f} when it ended.'
        f'{busy if machine.load_at_start > BUSY else ""}'
    )


def section(run: Run, *, short: bool) -> str:
    """Return what stands between the markers of a page."""
    if short:
        head = ('what', 'here', 'beside', 'ratio')
        rows = [cells(line) for result in run.results for line in result.lines if line.short]
    else:
        head = ('what', 'here', 'beside', 'ratio', 'to keep', 'load', 'command')
        rows = [
            (*cells(line), bound(line), f'{result.load:.1f}', f'`{result.command}`')
            for result in run.results
            for line in result.lines
        ]
    return f'{table(head, rows)}\n\n{described(run.machine)}'


def cells(line: Line) -> tuple[str, ...]:
    """Return the first cells of the row of a line."""
    ratio = '' if line.ratio is None else number(line.ratio)
    return line.what, line.ours, line.beside, ratio


def bound(line: Line) -> str:
    """Return what is to be kept, and whether it was."""
    told = {True: 'kept', False: '**not kept**', None: 'not measured'}[line.kept]
    return f'{line.bound}: {told}' if line.bound else ''


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Return a table in Markdown."""
    wide = [head, ('---',) * len(head), *rows]
    return '\n'.join(f'| {" | ".join(row)} |' for row in wide)


def replaced(page: str, text: str) -> str:
    """Return a page with other text between its markers.

    Raises:
        ValueError: It has not one pair of markers.
    """
    if page.count(BEGIN) != 1 or page.count(END) != 1 or page.index(BEGIN) > page.index(END):
        raise ValueError(f'a page needs one {BEGIN} and one {END} behind it')
    before, rest = page.split(BEGIN)
    return f'{before}{BEGIN}\n{text}\n{END}{rest.split(END)[1]}'


def between(page: str) -> str:
    """Return what stands between the markers of a page."""
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
