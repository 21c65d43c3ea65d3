"""`fly`: one flight of one disc, without ROS."""

import argparse
import json
from pathlib import Path
import signal
import sys

from disc_sim_ros import __version__
from disc_sim_ros.cli import output
from disc_sim_ros.cli.arguments import Parser, number
from disc_sim_ros.core import catalogue, derived, flight, launch
from disc_sim_ros.core.air import Air, Wind
from disc_sim_ros.core.axes import paper_from_map
from disc_sim_ros.core.disc import AERODYNAMICS
from disc_sim_ros.core.equations import Control
from disc_sim_ros.core.errors import ConfigError, DiscSimError

DEFAULT_RATE = 100.0  # Hz, of files without --samples
PLOTS = ('png', 'svg', 'pdf')
_PAPER = 'Crowther & Potts, Sports Engineering 10 (2007) 3-21'

# Flag, field of Launch, metavar, help.
_LAUNCH_FLAGS = (
    ('--speed', 'speed', 'M/S', 'speed over the ground'),
    ('--pitch', 'pitch', 'DEG', 'nose up positive'),
    ('--roll', 'roll', 'DEG', 'right edge down positive'),
    ('--yaw', 'yaw', 'DEG', 'right of +x positive'),
    ('--alpha', 'angle_of_attack', 'DEG', 'velocity below the x axis of the disc'),
    ('--sideslip', 'sideslip', 'DEG', 'velocity turned right in the plane of the disc'),
    ('--roll-rate', 'roll_rate', 'RAD/S', 'p at release'),
    ('--pitch-rate', 'pitch_rate', 'RAD/S', 'q at release'),
    ('--height', 'height', 'M', 'of the release above the ground'),
)
_FLAG_OF = {field: flag for flag, field, _, _ in _LAUNCH_FLAGS} | {
    'spin': '--spin',
    'disc': '--disc',
    'model': '--model',
    'aero': '--aero',
    'moment_axes': '--moment-axes',
    'step': '--step',
    'duration': '--duration',
    'sample_rate': '--samples',
}

_HINTS = {'--height': ', or give --no-ground'}


def parser() -> Parser:
    """Return the command line of `fly`."""
    p = Parser(
        prog='fly',
        description='Fly one disc from its release to the ground, without ROS. Angles and control '
        f'inputs have the signs of {_PAPER}; positions, velocities and wind are in map axes: '
        'x forward, y left, z up.',
    )
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    what = p.add_argument_group('what flies, and how it is computed')
    what.add_argument(
        '--disc',
        default='frisbee',
        metavar='NAME|FILE.yaml',
        help=f'{", ".join(catalogue.names())}, or your own file',
    )
    what.add_argument('--model', choices=tuple(flight.MODELS), default='exact', help='rigid body')
    what.add_argument(
        '--aero',
        choices=AERODYNAMICS,
        default=argparse.SUPPRESS,
        help="steady coefficients (default: the disc's own)",
    )
    what.add_argument(
        '--moment-axes',
        choices=tuple(flight.MOMENT_AXES),
        default='body',
        help='axes in which the moment coefficients act: 3 (body) or 4 (wind)',
    )
    _add_number(what, '--step', 1e-3, 1e-6, 0.1, 's', 'S', 'integration step')

    thrown = p.add_argument_group('launch')
    defaults = launch.Launch()
    for flag, field, metavar, text in _LAUNCH_FLAGS:
        lowest, highest, unit = launch.LIMITS[field]
        _add_number(thrown, flag, getattr(defaults, field), lowest, highest, unit, metavar, text)
    spin = thrown.add_mutually_exclusive_group()
    lowest, highest, unit = launch.LIMITS['spin']
    text = 'clockwise from above positive'
    _add_number(spin, '--spin', defaults.spin, lowest, highest, unit, 'RAD/S', text)
    spin.add_argument(
        '--advance-ratio',
        type=number(-100.0, 100.0, ''),
        default=argparse.SUPPRESS,
        metavar='R',
        help='spin as r c / (2 speed) instead, c the diameter; from -100 to 100',
    )

    around = p.add_argument_group('air, controls and end')
    around.add_argument(
        '--control',
        nargs=3,
        type=number(-10.0, 10.0, ''),
        default=(0.0, 0.0, 0.0),
        metavar=('CL', 'CM', 'CN'),
        help='control input coefficients for the whole flight: roll right, nose up, spin up '
        'positive; from -10 to 10 each',
    )
    around.add_argument(
        '--wind',
        nargs=3,
        type=number(-100.0, 100.0, 'm/s'),
        default=(0.0, 0.0, 0.0),
        metavar=('X', 'Y', 'Z'),
        help='where the air moves to; from -100 to 100 m/s each',
    )
    text = 'Dryden gusts (MIL-F-8785C) of a mean wind of this speed at 6 m; 15 is moderate'
    _add_number(around, '--turbulence', 0.0, 0.0, 50.0, 'm/s', 'M/S', text)
    around.add_argument(
        '--seed', type=_seed, default=0, metavar='N', help='of the gusts, a whole number from 0'
    )
    _add_number(around, '--air-density', 1.225, 0.0, 100.0, 'kg/m^3', 'KG/M3', 'of the air')
    _add_number(around, '--gravity', 9.81, 0.0, 100.0, 'm/s^2', 'M/S2', 'of the planet')
    text = 'longest time of flight'
    _add_number(around, '--duration', 60.0, 1e-6, flight.LONGEST, 's', 'S', text)
    around.add_argument(
        '--no-ground', action='store_true', help='fly on below z = 0, for the whole duration'
    )

    shown = p.add_argument_group('what comes out (without a flag: a summary to read)')
    shown.add_argument(
        '--samples',
        type=number(1e-3, 1e4, 'Hz'),
        default=argparse.SUPPRESS,
        metavar='HZ',
        help=f'samples per second, evenly timed; from 0.001 to 10000 (default: {DEFAULT_RATE:g} '
        'in files, else none)',
    )
    shape = shown.add_mutually_exclusive_group()
    shape.add_argument('--json', action='store_true', help='print one JSON document instead')
    shape.add_argument(
        '--csv', default=argparse.SUPPRESS, metavar='FILE', help='write the samples as CSV too'
    )
    shape.add_argument(
        '--plot',
        default=argparse.SUPPRESS,
        metavar='FILE.png',
        help='write a plot too; the name ends in .png, .svg or .pdf',
    )
    return p


