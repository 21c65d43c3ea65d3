"""`optimise`: searches the launch with the best range, time of flight or accuracy, without ROS."""

import argparse
from collections.abc import Sequence
from functools import partial
import json
import math
import sys
from typing import TYPE_CHECKING

from disc_sim_ros import __version__
from disc_sim_ros.cli import flags as throw_flags
from disc_sim_ros.cli import output, study_flags
from disc_sim_ros.cli.arguments import Parser, add_components, add_quantity
from disc_sim_ros.cli.main import UsageError, run_program
from disc_sim_ros.cli.study_flags import listed
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import frames
from disc_sim_ros.quantities import POSITION, STUDY
from disc_sim_ros.units import SYSTEMS

if TYPE_CHECKING:
    from disc_sim_ros.studies.optimise import Problem

DEFAULT_COUNT = 256  # throws of each launch under scatter


def parser(prog: str = 'optimise') -> Parser:
    """Return the command line of `optimise`."""
    p = Parser(
        prog=prog,
        conflict_handler='resolve',  # --seed and --step mean more here than in `fly`
        description='Search the launch with the greatest range or time of flight, or the least '
        "distance from a target, within a thrower's limits: in wind, and with the scatter of a "
        'thrower where --scatter is given. A quantity whose `fly` flag is given is fixed; the '
        'other limited quantities are free. Angles have the signs of '
        f'{throw_flags.PAPER}; positions and wind are in map axes: x forward, y left, z up.',
        epilog=f'{_defaults_text()} {study_flags.names_text()} Exit code 0; 1: the search '
        'failed; 2: bad input.',
    )
    p.set_defaults(prog=prog, outputs={'plot': output.check_plot})
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    study_flags.add_throw(p, ground=False)
    what = p.add_argument_group('goal and search')
    what.add_argument(
        '--for',
        choices=('range', 'time', 'accuracy'),
        default='range',
        dest='goal',
        help='the goal: greatest range, longest time of flight, least distance from --target',
    )
    text = 'where to land, for --for accuracy'
    place = (POSITION, POSITION)
    add_components(what, '--target', place, ('X', 'Y'), text, default=argparse.SUPPRESS)
    text = 'free quantity and its range'
    study_flags.add_list(what, '--limit', 'NAME=LOW:HIGH', text, dest='limits')
    text = 'normal scatter of the throws around each launch'
    study_flags.add_list(what, '--scatter', 'NAME=SD', text)
    text = 'optimise this percentile of the throws instead of their mean'
    options = {'metavar': 'P', 'text': text, 'default': argparse.SUPPRESS}
    add_quantity(what, '--percentile', STUDY['percentile'], **options)
    text = 'throws of each launch, with scatter or in gusts'
    counts = STUDY['count'].within(2, 100_000)
    add_quantity(what, '--count', counts, text=text, default=DEFAULT_COUNT)
    study_flags.add_seed(what, 'seed of the search, of the scatter and of the gusts')
    shown = p.add_argument_group('output (default: a summary to read)')
    output.add_units(shown)
    shown.add_argument(
        '--json', action='store_true', help='print one JSON document instead of the summary'
    )
    output.add_plot(shown)
    return p


def main(arguments: Sequence[str] | None = None, prog: str = 'optimise') -> int:
    """Run `optimise` and return its exit code: 0, 1 for a failed search, 2 for bad input."""
    words = sys.argv[1:] if arguments is None else arguments
    run = partial(_run, words=words)
    return run_program(parser(prog), run, words, in_flags=throw_flags.in_flags)


def problem(chosen: argparse.Namespace, words: Sequence[str]) -> 'Problem':
    """Return the problem that the flags describe.

    Raises:
        UsageError: Accuracy without a target.
        ConfigError: Flags contradict each other, or a value is out of range.
    """
    from disc_sim_ros.studies import optimise  # noqa: PLC0415
    from disc_sim_ros.studies.study import Study  # noqa: PLC0415

    flags = {word.partition('=')[0] for word in words}
    given = {name for name, flag in throw_flags.LAUNCH_FLAGS.items() if flag in flags}
    if '--advance-ratio' in flags:
        given.add('spin')
    limits = {n: span for n, span in optimise.HUMAN_LIMITS.items() if n not in given}
    target = None
    if hasattr(chosen, 'target'):
        target = (chosen.target[0], chosen.target[1])
        if 'yaw' not in given:
            bearing = frames.flip(math.degrees(math.atan2(target[1], target[0])))
            limits['yaw'] = (bearing - 45.0, bearing + 45.0)
    elif chosen.goal == optimise.ACCURACY:
        raise UsageError('--for accuracy needs a target; give --target X Y')
    for name, span in study_flags.ranges('--limit', listed(chosen, 'limits')).items():
        if name in given:
            flag = throw_flags.LAUNCH_FLAGS[name]
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
    study = Study(
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
    return optimise.Problem(
        study=study,
        limits=limits,
        goal=chosen.goal,
        target=target,
        percentile=getattr(chosen, 'percentile', None),
    )


def _run(chosen: argparse.Namespace, words: Sequence[str]) -> int:
    plot = getattr(chosen, 'plot', None)
    posed = problem(chosen, words)
    from disc_sim_ros.studies import optimise, optimise_report  # noqa: PLC0415

    study_flags.note_compilation(chosen.prog, posed.study.setup)
    optimum = optimise.optimise(posed, seed=chosen.seed)
    command = optimise_report.fly_command(optimum, chosen.disc)
    if plot is not None:
        from disc_sim_ros.studies.optimise_plots import figure  # noqa: PLC0415 - matplotlib

        output.write_plot(plot, figure(optimum, SYSTEMS[chosen.units]))
    if chosen.json:
        document = optimise_report.optimum_document(optimum, command)
        output.show(json.dumps(document, allow_nan=False))
        return 0
    lines = [optimise_report.optimum_text(optimum, command, SYSTEMS[chosen.units])]
    if plot is not None:
        lines.append(f'  wrote    {plot}')
    output.show('\n'.join(lines))
    return 0


def _defaults_text() -> str:
    """Return the default limits and scatter, for the end of the help text."""
    from disc_sim_ros.studies import optimise  # noqa: PLC0415

    free = ', '.join(
        f'{n} {low:g} to {high:g}' for n, (low, high) in optimise.HUMAN_LIMITS.items()
    )
    spread = ', '.join(f'{name} {sd:g}' for name, sd in optimise.HUMAN_SCATTER.items())
    return (
        f'Free without --limit: {free}, and for accuracy the yaw within 45 degrees of the '
        f'bearing of the target. Accuracy without --scatter uses standard deviations {spread}. '
        'Both were chosen for a practised right-handed thrower; units are m/s, degrees and rad/s.'
    )


if __name__ == '__main__':
    sys.exit(main())
