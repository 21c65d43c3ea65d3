"""`identify`: the coefficients of a disc, with standard errors, from measured throws."""

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
import itertools
import json
from pathlib import Path
import shlex
import sys
import time
from typing import TYPE_CHECKING

from disc_sim_ros import __version__, files
from disc_sim_ros.cli import flags, identify_input, identify_report, output
from disc_sim_ros.cli.arguments import Parser, add_components, add_quantity, path
from disc_sim_ros.cli.main import run_program
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics import disc_file, flight
from disc_sim_ros.physics.disc import AERODYNAMICS
from disc_sim_ros.quantities import COEFFICIENTS, IDENTIFICATION, LAUNCH, MEAN_WIND
from disc_sim_ros.units import SYSTEMS

if TYPE_CHECKING:
    from disc_sim_ros.estimation.identification.crossvalidation import LeftOut
    from disc_sim_ros.estimation.identification.identify import Identification

_EVERY = 2.0  # s between two lines of progress


def parser(prog: str = 'identify') -> Parser:
    """Return the command line of `identify`."""
    from disc_sim_ros.estimation.throw_csv import GROUPS  # noqa: PLC0415 - numpy is slow

    p = Parser(
        prog=prog,
        description='Find the coefficients of a disc from measured throws: bags with Odometry or '
        'PoseStamped (and Imu), or CSV files with the columns t_s; x_m, y_m, z_m; qx, qy, qz, qw; '
        'p_rad_s, q_rad_s, r_rad_s; fx_m_s2, fy_m_s2, fz_m_s2; throw. All throws are of one disc '
        'in one wind. Coefficients that the throws do not determine keep the value of --disc.',
        epilog='Exit code 0; 1: a bag cannot be read, or a file not be written; 2: bad input; '
        '130: Ctrl-C, after the best result so far.',
    )
    p.set_defaults(prog=prog, outputs={'out': _check_disc_file, 'report': _check_report})
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    p.add_argument(
        'throws',
        nargs='+',
        type=path,
        metavar='THROWS',
        help='bags (folders, .mcap) or .csv files',
    )
    what = p.add_argument_group('disc')
    what.add_argument(
        '--disc',
        type=path,
        action=flags.OneDisc,
        default=disc_file.DEFAULT_DISC,
        metavar='NAME|FILE.yaml|NUMBERS',
        help='disc to start from: its mass, size, I_z and the shape of its curves are kept',
    )
    what.add_argument(
        '--aero',
        choices=AERODYNAMICS,
        default=argparse.SUPPRESS,
        help="steady coefficients to start from (default: the disc's own)",
    )
    what.add_argument(
        '--model', choices=tuple(flight.MODELS), default=flight.Setup.model, help='rigid body'
    )
    what.add_argument(
        '--free',
        default=argparse.SUPPRESS,
        metavar='NAME,...',
        help=f'coefficients to fit, of {", ".join(COEFFICIENTS)} (default: all that the throws '
        'determine)',
    )
    what.add_argument(
        '--anyway',
        action='store_true',
        help='also fit coefficients that the throws do not determine: what is believed of discs '
        'beforehand then decides',
    )
    made = p.add_argument_group('measurements')
    made.add_argument(
        '--use',
        default=argparse.SUPPRESS,
        metavar='NAME,...',
        help=f'instruments to use, of {", ".join(GROUPS)} '
        f'(default: {", ".join(identify_input.USED)})',
    )
    add_quantity(
        made,
        '--spin',
        LAUNCH['spin'],
        default=argparse.SUPPRESS,
        text='spin rate at the releases where no gyro measures it, clockwise from above positive; '
        'taken as known to 5 %',
    )
    for name in ('camera_height', 'accelerometer_range'):
        add_quantity(
            made, f'--{name.replace("_", "-")}', IDENTIFICATION[name], default=argparse.SUPPRESS
        )
    add_components(
        made,
        '--camera-at',
        [IDENTIFICATION['camera_x'], IDENTIFICATION['camera_y']],
        ('X', 'Y'),
        'point on the ground under the camera, in map',
    )
    add_quantity(made, '--camera-error', IDENTIFICATION['camera_error'])
    made.add_argument(
        '--noise',
        default=argparse.SUPPRESS,
        metavar='NAME=NUMBER,...',
        help='standard errors of instruments, such as camera=1: also for what the model cannot '
        'follow (default: estimated from the residuals)',
    )
    made.add_argument(
        '--techdisc',
        type=path,
        default=argparse.SUPPRESS,
        metavar='FILE.csv',
        help='measured releases, a row for each throw in their order; columns as for fly',
    )
    for field in ('speed', 'angle', 'hyzer', 'spin'):
        name = f'release_{field}_error'
        text = f'standard error of the {field} in --techdisc'
        add_quantity(made, f'--{name.replace("_", "-")}', IDENTIFICATION[name], text=text)
    text = 'expected velocity of the air in map axes'
    add_components(made, '--wind', list(MEAN_WIND.values())[:2], ('X', 'Y'), text)
    add_quantity(made, '--wind-error', IDENTIFICATION['wind_error'])
    flags.add_density(made)
    search = p.add_argument_group('search and output')
    add_quantity(search, '--starts', IDENTIFICATION['starts'])
    add_quantity(search, '--seed', IDENTIFICATION['start_seed'], dest='seed')
    search.add_argument(
        '--out',
        type=path,
        default=argparse.SUPPRESS,
        metavar='FILE.yaml',
        help='disc file to write',
    )
    search.add_argument(
        '--report',
        type=path,
        default=argparse.SUPPRESS,
        metavar='DIR',
        help='new folder for report.html with plots, throws.html with the fitted flights in 3D '
        '(needs trimesh), and the numbers as report.json',
    )
    search.add_argument(
        '--json', action='store_true', help='print one JSON document instead of the summary'
    )
    output.add_units(search)
    return p


