"""`identify`: the coefficients of a disc, with standard errors, from measured throws."""

import argparse
import base64
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import partial
import html
import io
import json
from pathlib import Path
import shlex
import sys
import time
from typing import TYPE_CHECKING

from disc_sim_ros import __version__, files, validation
from disc_sim_ros.cli import flags, output, pages
from disc_sim_ros.cli.arguments import Parser, add_components, add_quantity, path
from disc_sim_ros.cli.main import run_program
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics import disc_file, flight
from disc_sim_ros.physics.disc import AERODYNAMICS
from disc_sim_ros.quantities import COEFFICIENTS, IDENTIFICATION, LAUNCH, MEAN_WIND
from disc_sim_ros.units import METRIC

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from disc_sim_ros.estimation.crossvalidation import LeftOut
    from disc_sim_ros.estimation.identification import Identification
    from disc_sim_ros.estimation.problem import Prior
    from disc_sim_ros.estimation.releases import ReleaseErrors
    from disc_sim_ros.estimation.throws import Throw
    from disc_sim_ros.physics.thrower import Release

_USED = ('position', 'attitude', 'gyro')  # unless --use says otherwise
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
        help=f'instruments to use, of {", ".join(GROUPS)} (default: {", ".join(_USED)})',
    )
    add_quantity(made, '--spin', LAUNCH['spin'], default=argparse.SUPPRESS)
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
        add_quantity(made, f'--{name.replace("_", "-")}', IDENTIFICATION[name])
    text = 'mean wind beforehand, in map axes'
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
    search.add_argument('--json', action='store_true', help='print one JSON document')
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
    noise, free = _noise(chosen), _free(chosen)
    throws = _throws(chosen, setup)
    # Imported once the input is known to be right: they take a second.
    from disc_sim_ros.estimation import crossvalidation, identification, report  # noqa: PLC0415
    from disc_sim_ros.physics import sampled  # noqa: PLC0415

    if note := sampled.first_call_note():
        output.note(chosen.prog, note)
    n = len(throws)
    stages = (*identification.stages(n, chosen.starts), *crossvalidation.stages(n))
    progress = _Progress(chosen.prog, stages)
    result = identification.identify(
        throws,
        setup,
        free=free,
        prior=_prior(chosen),
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
        output.show(report.text(result, misses))
    _write_outputs(chosen, result, misses, _provenance(chosen, words))
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
    from disc_sim_ros.estimation import report  # noqa: PLC0415

    written = []
    if hasattr(chosen, 'report'):
        _write_report(Path(chosen.report), result, misses, provenance)
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

    def __init__(self, prog: str, stages: Sequence[str]) -> None:
        self._prog, self._last, self._stages = prog, time.monotonic(), stages
        self._started = self._last

    def __call__(self, stage: str, count: int, cost: float) -> None:
        """Show a step of a stage."""
        now = time.monotonic()
        if now - self._last >= _EVERY:
            self._last = now
            tail = f', half squares {cost:.1f}' if cost == cost else ''  # noqa: PLR0124 - not nan
            spent = now - self._started
            done = self._stages.index(stage) if stage in self._stages else 0
            if done:  # as if every stage took as long
                tail += f'; about {spent / done * (len(self._stages) - done):.0f} s left'
            output.note(self._prog, f'{spent:.0f} s: {stage}, step {count}{tail}')


def _prior(chosen: argparse.Namespace) -> 'Prior':
    import numpy as np  # noqa: PLC0415

    from disc_sim_ros.estimation.coefficients import NAMES  # noqa: PLC0415
    from disc_sim_ros.estimation.problem import Prior  # noqa: PLC0415
    from disc_sim_ros.quantities import COEFFICIENT_SPREAD  # noqa: PLC0415

    return Prior(
        np.array([COEFFICIENT_SPREAD[name] for name in NAMES]),
        wind=tuple(chosen.wind),
        wind_deviation=chosen.wind_error,
        foot=tuple(chosen.camera_at),
        foot_deviation=chosen.camera_error,
    )


def _throws(chosen: argparse.Namespace, setup: flight.Setup) -> 'list[Throw]':
    from disc_sim_ros.estimation.measured import (  # noqa: PLC0415
        Instruments,
        check_different,
        throw_from,
    )
    from disc_sim_ros.estimation.throw_csv import GROUPS  # noqa: PLC0415

    instruments = Instruments(
        gravity=setup.air.gravity,
        camera_height=getattr(chosen, 'camera_height', None),
        largest_acceleration=getattr(chosen, 'accelerometer_range', float('inf')),
        spin=getattr(chosen, 'spin', None),
    )
    used = _listed(chosen, 'use') or list(_USED)
    for name in used:
        validation.choice('--use', name, GROUPS)
    measured: dict[str, dict] = {}  # type: ignore[type-arg]
    names = [Path(source).name for source in chosen.throws]
    for source, short in zip(chosen.throws, names, strict=True):
        of = short if names.count(short) == 1 else source  # files of two folders
        for number, columns in _read(source).items():
            name = f'throw {number}' if number.isdigit() else number
            full = name if len(chosen.throws) == 1 else f'{of} {name}'
            if full in measured:
                raise ConfigError('throws', source, 'it is given twice')
            measured[full] = {k: v for k, v in columns.items() if k in {*used, 'camera'}}
            if not measured[full]:
                allowed = f'it has {", ".join(columns) or "nothing"}, --use {",".join(used)}'
                raise ConfigError('throws', full, allowed)
    check_different(measured)
    releases = _releases(chosen, len(measured))
    return [
        throw_from(name, columns, setup.disc, instruments, release)
        for (name, columns), release in zip(measured.items(), releases, strict=True)
    ]


def _releases(
    chosen: argparse.Namespace, count: int
) -> 'Sequence[tuple[Release, ReleaseErrors] | None]':
    """Return the measured release of each throw with its errors, None without."""
    if not hasattr(chosen, 'techdisc'):
        return [None] * count
    from disc_sim_ros.analysis import techdisc  # noqa: PLC0415
    from disc_sim_ros.estimation.releases import ReleaseErrors  # noqa: PLC0415

    rows = techdisc.throws(chosen.techdisc)
    if len(rows) != count:
        allowed = f'it has {len(rows)} releases, THROWS have {count} throws: give a row for each'
        raise ConfigError('--techdisc', chosen.techdisc, allowed)
    errors = ReleaseErrors(
        speed=chosen.release_speed_error,
        launch_angle=chosen.release_angle_error,
        nose=chosen.release_angle_error,
        hyzer=chosen.release_hyzer_error,
        spin=chosen.release_spin_error,
    )
    return [(row.release, errors) for row in rows]


def _free(chosen: argparse.Namespace) -> list[str] | None:
    """Return the coefficients of `--free`, checked before anything is compiled."""
    from disc_sim_ros.estimation import coefficients  # noqa: PLC0415

    names = _listed(chosen, 'free')
    if names is not None:
        coefficients.chosen(names)
    return names


def _noise(chosen: argparse.Namespace) -> dict[str, float]:
    """Return the standard errors of `--noise` by instrument."""
    from disc_sim_ros.estimation.observations import NOISE  # noqa: PLC0415

    noise = {}
    for word in _listed(chosen, 'noise') or []:
        name, _, number = word.partition('=')
        validation.choice('--noise', name, NOISE)
        try:
            value: float | str = float(number)
        except ValueError:
            value = number
        try:
            noise[name] = IDENTIFICATION['noise'].check(value)
        except ConfigError as error:
            raise ConfigError(f'--noise {name}', value, error.allowed) from None
    return noise


def _read(source: str) -> 'dict[str, dict]':  # type: ignore[type-arg]
    """Return the measurements of a file or a bag."""
    if Path(source).suffix.lower() == '.csv':
        from disc_sim_ros.estimation import throw_csv  # noqa: PLC0415

        return throw_csv.read(source)  # type: ignore[return-value]
    from disc_sim_ros.analysis import measured_flights  # noqa: PLC0415
    from disc_sim_ros.bags.reader import open_bag  # noqa: PLC0415

    return measured_flights.measured(open_bag(source))


def _listed(chosen: argparse.Namespace, name: str) -> list[str] | None:
    """Return the words of a flag that takes several, or None."""
    text = getattr(chosen, name, None)
    return None if text is None else [word.strip() for word in text.split(',') if word.strip()]


def _provenance(chosen: argparse.Namespace, words: Sequence[str]) -> list[str]:
    """Return what made a result: version, date, command."""
    day = datetime.now(UTC).strftime('%Y-%m-%d')
    return [
        f'Identified by disc_sim_ros {__version__} on {day} from:',
        *(f'  {source}' for source in chosen.throws),
        f'Command: {chosen.prog} {shlex.join(words)}',
    ]


def _write_report(
    folder: Path, result: 'Identification', misses: 'Sequence[LeftOut]', lines: Sequence[str]
) -> None:
    from disc_sim_ros.estimation import plots, report  # noqa: PLC0415

    figures = [plots.paths(result), plots.residuals(result), plots.correlations(result)]
    text = report.text(result, misses)
    document = json.dumps(report.document(result, misses), allow_nan=False, indent=1)
    pictures = '\n'.join(_picture(figure) for figure in figures if figure is not None)
    throws = _page_of_throws(result)
    link = '<p><a href="throws.html">The fitted flights in 3D</a></p>' if throws else ''
    escaped = html.escape('\n'.join([*lines, '', text]))
    page = (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        '<title>Identification of a disc</title>'
        '<style>body{font:16px sans-serif;max-width:60em;margin:1em auto;padding:0 1em}'
        'img{max-width:100%;background:#fff}pre{white-space:pre-wrap}'
        ':root{color-scheme:light dark}</style>'
        f'<h1>Identification of a disc</h1><pre>{escaped}</pre>{link}{pictures}</html>'
    )
    with files.whole_folder('--report', folder) as made:
        made.mkdir()
        (made / 'report.html').write_text(page, encoding='utf-8')
        (made / 'report.json').write_text(document, encoding='utf-8')
        if throws:
            (made / 'throws.html').write_bytes(throws)


def _page_of_throws(result: 'Identification') -> bytes:
    """Return a page of the fitted flights; empty without the package for pages."""
    from disc_sim_ros.view.page import ViewerMissingError, page  # noqa: PLC0415
    from disc_sim_ros.view.shown import ShownFlight  # noqa: PLC0415

    flights = [
        ShownFlight(
            throw.name,
            f'fitted to {throw.times[-1]:.2f} s of measurements',
            result.flight(k, pages.RATE),
            landed=False,
        )
        for k, throw in enumerate(result.problem.throws)
    ]
    try:
        return page(flights, 'Throws fitted by identify', METRIC)
    except ViewerMissingError:
        return b''


def _picture(figure: 'Figure') -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format='png', dpi=110)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<p><img alt="plot" src="data:image/png;base64,{data}"></p>'


if __name__ == '__main__':
    sys.exit(main())