def main(arguments: list[str] | None = None) -> int:
    """Run `fly`; return its exit code: 0, 1 for a failed flight, 2 for bad input."""
    output.mend_streams()
    p = parser()
    chosen = p.parse_args(arguments)
    try:
        _run(chosen)
    except ConfigError as error:
        thing = _FLAG_OF.get(error.thing, error.thing)
        if thing == '--spin' and hasattr(chosen, 'advance_ratio'):
            thing = '--advance-ratio, which means a spin'
        allowed = error.allowed + _HINTS.get(thing, '')
        p.error(str(ConfigError(thing, error.value, allowed)))
    except DiscSimError as error:
        sys.stderr.write(f'fly: error: {error}\n')
        return 1
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    return 0


def _run(chosen: argparse.Namespace) -> None:
    csv, plot = getattr(chosen, 'csv', None), getattr(chosen, 'plot', None)
    if csv is not None:
        output.check_writable('--csv', csv)
    if plot is not None:
        if _ending(plot) not in PLOTS:
            raise ConfigError('--plot', plot, 'the name must end in .png, .svg or .pdf')
        output.check_writable('--plot', plot)
    in_file = csv is not None or plot is not None
    rate = getattr(chosen, 'samples', DEFAULT_RATE if in_file else 0.0)

    found = _fly(chosen, rate)
    # Reports and plots are imported where they are needed: matplotlib takes half a second.
    from disc_sim_ros.analysis import report  # noqa: PLC0415

    if chosen.json:
        document = report.document(found)
        document['launch']['disc'] = chosen.disc  # of a file its path, which finds it again
        output.show(json.dumps(document, allow_nan=False))
        return
    lines = [report.summary(found)]
    if csv is not None:
        output.write_whole('--csv', csv, report.csv_text(found.trajectory).encode())
        lines.append(f'  wrote   {csv}, {len(found.trajectory)} rows')
    elif plot is not None:
        from disc_sim_ros.analysis import plots  # noqa: PLC0415

        figure = plots.flight_figure(found)
        output.write_whole('--plot', plot, plots.image(figure, _ending(plot)))
        lines.append(f'  wrote   {plot}')
    elif rate > 0.0:
        lines.append(report.samples_text(found.trajectory))
    output.show('\n'.join(lines))


def _fly(chosen: argparse.Namespace, rate: float) -> flight.Flight:
    disc = catalogue.load(chosen.disc)
    spin = chosen.spin
    if hasattr(chosen, 'advance_ratio'):
        if chosen.speed == 0.0 and chosen.advance_ratio != 0.0:
            raise ConfigError('--advance-ratio', chosen.advance_ratio, 'at --speed 0 give --spin')
        spin = derived.spin_rate(chosen.advance_ratio, disc.diameter, chosen.speed)
    values = {field: getattr(chosen, _dest(flag)) for flag, field, _, _ in _LAUNCH_FLAGS}
    thrown = launch.Launch(spin=spin, **values)
    ground = not chosen.no_ground
    setup = flight.Setup(
        disc=disc,
        model=chosen.model,
        aero=getattr(chosen, 'aero', None),
        moment_axes=chosen.moment_axes,
        air=Air(density=chosen.air_density, gravity=chosen.gravity),
        wind=Wind(
            mean=tuple(paper_from_map(chosen.wind).tolist()),
            turbulence=chosen.turbulence,
            seed=chosen.seed,
        ),
        step=chosen.step,
    )
    # Before any note: what is refused says one line.
    flight.check_flight(thrown, setup, chosen.duration, ground=ground, sample_rate=rate)
    if chosen.model == 'precession' and (thrown.roll_rate or thrown.pitch_rate):
        _note('--roll-rate and --pitch-rate change nothing: the precession model sets both itself')
    if not flight.is_ready():
        _note('compiling the equations of motion, once on this machine, about 10 s')
    with output.ended_by_ctrl_c():
        return flight.fly(
            thrown,
            setup,
            control=Control(*chosen.control),
            duration=chosen.duration,
            ground=ground,
            sample_rate=rate,
        )


def _add_number(
    group: argparse._ActionsContainer,
    flag: str,
    default: float,
    lowest: float,
    highest: float,
    unit: str,
    metavar: str,
    text: str,
) -> None:
    group.add_argument(
        flag,
        type=number(lowest, highest, unit),
        default=default,
        metavar=metavar,
        help=f'{text}; from {lowest:g} to {highest:g} {unit}',
    )


def _seed(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) >= 2**63:
        allowed = f'give a whole number from 0 to {2**63 - 1}'
        raise argparse.ArgumentTypeError(f'{text!r} is not allowed; {allowed}')
    return int(text)


def _dest(flag: str) -> str:
    return flag.removeprefix('--').replace('-', '_')


def _ending(name: str) -> str:
    return Path(name).suffix.removeprefix('.').lower()


def _note(text: str) -> None:
    sys.stderr.write(f'fly: note: {text}\n')


if __name__ == '__main__':
    sys.exit(main())
