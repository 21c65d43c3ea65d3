"""`paper_figures`: computes every figure of the paper, and compares its numbers with ours."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
import multiprocessing
import os
from pathlib import Path
from queue import SimpleQueue
import sys
import tempfile
import time
from typing import TYPE_CHECKING

from disc_sim_ros import __version__
from disc_sim_ros.cli import output, start
from disc_sim_ros.cli.arguments import Parser, path
from disc_sim_ros.cli.main import run_program
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics import flight

if TYPE_CHECKING:
    from concurrent.futures import Future

    from disc_sim_ros.paper.run import Done

FORMATS = ('png', 'svg')
PARTS = ('3', '4', '5', '6', '7', '8', '9', '10', '11', '12', 'models', 'roll_rate', 'statements')
SLOW = {'5', '6', 'models', 'statements'}  # started first
MOST_JOBS = 64


def parser(prog: str = 'paper_figures') -> Parser:
    """Return the command line of `paper_figures`."""
    p = Parser(
        prog=prog,
        description='Compute and draw the figures of Crowther & Potts, Sports Engineering 10 '
        "(2007) 3-21, and compare the paper's numbers with ours. Writes report.html, report.md, "
        'and pictures and a CSV file for each figure; every axis label and CSV header states its '
        'unit (m, s, m/s, degrees, rad/s). Takes less than a minute; needs no ROS.',
    )
    p.set_defaults(prog=prog)
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    text = 'folder to write to; it is made if it does not exist, and files of the same names are '
    text += 'overwritten'
    p.add_argument('--out', type=path, default='paper_figures', metavar='DIR', help=text)
    p.add_argument(
        '--only',
        type=_list_of(PARTS),
        default=PARTS,
        metavar='PARTS',
        help=f'comma-separated list of {", ".join(PARTS)} (default: all)',
    )
    p.add_argument(
        '--formats',
        type=_list_of(FORMATS),
        default=FORMATS,
        metavar='KINDS',
        help='comma-separated list of png, svg (default: both)',
    )
    text = "also draw each picture for a dark background; the report follows the reader's setting"
    p.add_argument('--dark', action=argparse.BooleanOptionalAction, default=True, help=text)
    jobs = min(2, os.cpu_count() or 1)
    text = f'parallel processes, a whole number from 1 to {MOST_JOBS}'
    p.add_argument('--jobs', type=_jobs, default=jobs, metavar='N', help=text)
    return p


def main(arguments: Sequence[str] | None = None, prog: str = 'paper_figures') -> int:
    """Run `paper_figures` and return its exit code: 0, 1 for a failure, 2 for bad input."""
    return run_program(parser(prog), _run, arguments)


def _run(chosen: argparse.Namespace) -> int:
    folder = writable_folder(chosen.out)
    try:
        _write_all(chosen, folder)
    except BrokenProcessPool as error:
        raise DiscSimError(str(error)) from error
    except OSError as error:
        reason = error.strerror or str(error)
        raise DiscSimError(f'cannot write to {chosen.out} ({reason})') from error
    return 0


def _write_all(chosen: argparse.Namespace, folder: Path) -> None:
    """Write every chosen part and the report."""
    started = time.perf_counter()
    # Imported once the arguments are known to be right: matplotlib and scipy take a second.
    from disc_sim_ros.paper import run  # noqa: PLC0415

    if text := flight.first_call_note():
        output.note(chosen.prog, f'note: {text}')
        with start.ended_by_ctrl_c():
            _compile()
    total = len(chosen.only)
    output.show(f'{total} parts into {folder}/, {min(chosen.jobs, total)} at a time')
    done: list[Done] = []
    for one in _parts(chosen, folder):
        done.append(one)
        output.show(f'[{len(done):2d}/{total}] {one.title}, {one.seconds:.1f} s')
    report = run.write_report(done, folder, dark=chosen.dark)
    output.show('\n'.join(report.summary()))
    seconds = time.perf_counter() - started
    output.show(f'wrote {folder / "report.html"} and {folder / "report.md"} in {seconds:.0f} s')


def writable_folder(name: str) -> Path:
    """Return the folder to write to; make it if it does not exist.

    Raises:
        ConfigError: `name` is not a folder, or files cannot be written in it.
    """
    folder = Path(name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except FileExistsError:
        raise ConfigError('--out', name, 'this is not a folder; give a folder') from None
    except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
        reason = getattr(error, 'strerror', None) or str(error)
        raise ConfigError('--out', name, f'cannot write there ({reason})') from None
    return folder


def _parts(chosen: argparse.Namespace, folder: Path) -> Iterator['Done']:
    """Yield the parts as they are finished."""
    from disc_sim_ros.paper import run  # noqa: PLC0415
    from disc_sim_ros.studies import executors  # noqa: PLC0415

    if chosen.jobs == 1 or len(chosen.only) == 1:
        for key in chosen.only:
            yield run.part(key, folder, chosen.formats, dark=chosen.dark)
        return
    with executors.processes(min(chosen.jobs, len(chosen.only))) as pool:
        try:
            finished: SimpleQueue[Future[Done]] = SimpleQueue()
            for key in sorted(chosen.only, key=lambda key: key not in SLOW):
                executors.submitted(
                    pool, finished, run.part, key, folder, chosen.formats, dark=chosen.dark
                )
            for _ in chosen.only:
                yield finished.get().result()
        except BaseException:
            for child in multiprocessing.active_children():
                child.terminate()
            raise


def _compile() -> None:
    from disc_sim_ros.physics import disc_file  # noqa: PLC0415
    from disc_sim_ros.physics.launch import Launch  # noqa: PLC0415

    setup = flight.Setup(disc=disc_file.load_disc('frisbee'))
    flight.fly(Launch(), setup, duration=0.01, ground=False)


def _list_of(allowed: Sequence[str]) -> Callable[[str], tuple[str, ...]]:
    def convert(text: str) -> tuple[str, ...]:
        words = [word.strip().lower() for word in text.split(',')]
        for word in words:
            if word not in allowed:
                message = f'{word!r} is not allowed; choose from {", ".join(allowed)}'
                raise argparse.ArgumentTypeError(message)
        return tuple(word for word in allowed if word in words)

    return convert


def _jobs(text: str) -> int:
    number = int(text) if text.isascii() and text.isdigit() and len(text) < 4 else 0
    if not 1 <= number <= MOST_JOBS:
        message = f'{text!r} is not allowed; give a whole number from 1 to {MOST_JOBS}'
        raise argparse.ArgumentTypeError(message)
    return number


if __name__ == '__main__':
    sys.exit(main())
