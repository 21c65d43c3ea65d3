"""`fly`: computes one flight of one disc, without ROS."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
import json
from pathlib import Path
import sys
import time

from disc_sim_ros import __version__, files
from disc_sim_ros.cli import flags, output, pages, start
from disc_sim_ros.cli.arguments import Parser, add_quantity, path
from disc_sim_ros.cli.main import run_program
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import flight
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.trajectory import Trajectory
from disc_sim_ros.quantities import SAMPLE_RATE
from disc_sim_ros.units import SYSTEMS

STDOUT = '-'  # as the name of a file
DEFAULT_RATE = 100.0  # Hz, of files without --samples


def parser(prog: str = 'fly') -> Parser:
    """Return the command line of `fly`."""
    p = Parser(
        prog=prog,
        description='Compute the flight of one disc from its release to the ground, without ROS. '
        f'Angles and control inputs have the signs of {flags.PAPER}; positions, velocities and '
        'wind are in map axes: x forward, y left, z up.',
    )
    p.set_defaults(
        prog=prog,
        outputs={
            'csv': _check_csv,
            'bag': _check_bag,
            'plot': output.check_plot,
            **pages.CHECKS,
        },
    )
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    flags.add_disc(p, several=True)
    flags.add_launch(p)
    around = flags.add_air(p, 'air, control inputs and end of the flight')
    flags.add_duration(around)
    flags.add_no_ground(around)

    shown = p.add_argument_group('output (default: a summary to read)')
    text = (
        f'samples per second, evenly spaced in time (default: {DEFAULT_RATE:g} in files, '
        f'{flags.PUBLISH_RATE:g} in bags, otherwise no samples)'
    )
    rates = SAMPLE_RATE.within(1e-3, 1e4)
    add_quantity(shown, '--samples', rates, dest='samples', text=text, default=argparse.SUPPRESS)
    output.add_units(shown)
    shown.add_argument(
        '--techdisc',
        type=path,
        default=argparse.SUPPRESS,
        metavar='FILE.csv',
        help='fly the throws of this file of a TechDisc, one a row, from --height; columns '
        'speedMph, speedKmh or speedMps, spinRpm, launchAngle, noseAngle, hyzerAngle, and, if '
        'there, wobbleAngle and throwType',
    )
    pages.add_page(shown)
    shape = shown.add_mutually_exclusive_group()
    shape.add_argument(
        '--json', action='store_true', help='print one JSON document instead of the summary'
    )
    shape.add_argument(
        '--csv',
        type=path,
        default=argparse.SUPPRESS,
        metavar='FILE',
        help='also write the samples as CSV; -: print them in place of the summary',
    )
    output.add_plot(shape)
    shape.add_argument(
        '--bag',
        type=path,
        default=argparse.SUPPRESS,
        metavar='DIR',
        help='also write the bag that sim_node and recorder_node would record of this flight, to '
        'a new folder; its time stamps start at the current second; needs the message packages '
        'of ROS 2',
    )
    return p


def main(arguments: Sequence[str] | None = None, prog: str = 'fly') -> int:
    """Run `fly` and return its exit code: 0, 1 for a failed flight, 2 for bad input."""
    return run_program(parser(prog), _run, arguments, in_flags=_in_flags)


def _in_flags(error: ConfigError, chosen: argparse.Namespace, parser: Parser) -> ConfigError:
    """Return an error that names the flag and, for a release below the ground, the remedy."""
    remedy = ', or give --no-ground' if error.quantity == 'height' else ''
    error = ConfigError(error.thing, error.value, error.allowed + remedy, error.quantity)
    return flags.in_flags(error, chosen, parser)


def _check_csv(name: str) -> None:
    if name != STDOUT:
        output.check_writable('--csv', name)


def _check_bag(name: str) -> None:
    files.check_new_folder('bag', Path(name))


def _run(chosen: argparse.Namespace) -> int:
    several = hasattr(chosen, 'techdisc') or len(getattr(chosen, 'discs', ())) > 1
    report = _compare if several else _report
    flown = report(chosen)
    if not pages.is_wanted(chosen):
        return 0
    # After the numbers: they come even if the disk is full.
    line = _write_page(chosen, flown)
    if chosen.json or getattr(chosen, 'csv', None) == STDOUT:
        output.note(chosen.prog, line)
    else:
        output.show(line if several else f'  {line}')
    return 0


def _report(chosen: argparse.Namespace) -> dict[str, flight.Flight]:
    """Fly one disc and show its flight."""
    csv, plot, bag = (getattr(chosen, name, None) for name in ('csv', 'plot', 'bag'))
    in_file = csv is not None or plot is not None
    rate = getattr(chosen, 'samples', DEFAULT_RATE if in_file else 0.0)
    sampled = rate if bag is None else 0.0
    if pages.is_wanted(chosen):
        sampled = sampled or pages.RATE
    release, setup = flags.thrown(chosen)
    if bag is not None:  # a bag holds a flight in even steps
        setup = replace(setup, step=setup.fixed_step)
    write = None if bag is None else _bag_writer(chosen, bag, release, setup)

    flown = _fly(chosen, release, setup, sampled)
    names = {flown.setup.disc.name: flown}
    from disc_sim_ros.analysis import flight_report  # noqa: PLC0415 - not before it is needed

    if chosen.json:
        document = flight_report.document(flown if rate else _without_samples(flown))
        document['launch']['disc'] = chosen.disc  # of a file its path, so that it can fly again
        output.show(json.dumps(document, allow_nan=False))
        return names
    if csv == STDOUT:
        output.show(flight_report.csv_text(flown.trajectory).rstrip('\n'))
        return names
    lines = [flight_report.summary(flown, SYSTEMS[chosen.units])]
    if csv is not None:
        output.write_whole('--csv', csv, flight_report.csv_text(flown.trajectory).encode())
        lines.append(f'  wrote   {csv}, {len(flown.trajectory)} rows')
    elif plot is not None:
        from disc_sim_ros.analysis import plots  # noqa: PLC0415 - matplotlib takes half a second

        output.write_plot(plot, plots.flight_figure(flown, SYSTEMS[chosen.units]))
        lines.append(f'  wrote   {plot}')
    elif write is not None:
        lines.append(f'  wrote   {write()}')
    elif rate > 0.0:
        lines.append(flight_report.samples_text(flown.trajectory, SYSTEMS[chosen.units]))
    output.show('\n'.join(lines))
    return names


def _compare(chosen: argparse.Namespace) -> dict[str, flight.Flight]:
    """Fly each disc, with each throw of `--techdisc`, and show them side by side."""
    for name in ('csv', 'bag'):
        if hasattr(chosen, name):
            allowed = 'it takes a single flight'
            raise ConfigError(f'--{name}', getattr(chosen, name), allowed)
    from disc_sim_ros.analysis import comparison, flight_report, techdisc  # noqa: PLC0415

    plot = getattr(chosen, 'plot', None)
    default = pages.RATE if pages.is_wanted(chosen) else DEFAULT_RATE if plot is not None else 0.0
    rate = getattr(chosen, 'samples', default)
    throws = []
    if hasattr(chosen, 'techdisc'):
        flags.refuse_launch(chosen, '--techdisc')
        throws = techdisc.throws(chosen.techdisc)
    discs = getattr(chosen, 'discs', [chosen.disc])
    flown: dict[str, flight.Flight] = {}
    for disc in discs:
        chosen.disc = disc
        release, setup = flags.thrown(chosen)
        if not throws:
            flown[disc] = _fly(chosen, release, setup, rate)
        for throw in throws:
            name = f'{disc} {throw.name}' if len(discs) > 1 else throw.name
            launch = throw.release.launch(setup.disc, chosen.height)
            flown[name] = _fly(chosen, launch, setup, rate)
    names, flights = list(flown), list(flown.values())
    if chosen.json:
        bare = not hasattr(chosen, 'samples')  # those of a page are not printed
        documents = [
            {'name': n, **flight_report.document(_without_samples(f) if bare else f)}
            for n, f in flown.items()
        ]
        output.show(json.dumps({'flights': documents}, allow_nan=False))
        return flown
    lines = [comparison.table(names, flights, SYSTEMS[chosen.units])]
    if plot is not None:
        from disc_sim_ros.analysis import plots  # noqa: PLC0415 - matplotlib takes half a second

        output.write_plot(plot, plots.comparison_figure(flights, names, SYSTEMS[chosen.units]))
        lines.append(f'wrote {plot}')
    output.show('\n'.join(lines))
    return flown


def _without_samples(flown: flight.Flight) -> flight.Flight:
    """Return a flight whose samples were for the page only."""
    trajectory = flown.trajectory
    return replace(flown, trajectory=Trajectory(trajectory.rows[:0], trajectory.diameter))


def _write_page(chosen: argparse.Namespace, flown: dict[str, flight.Flight]) -> str:
    from disc_sim_ros.view import shown  # noqa: PLC0415 - only with --html or --view

    system = SYSTEMS[chosen.units]
    flights = [shown.of_flight(f, name, system) for name, f in flown.items()]
    return pages.write(chosen, flights, f'Flight of {", ".join(flown)}', system)


def _fly(
    chosen: argparse.Namespace, release: Launch, setup: flight.Setup, rate: float
) -> flight.Flight:
    ground = not chosen.no_ground
    # Before any note: bad input prints one line only.
    flight.check_flight(release, setup, chosen.duration, ground=ground, sample_rate=rate)
    if chosen.model == 'precession' and (release.roll_rate or release.pitch_rate):
        text = 'the precession model computes both rates itself'
        output.note(chosen.prog, f'note: --roll-rate and --pitch-rate have no effect: {text}')
    if text := flight.first_call_note():
        output.note(chosen.prog, f'note: {text}')
    with start.ended_by_ctrl_c():
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
    """Return the function that writes the bag and returns a line about it.

    Raises:
        ConfigError: The bag cannot be written; checked before the flight is computed.
    """
    try:  # takes half a second, and ROS may be missing
        from disc_sim_ros.ros.sim import offline_bag  # noqa: PLC0415
        from disc_sim_ros.ros.sim.config import configuration  # noqa: PLC0415
    except ImportError as error:
        allowed = f'it needs rclpy and the message packages of ROS 2 Jazzy ({error})'
        raise ConfigError('--bag', bag, allowed) from None
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


if __name__ == '__main__':
    sys.exit(main())
