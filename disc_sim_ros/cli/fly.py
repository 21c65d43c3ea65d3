"""`fly`: one flight of one disc, without ROS."""

import argparse
from collections.abc import Callable
from dataclasses import replace
import json
from pathlib import Path
import signal
import sys
import time

from disc_sim_ros import __version__, files
from disc_sim_ros.cli import flags, output
from disc_sim_ros.cli.arguments import Parser, number
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics import flight
from disc_sim_ros.physics.launch import Launch

DEFAULT_RATE = 100.0  # Hz, of files without --samples
PLOTS = ('png', 'svg', 'pdf')
_FLAG_OF = {
    'duration': '--duration',
    'sample_rate': '--samples',
    'bag': '--bag',
}
_HINTS = {'--height': ', or give --no-ground'}


def parser() -> Parser:
    """Return the command line of `fly`."""
    p = Parser(
        prog='fly',
        description='Fly one disc from its release to the ground, without ROS. Angles and control '
        f'inputs have the signs of {flags.PAPER}; positions, velocities and wind are in map '
        'axes: x forward, y left, z up.',
    )
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    flags.add_disc(p)
    flags.add_launch(p)
    around = flags.add_air(p, 'air, controls and end')
    text = 'longest time of flight'
    flags.add_number(around, '--duration', 60.0, 1e-6, flight.LONGEST, 's', 'S', text)
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
        f'in files, {flags.PUBLISH_RATE:g} in bags, else none)',
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
    shape.add_argument(
        '--bag',
        default=argparse.SUPPRESS,
        metavar='DIR',
        help='write the bag too that sim_node and recorder_node would; a new folder. Its stamps '
        'begin at the present second. Needs the message packages of ROS 2',
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
        thing = flags.flag_of(error, chosen)
        thing = _FLAG_OF.get(thing, thing)
        allowed = error.allowed + _HINTS.get(thing, '')
        p.error(str(ConfigError(thing, error.value, allowed)))
    except DiscSimError as error:
        sys.stderr.write(f'fly: error: {error}\n')
        return 1
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    return 0


def _run(chosen: argparse.Namespace) -> None:
    csv, plot, bag = (getattr(chosen, name, None) for name in ('csv', 'plot', 'bag'))
    if csv is not None:
        output.check_writable('--csv', csv)
    if plot is not None:
        if _ending(plot) not in PLOTS:
            raise ConfigError('--plot', plot, 'the name must end in .png, .svg or .pdf')
        output.check_writable('--plot', plot)
    in_file = csv is not None or plot is not None
    rate = getattr(chosen, 'samples', DEFAULT_RATE if in_file else 0.0)
    release, setup = flags.thrown(chosen)
    write = None if bag is None else _bag_writer(chosen, bag, release, setup)

    found = _fly(chosen, release, setup, 0.0 if bag is not None else rate)
    # Reports and plots are imported where they are needed: matplotlib takes half a second.
    from disc_sim_ros.analysis import flight_report  # noqa: PLC0415

    if chosen.json:
        document = flight_report.document(found)
        document['launch']['disc'] = chosen.disc  # of a file its path, which finds it again
        output.show(json.dumps(document, allow_nan=False))
        return
    lines = [flight_report.summary(found)]
    if csv is not None:
        output.write_whole('--csv', csv, flight_report.csv_text(found.trajectory).encode())
        lines.append(f'  wrote   {csv}, {len(found.trajectory)} rows')
    elif plot is not None:
        from disc_sim_ros.analysis import plots  # noqa: PLC0415

        figure = plots.flight_figure(found)
        output.write_whole('--plot', plot, plots.image(figure, _ending(plot)))
        lines.append(f'  wrote   {plot}')
    elif write is not None:
        lines.append(f'  wrote   {write()}')
    elif rate > 0.0:
        lines.append(flight_report.samples_text(found.trajectory))
    output.show('\n'.join(lines))


def _fly(
    chosen: argparse.Namespace, release: Launch, setup: flight.Setup, rate: float
) -> flight.Flight:
    ground = not chosen.no_ground
    # Before any note: what is refused says one line.
    flight.check_flight(release, setup, chosen.duration, ground=ground, sample_rate=rate)
    if chosen.model == 'precession' and (release.roll_rate or release.pitch_rate):
        _note('--roll-rate and --pitch-rate change nothing: the precession model sets both itself')
    if not flight.is_ready():
        _note('compiling the equations of motion, once on this machine, about 10 s')
    with output.ended_by_ctrl_c():
        return flight.fly(
            release,
            setup,
            control=flags.control_of(chosen),
            duration=chosen.duration,
            ground=ground,
            sample_rate=rate,
        )


def _bag_writer(
    chosen: argparse.Namespace, bag: str, release: Launch, setup: flight.Setup
) -> Callable[[], str]:
    """Return the function that writes the bag and tells what it wrote.

    Raises:
        ConfigError: The bag cannot be written, without the flight being flown.
    """
    try:  # half a second, and not everywhere
        from disc_sim_ros.ros.sim import offline_bag  # noqa: PLC0415
        from disc_sim_ros.ros.sim.config import configuration  # noqa: PLC0415
    except ImportError as error:
        allowed = f'it needs rclpy and the message packages of ROS 2 Jazzy ({error})'
        raise ConfigError('--bag', bag, allowed) from None
    files.check_new_folder('bag', Path(bag))
    flight.check_flight(
        release, setup, chosen.duration, ground=not chosen.no_ground, sample_rate=0.0
    )
    values = flags.parameters(chosen, release, setup)
    values['ground'] = not chosen.no_ground
    if hasattr(chosen, 'samples'):
        values['publish_rate'] = chosen.samples
    config = replace(configuration(values), setup=setup)

    def write() -> str:
        start = offline_bag.epoch(time.time_ns())
        control = flags.control_of(chosen)
        written = offline_bag.write_flight(bag, config, control, chosen.duration, start)
        total = sum(written.counts.values())
        topics = sum(count > 0 for count in written.counts.values())
        return f'{bag}: {total} messages of {topics} topics, {written.size / 1e6:.1f} MB'

    return write


def _ending(name: str) -> str:
    return Path(name).suffix.removeprefix('.').lower()


def _note(text: str) -> None:
    sys.stderr.write(f'fly: note: {text}\n')


if __name__ == '__main__':
    sys.exit(main())
