"""`optimise`: the launch that reaches furthest, flies longest or hits best, without ROS."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
import json
import math
from pathlib import Path
import signal
import sys
from typing import TYPE_CHECKING

from disc_sim_ros import __version__
from disc_sim_ros.cli import flags as throw_flags
from disc_sim_ros.cli import output, study_flags
from disc_sim_ros.cli.arguments import Parser, number
from disc_sim_ros.cli.study_flags import listed
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics import frames

if TYPE_CHECKING:
    from disc_sim_ros.studies.optimise import Problem

PLOTS = ('png', 'svg', 'pdf')
DEFAULT_COUNT = 256  # throws of each launch under scatter
_FLAG_OF = {
    'goal': '--for',
    'target': '--target',
    'limits': '--limit',
    'limit': '--limit',
    'percentile': '--percentile',
    'count': '--count',
    'duration': '--duration',
    'scatter': '--scatter',
}


def parser() -> Parser:
    """Return the command line of `optimise`."""
    p = Parser(
        prog='optimise',
        conflict_handler='resolve',  # --seed and --step mean more here than in `fly`
        description='Search the launch with the greatest range or time of flight, or the least '
        'distance from a target, within human limits, in wind, and under human scatter if asked. '
        'A flag of `fly` that is given holds; the others of the limits are free. Angles have the '
        f'signs of {throw_flags.PAPER}; positions and wind are in map axes: x forward, y left, z '
        'up.',
        epilog=f'{_defaults_text()} {study_flags.names_text()} Exit code 0; 1: a failed '
        'search; 2: bad input.',
    )
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    study_flags.add_throw(p, ground=False)
    what = p.add_argument_group('what is best')
    what.add_argument(
        '--for', choices=('range', 'time', 'accuracy'), default='range', dest='goal', help='goal'
    )
    what.add_argument(
        '--target',
        nargs=2,
        type=number(-10000.0, 10000.0, 'm'),
        default=argparse.SUPPRESS,
        metavar=('X', 'Y'),
        help='for accuracy: where to land; from -10000 to 10000 m each',
    )
    text = 'free quantity and its range'
    study_flags.add_list(what, '--limit', 'NAME=LOW:HIGH', text)
    text = 'normal scatter of the throws around each launch'
    study_flags.add_list(what, '--scatter', 'NAME=SD', text)
    what.add_argument(
        '--percentile',
        type=number(1.0, 99.0, '%'),
        default=argparse.SUPPRESS,
        metavar='P',
        help='best for this percentile of the throws instead of their mean; from 1 to 99 %%',
    )
    what.add_argument(
        '--count',
        type=study_flags.whole(2, 100_000),
        default=DEFAULT_COUNT,
        metavar='N',
        help='throws of each launch under scatter or in gusts',
    )
    study_flags.add_seed(what, 'of the search, the scatter and the gusts')
    what.add_argument('--json', action='store_true', help='print one JSON document instead')
    what.add_argument(
        '--plot',
        default=argparse.SUPPRESS,
        metavar='FILE.png',
        help='write a plot too; the name ends in .png, .svg or .pdf',
    )
    return p


def main(arguments: list[str] | None = None) -> int:
    """Run `optimise`; return its exit code."""
    output.mend_streams()
    p = parser()
    words = sys.argv[1:] if arguments is None else arguments
    chosen = p.parse_args(words)
    try:
        _run(chosen, words)
    except ConfigError as error:
        first, _, rest = error.thing.partition(' ')
        thing = throw_flags.flag_of(error, chosen)
        thing = _FLAG_OF.get(thing, f'{_FLAG_OF[first]} {rest}' if first in _FLAG_OF else thing)
        p.error(str(ConfigError(thing, error.value, error.allowed)))
    except DiscSimError as error:
        sys.stderr.write(f'optimise: error: {error}\n')
        return 1
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    return 0


def problem(chosen: argparse.Namespace, words: Sequence[str]) -> 'Problem':
    """Return the problem that the flags pose.

    Raises:
        ConfigError: They contradict each other, or are out of range.
    """
    from disc_sim_ros.studies import optimise  # noqa: PLC0415 - scipy
    from disc_sim_ros.studies.flying import good_step  # noqa: PLC0415
    from disc_sim_ros.studies.study import Study  # noqa: PLC0415

    flags = {word.partition('=')[0] for word in words}
    given = {name for name, flag in throw_flags.FLAG_OF.items() if flag in flags}
    if '--advance-ratio' in flags:
        given.add('spin')
    limits = {n: span for n, span in optimise.HUMAN_LIMITS.items() if n not in given}
    target = None
    if hasattr(chosen, 'target'):
        target = (chosen.target[0], chosen.target[1])
        if 'yaw' not in given:
            bearing = frames.flip(math.degrees(math.atan2(target[1], target[0])))
            limits['yaw'] = (bearing - 45.0, bearing + 45.0)
    for name, span in study_flags.ranges('--limit', listed(chosen, 'limit')).items():
        if name in given:
            flag = throw_flags.FLAG_OF[name]
            raise ConfigError('--limit', name, f'{flag} fixes it; give one of the two')
        limits[name] = span
    if 'advance_ratio' in limits:
        limits.pop('spin', None)
    scatter = study_flags.laws([], [], listed(chosen, 'scatter'))
    if chosen.goal == optimise.ACCURACY and not scatter:
        scatter = study_flags.laws(
            [], [], [f'{name}={sd}' for name, sd in optimise.HUMAN_SCATTER.items()]
        )
    if hasattr(chosen, 'advance_ratio') or 'advance_ratio' in limits:
        scatter.pop('spin', None)
    release, setup, ratio = study_flags.thrown(chosen)
    gusts = setup.wind.turbulence > 0.0
    question = Study(
        setup=setup,
        launch=release,
        control=throw_flags.control_of(chosen),
        advance_ratio=ratio,
        scatter=scatter,
        count=chosen.count if scatter or gusts else 1,
        seed=chosen.seed,
        sampling='sobol' if scatter else 'random',
        duration=chosen.duration,
    )
    posed = optimise.Problem(
        question=question,
        limits=limits,
        goal=chosen.goal,
        target=target,
        percentile=getattr(chosen, 'percentile', None),
    )
    if hasattr(chosen, 'step'):
        return posed
    step = good_step(setup, posed.fastest_spin)
    return replace(posed, question=replace(question, setup=replace(setup, step=step)))


def _run(chosen: argparse.Namespace, words: Sequence[str]) -> None:
    plot = getattr(chosen, 'plot', None)
    ending = '' if plot is None else Path(plot).suffix.removeprefix('.').lower()
    if plot is not None:
        if ending not in PLOTS:
            raise ConfigError('--plot', plot, 'the name must end in .png, .svg or .pdf')
        output.check_writable('--plot', plot)
    posed = problem(chosen, words)
    from disc_sim_ros.studies import optimise, optimise_report  # noqa: PLC0415

    study_flags.note_compilation('optimise', posed.question.setup)
    found = optimise.optimise(posed, seed=chosen.seed)
    again = optimise_report.command(found, chosen.disc)
    if plot is not None:
        from disc_sim_ros.analysis import plots  # noqa: PLC0415
        from disc_sim_ros.studies.optimise_plots import figure  # noqa: PLC0415

        picture = plots.image(figure(found), ending)
        output.write_whole('--plot', plot, picture)
    if chosen.json:
        output.show(json.dumps(optimise_report.optimum_document(found, again), allow_nan=False))
        return
    lines = [optimise_report.text(found, again)]
    if plot is not None:
        lines.append(f'  wrote    {plot}')
    output.show('\n'.join(lines))


def _defaults_text() -> str:
    from disc_sim_ros.studies import optimise  # noqa: PLC0415

    free = ', '.join(
        f'{n} {low:g} to {high:g}' for n, (low, high) in optimise.HUMAN_LIMITS.items()
    )
    spread = ', '.join(f'{name} {sd:g}' for name, sd in optimise.HUMAN_SCATTER.items())
    return (
        f'Without --limit these are free: {free}, and for accuracy the yaw within 45 degrees of '
        f'the target. Accuracy without --scatter takes the sd {spread}. Both are choices for a '
        'practised right-handed thrower, in m/s, degrees and rad/s.'
    )


if __name__ == '__main__':
    sys.exit(main())
