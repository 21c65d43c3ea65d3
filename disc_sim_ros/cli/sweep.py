"""`sweep`: grids and Monte Carlo ensembles of flights, without ROS."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
import json
from pathlib import Path
import signal
import sys
import time
from typing import TYPE_CHECKING

from disc_sim_ros import __version__
from disc_sim_ros.cli import flags, output, study_flags
from disc_sim_ros.cli.arguments import Parser
from disc_sim_ros.cli.progress import ProgressBar, duration
from disc_sim_ros.cli.study_flags import listed
from disc_sim_ros.errors import ConfigError, DiscSimError

if TYPE_CHECKING:
    from disc_sim_ros.studies.study import Study

PLOTS = ('png', 'svg', 'pdf')
DEFAULT_COUNT = 1000  # samples, where something scatters
DEFAULT_OUTPUT = 'sweep.parquet'
_FLAG_OF = {
    'vary': '--vary',
    'count': '--count',
    'seed': '--seed',
    'correlation': '--correlation',
    'sampling': '--sobol',
    'duration': '--duration',
    'output': '--output',
    'resume': '--resume',
    'executor': '--executor',
    'workers': '--workers',
    'scatter': '--scatter',
}


def parser() -> Parser:
    """Return the command line of `sweep`."""
    p = Parser(
        prog='sweep',
        conflict_handler='resolve',  # --seed and --step mean more here than in `fly`
        description='Fly grids and random ensembles into one Parquet or CSV file, with a summary. '
        'The flags of `fly` hold for every flight; --vary, --normal, --uniform and --scatter '
        'change some of them from flight to flight. Angles and control inputs have the signs of '
        f'{flags.PAPER}; positions and wind are in map axes: x forward, y left, z up.',
        epilog=f'{study_flags.names_text()} Exit code 0; 1: a failed run; 2: bad input; 130: '
        'Ctrl-C. Finished flights are kept in FILE.parts, and --resume goes on.',
    )
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    study_flags.add_throw(p)
    what = p.add_argument_group('what differs from flight to flight')
    text = 'values of a grid; several span it'
    study_flags.add_list(what, '--vary', 'NAME=START:STOP:STEP|START:STOP/N|A,B,C', text)
    study_flags.add_list(what, '--normal', 'NAME=MEAN,SD', 'normal scatter')
    study_flags.add_list(what, '--uniform', 'NAME=LOW,HIGH', 'uniform scatter')
    text = 'normal scatter around the value of the grid or of the flag'
    study_flags.add_list(what, '--scatter', 'NAME=SD', text)
    text = 'correlation of two that scatter, from -1 to 1'
    study_flags.add_list(what, '--correlation', 'A,B=R', text)
    what.add_argument(
        '--count',
        type=study_flags.whole(1, 2**30),
        default=argparse.SUPPRESS,
        metavar='N',
        help=f'samples of the scatter, at each point of a grid (default: {DEFAULT_COUNT}, without '
        'scatter 1)',
    )
    what.add_argument(
        '--sobol',
        action='store_true',
        help='draw quasi-random samples, which fill the space evenly; best with a --count of 2^k',
    )
    study_flags.add_seed(what, 'of the scatter and of the gusts')
    what.add_argument(
        '--gust-seeds',
        choices=('each', 'same'),
        default='each',
        help='gusts of sample k from seed N + k, or of all flights from seed N',
    )
    made = p.add_argument_group('how it is flown, and what comes out')
    study_flags.add_workers(made)
    made.add_argument(
        '--batch',
        type=study_flags.whole(1, 10**6),
        default=argparse.SUPPRESS,
        metavar='N',
        help='flights that are handed out and kept at a time (default: 8192)',
    )
    made.add_argument(
        '--output', default=DEFAULT_OUTPUT, metavar='FILE', help='ends in .parquet or .csv'
    )
    made.add_argument('--force', action='store_true', help='overwrite FILE; begin anew')
    made.add_argument('--resume', action='store_true', help='go on with an interrupted sweep')
    made.add_argument(
        '--plot',
        default=argparse.SUPPRESS,
        metavar='FILE.png',
        help='write a plot too; the name ends in .png, .svg or .pdf',
    )
    made.add_argument('--json', action='store_true', help='print the summary as one JSON document')
    return p


def main(arguments: list[str] | None = None) -> int:
    """Run `sweep`; return its exit code."""
    output.mend_streams()
    p = parser()
    words = sys.argv[1:] if arguments is None else arguments
    chosen = p.parse_args(words)
    bar = ProgressBar('sweep')
    try:
        _run(chosen, words, bar)
    except ConfigError as error:
        thing = flags.flag_of(error, chosen)
        thing = _FLAG_OF.get(thing, thing)
        p.error(str(ConfigError(thing, error.value, error.allowed)))
    except DiscSimError as error:
        bar.finish()
        sys.stderr.write(f'sweep: error: {error}{_kept(chosen, bar)}\n')
        return 1
    except KeyboardInterrupt:
        bar.finish()
        sys.stderr.write(f'sweep: stopped{_kept(chosen, bar)}\n')
        return 128 + signal.SIGINT
    return 0


def _run(chosen: argparse.Namespace, words: Sequence[str], bar: ProgressBar) -> None:
    plot = getattr(chosen, 'plot', None)
    if plot is not None:
        if _ending(plot) not in PLOTS:
            raise ConfigError('--plot', plot, 'the name must end in .png, .svg or .pdf')
        output.check_writable('--plot', plot)
    output.check_writable('--output', chosen.output)
    asked = question(chosen, words)
    # pyarrow takes a quarter of a second, and reads nothing that the flags do not allow.
    from disc_sim_ros.studies import report, runner, summary  # noqa: PLC0415
    from disc_sim_ros.studies.executors import opened  # noqa: PLC0415

    study_flags.note_compilation('sweep', asked.setup)
    started = time.monotonic()
    with opened(chosen.executor, getattr(chosen, 'workers', None)) as (executor, workers):
        path = runner.sweep(
            asked,
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
    bar.finish()
    found = summary.summarise(path, asked)
    if plot is not None:
        from disc_sim_ros.analysis import plots  # noqa: PLC0415
        from disc_sim_ros.studies.plots import figure  # noqa: PLC0415

        output.write_whole('--plot', plot, plots.image(figure(path, found), _ending(plot)))
    if chosen.json:
        output.show(json.dumps(report.summary_document(found), allow_nan=False))
        return
    lines = [report.summary_text(found)]
    size = path.stat().st_size
    new = bar.new
    rate = f' in {duration(seconds)}, {new / seconds:.0f} flights/s' if new else ''
    lines.append(f'  wrote    {path}, {asked.size} rows, {size / 1e6:.1f} MB{rate}')
    if plot is not None:
        lines.append(f'  wrote    {plot}')
    output.show('\n'.join(lines))


def question(chosen: argparse.Namespace, words: Sequence[str]) -> 'Study':
    """Return the question that the flags ask.

    Raises:
        ConfigError: They contradict each other, or are out of range.
    """
    from disc_sim_ros.studies.flying import good_step  # noqa: PLC0415
    from disc_sim_ros.studies.study import Study  # noqa: PLC0415

    vary = study_flags.grids(listed(chosen, 'vary'))
    scatter = study_flags.laws(
        *(listed(chosen, name) for name in ('normal', 'uniform', 'scatter'))
    )
    if not vary and not scatter and not (hasattr(chosen, 'count') and chosen.turbulence):
        allowed = 'nothing differs; give --vary, --normal, --uniform or --scatter, or use fly'
        raise ConfigError('--vary', 'nothing', allowed)
    study_flags.check_given(words, vary, scatter)
    release, setup, ratio = study_flags.thrown(chosen)
    asked = Study(
        setup=setup,
        launch=release,
        control=flags.control_of(chosen),
        advance_ratio=ratio,
        vary=vary,
        scatter=scatter,
        correlations=study_flags.pairs(listed(chosen, 'correlation')),
        count=getattr(chosen, 'count', DEFAULT_COUNT if scatter else 1),
        seed=chosen.seed,
        sampling='sobol' if chosen.sobol else 'random',
        gusts=chosen.gust_seeds,
        duration=chosen.duration,
        ground=not chosen.no_ground,
    )
    if hasattr(chosen, 'step'):
        return asked
    step = good_step(setup, asked.fastest_spin)
    return replace(asked, setup=replace(setup, step=step))


def _kept(chosen: argparse.Namespace, bar: ProgressBar) -> str:
    if not bar.total:
        return ''
    return (
        f'; {bar.done} of {bar.total} flights are kept in {chosen.output}.parts, '
        '--resume goes on with the same flags'
    )


def _ending(name: str) -> str:
    return Path(name).suffix.removeprefix('.').lower()


if __name__ == '__main__':
    sys.exit(main())
