"""`sweep`: flies grids and random ensembles, without ROS."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
import json
import sys
import time
from typing import TYPE_CHECKING

from disc_sim_ros import __version__
from disc_sim_ros.cli import flags, output, study_flags
from disc_sim_ros.cli.arguments import Parser, add_quantity, path, whole
from disc_sim_ros.cli.main import UsageError, run_program
from disc_sim_ros.cli.progress import ProgressBar, duration
from disc_sim_ros.cli.study_flags import listed
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.quantities import STUDY
from disc_sim_ros.units import SYSTEMS

if TYPE_CHECKING:
    from disc_sim_ros.studies.study import Study

DEFAULT_COUNT = 1000  # samples, where a quantity scatters
DEFAULT_OUTPUT = 'sweep.parquet' if find_spec('pyarrow') else 'sweep.csv'


def parser(prog: str = 'sweep') -> Parser:
    """Return the command line of `sweep`."""
    p = Parser(
        prog=prog,
        conflict_handler='resolve',  # --seed and --step mean more here than in `fly`
        description='Fly grids and random ensembles into one Parquet or CSV file, and print a '
        'summary. The flags of `fly` hold for every flight; --vary, --normal, --uniform and '
        '--scatter change quantities from flight to flight. Angles and control inputs have the '
        f'signs of {flags.PAPER}; positions and wind are in map axes: x forward, y left, z up.',
        epilog=f'{study_flags.names_text()} Exit code 0; 1: the sweep failed; 2: bad input; 130: '
        'Ctrl-C. Finished flights are kept in FILE.parts, and --resume continues from there.',
    )
    p.set_defaults(
        prog=prog,
        outputs={'plot': output.check_plot, 'output': partial(output.check_writable, '--output')},
    )
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    study_flags.add_throw(p)
    what = p.add_argument_group('differences from flight to flight')
    text = 'values of a grid quantity; several quantities span the grid'
    study_flags.add_list(what, '--vary', 'NAME=START:STOP:STEP|START:STOP/N|A,B,C', text)
    study_flags.add_list(what, '--normal', 'NAME=MEAN,SD', 'normal scatter')
    study_flags.add_list(what, '--uniform', 'NAME=LOW,HIGH', 'uniform scatter')
    text = (
        'normal scatter around the value of the grid or of the flag, or of the disc as it states'
    )
    study_flags.add_list(what, '--scatter', 'NAME=SD|disc', text)
    text = 'correlation of two scattered quantities, from -1 to 1'
    study_flags.add_list(what, '--correlation', 'A,B=R', text)
    text = f'samples at each grid point (default: {DEFAULT_COUNT}; without scatter 1)'
    add_quantity(what, '--count', STUDY['count'], text=text, default=argparse.SUPPRESS)
    what.add_argument(
        '--sobol',
        dest='sampling',
        action='store_const',
        const='sobol',
        default='random',
        help='draw quasi-random samples, which fill the space evenly; best with a --count of 2^k',
    )
    study_flags.add_seed(what, 'seed of the scatter and of the gusts')
    what.add_argument(
        '--gust-seeds',
        choices=('each', 'same'),
        default='each',
        help='each: sample k flies in the gusts of seed N + k; same: all flights fly in those of '
        'seed N',
    )
    made = p.add_argument_group('execution and output')
    study_flags.add_workers(made)
    made.add_argument(
        '--batch',
        type=whole(1, 10**6),
        default=argparse.SUPPRESS,
        metavar='N',
        help='flights that a worker flies and stores at a time (default: 8192)',
    )
    made.add_argument(
        '--output',
        type=path,
        default=DEFAULT_OUTPUT,
        metavar='FILE',
        help='ends in .parquet (needs pyarrow) or .csv',
    )
    made.add_argument(
        '--force', action='store_true', help='overwrite FILE, and discard an unfinished sweep'
    )
    made.add_argument('--resume', action='store_true', help='continue an interrupted sweep')
    output.add_plot(made)
    output.add_units(made)
    made.add_argument('--json', action='store_true', help='print the summary as one JSON document')
    return p


def main(arguments: Sequence[str] | None = None, prog: str = 'sweep') -> int:
    """Run `sweep` and return its exit code: 0, 1 for a failed sweep, 2 for bad input."""
    words = sys.argv[1:] if arguments is None else arguments
    return run_program(parser(prog), partial(_run, words=words), words, in_flags=flags.in_flags)


def _run(chosen: argparse.Namespace, words: Sequence[str]) -> int:
    plot = getattr(chosen, 'plot', None)
    study = study_of(chosen, words)
    # Only now: pyarrow takes a quarter of a second.
    from disc_sim_ros.studies import report, runner, summary  # noqa: PLC0415
    from disc_sim_ros.studies.executors import opened  # noqa: PLC0415

    study_flags.note_compilation(chosen.prog, study.setup)
    started = time.monotonic()
    with (
        _progress(chosen) as bar,
        opened(chosen.executor, getattr(chosen, 'workers', None)) as (executor, workers),
    ):
        path = runner.sweep(
            study,
            chosen.output,
            executor=executor,
            threads=workers,
            batch=getattr(chosen, 'batch', None),
            ahead=2 * workers,
            resume=chosen.resume,
            force=chosen.force,
            progress=bar,
        )
    seconds = time.monotonic() - started
    summarised = summary.summarise(path, study)
    if plot is not None:
        from disc_sim_ros.studies.plots import figure  # noqa: PLC0415 - matplotlib

        output.write_plot(plot, figure(path, summarised, SYSTEMS[chosen.units]))
    if chosen.json:
        output.show(json.dumps(report.summary_document(summarised), allow_nan=False))
        return 0
    lines = [report.summary_text(summarised, SYSTEMS[chosen.units])]
    size = path.stat().st_size
    rate = f' in {duration(seconds)}, {bar.new / seconds:.0f} flights/s' if bar.new else ''
    lines.append(f'  wrote    {path}, {study.size} rows, {size / 1e6:.1f} MB{rate}')
    if plot is not None:
        lines.append(f'  wrote    {plot}')
    output.show('\n'.join(lines))
    return 0


def study_of(chosen: argparse.Namespace, words: Sequence[str]) -> 'Study':
    """Return the study that the flags describe.

    Raises:
        UsageError: No flag makes the flights differ.
        ConfigError: Flags contradict each other, or a value is out of range.
    """
    from disc_sim_ros.studies.study import Study  # noqa: PLC0415

    vary = study_flags.grids(listed(chosen, 'vary'))
    texts = listed(chosen, 'scatter')
    scatter = study_flags.laws(
        listed(chosen, 'normal'),
        listed(chosen, 'uniform'),
        [text for text in texts if text != 'disc'],
        _uncertainty(chosen.disc) if 'disc' in texts else None,
    )
    if not vary and not scatter and not (hasattr(chosen, 'count') and chosen.turbulence):
        raise UsageError(
            'all flights would be the same; give --vary, --normal, --uniform or --scatter, or use '
            'fly'
        )
    study_flags.check_given(words, vary, scatter)
    release, setup, ratio = study_flags.thrown(chosen)
    return Study(
        setup=setup,
        launch=release,
        control=flags.control_of(chosen),
        advance_ratio=ratio,
        vary=vary,
        scatter=scatter,
        correlations=study_flags.pairs(listed(chosen, 'correlation')),
        count=getattr(chosen, 'count', DEFAULT_COUNT if scatter else 1),
        seed=chosen.seed,
        sampling=chosen.sampling,
        gusts=chosen.gust_seeds,
        duration=chosen.duration,
        ground=not chosen.no_ground,
    )


def _uncertainty(name: str) -> Mapping[str, float]:
    """Return the uncertainty of a disc, for `--scatter disc`."""
    uncertainty = load_disc(name).uncertainty
    if not uncertainty:
        allowed = (
            f'{name} states no uncertainty; give flight numbers, such as --disc 11/5/-1/3, or a '
            'file with the section uncertainty'
        )
        raise ConfigError('--scatter', 'disc', allowed)
    return uncertainty


@contextmanager
def _progress(chosen: argparse.Namespace) -> Iterator[ProgressBar]:
    """Show the progress of a sweep; where it ends early, report which flights are kept."""
    bar = ProgressBar(chosen.prog)

    def kept() -> str:
        if not bar.total:
            return ''
        return (
            f'; {bar.done} of {bar.total} flights are kept in {chosen.output}.parts; --resume '
            'with the same flags continues'
        )

    try:
        yield bar
    except ConfigError:
        raise
    except DiscSimError as error:
        raise DiscSimError(f'{error}{kept()}') from error
    except KeyboardInterrupt:
        bar.finish()
        output.note(chosen.prog, f'stopped{kept()}')
        raise
    finally:
        bar.finish()


if __name__ == '__main__':
    sys.exit(main())