def main(arguments: Sequence[str] | None = None, prog: str = 'identify') -> int:
    """Run `identify` and return its exit code."""
    words = sys.argv[1:] if arguments is None else arguments
    return run_program(parser(prog), partial(_run, words=words), words, in_flags=flags.in_flags)


def _run(chosen: argparse.Namespace, words: Sequence[str]) -> int:
    setup = flight.Setup(
        disc=disc_file.load_disc(chosen.disc),
        model=chosen.model,
        aero=getattr(chosen, 'aero', None),
        air=flags.air_of(chosen),
    )
    noise, free = identify_input.noise(chosen), identify_input.free(chosen)
    throws = identify_input.throws(chosen, setup)
    identify_input.refuse_unused(chosen, noise, throws)
    # Imported once the input is known to be right: they take a second.
    from disc_sim_ros.estimation.identification import (  # noqa: PLC0415
        crossvalidation,
        identify,
        report,
    )
    from disc_sim_ros.physics import sampled  # noqa: PLC0415

    if note := sampled.first_call_note():
        output.note(chosen.prog, note)
    n = len(throws)
    stages = identify.stages(throws, chosen.starts) | crossvalidation.stages(n)
    progress = _Progress(chosen.prog, stages)
    result = identify.identify(
        throws,
        setup,
        free=free,
        prior=identify_input.prior(chosen),
        noise=noise,
        anyway=chosen.anyway,
        starts=chosen.starts,
        seed=chosen.seed,
        progress=progress,
    )
    misses: list[LeftOut] = []
    if not result.interrupted:
        misses = crossvalidation.left_out_misses(result, progress)
    if chosen.json:
        output.show(json.dumps(report.document(result, misses), allow_nan=False))
    else:
        output.show(report.text(result, misses, SYSTEMS[chosen.units]))
    _write_outputs(chosen, result, misses, identify_report.provenance(chosen, words))
    return 130 if result.interrupted else 0


def _check_disc_file(name: str) -> None:
    if not disc_file.is_file(name):
        raise ConfigError('--out', name, 'give a name that ends in .yaml')
    output.check_writable('--out', name)


def _check_report(name: str) -> None:
    files.check_new_folder('--report', Path(name))


def _write_outputs(
    chosen: argparse.Namespace,
    result: 'Identification',
    misses: 'Sequence[LeftOut]',
    provenance: Sequence[str],
) -> None:
    """Write the report and the disc file that were asked for, and name them."""
    from disc_sim_ros.estimation.identification import report  # noqa: PLC0415

    written = []
    if hasattr(chosen, 'report'):
        system = SYSTEMS[chosen.units]
        identify_report.write(Path(chosen.report), result, misses, provenance, system)
        written.append(f'wrote {Path(chosen.report) / "report.html"}')
    if hasattr(chosen, 'out') and result.problem.free:
        text = report.disc_file(result, Path(chosen.out).stem, provenance)
        output.write_whole('--out', chosen.out, text.encode())
        written.append(f'wrote {chosen.out}: fly --disc {shlex.quote(chosen.out)}')
    for line in written:
        if chosen.json:
            output.note(chosen.prog, line)
        else:
            output.show(line)
    if hasattr(chosen, 'out') and not result.problem.free:
        why = 'not written, because these throws determine no coefficient'
        raise DiscSimError(f'{chosen.out}: {why}')


class _Progress:
    """Shows stage, cost and a guess of the time left on stderr, at most every two seconds."""

    def __init__(self, prog: str, stages: Mapping[str, float]) -> None:
        self._prog, self._last, self._stages = prog, time.monotonic(), stages
        self._started = self._last

    def __call__(self, stage: str, count: int, cost: float) -> None:
        """Show a step of a stage."""
        now = time.monotonic()
        if now - self._last >= _EVERY:
            self._last = now
            tail = f', half squares {cost:.1f}' if cost == cost else ''  # noqa: PLR0124 - not nan
            spent = now - self._started
            before = itertools.takewhile(lambda name: name != stage, self._stages)
            done = sum(self._stages[name] for name in before)
            left = sum(self._stages.values()) - done
            if done > 0.0 and stage in self._stages:  # as if each takes its usual share
                tail += f'; about {spent / done * left:.0f} s left'
            output.note(self._prog, f'{spent:.0f} s: {stage}, step {count}{tail}')


if __name__ == '__main__':
    sys.exit(main())
