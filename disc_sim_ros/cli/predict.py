"""`predict`: where recorded throws would have been predicted to land, while they flew."""

import argparse
from collections.abc import Sequence
import dataclasses
import json
from pathlib import Path
import sys
import time
from typing import TYPE_CHECKING, Any

from disc_sim_ros import __version__
from disc_sim_ros.cli import measured_file, output, pages
from disc_sim_ros.cli.arguments import Parser, add_components, add_quantity, path
from disc_sim_ros.cli.flags import Discs
from disc_sim_ros.cli.main import run_program
from disc_sim_ros.cli.progress import duration
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics import disc_file
from disc_sim_ros.quantities import MEAN_WIND, PREDICTION
from disc_sim_ros.units import NANOSECONDS, SYSTEMS, System

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from disc_sim_ros.estimation.prediction.predictor import Measurement, PredictorConfig
    from disc_sim_ros.estimation.prediction.replay import FollowedThrow

_EVERY = 10.0  # s between two lines of progress
_STALE = 0.1  # s; a prediction that is older than its row is told
WATCHED = (0.3, 0.5, 1.0, 1.5, 2.0)  # s, rows of the summary
LEAST_MISS = 0.01  # m, lower end of the axis of the plot
_FLAGS = {name: f'--{name.replace("_", "-")}' for name in PREDICTION}


def parser(prog: str = 'predict') -> Parser:
    """Return the command line of `predict`."""
    p = Parser(
        prog=prog,
        description='Predict the landings of recorded throws from their measured positions, as '
        'predictor_node does while they fly, and show how far each prediction is from the '
        'landing. The landing is that of the last prediction, when the disc was nearly down. '
        'FILE: a bag with nav_msgs/Odometry or geometry_msgs/PoseStamped, or a CSV file with the '
        'columns t_s, x_m, y_m, z_m (map: x forward, y left, z up) and, if attitudes were '
        'measured, qx, qy, qz, qw; a column `throw` separates several.',
        epilog='Exit code 0; 1: a bag cannot be read, or no throw was found; 2: bad input.',
    )
    p.set_defaults(prog=prog, outputs={'plot': output.check_plot, **pages.CHECKS})
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    p.add_argument('source', type=path, metavar='FILE', help='a bag or a CSV file')
    p.add_argument('--topic', help='the topic of the bag (default: the only one that moves)')
    p.add_argument(
        '--disc',
        type=path,
        action=Discs,
        default='ultrastar',
        metavar='NAME|FILE.yaml|NUMBERS',
        help='the disc, as for fly; give it several times where it is not known which was thrown',
    )
    for name, quantity in PREDICTION.items():
        add_quantity(p, _FLAGS[name], quantity)
    add_components(
        p,
        '--wind',
        tuple(MEAN_WIND.values()),
        ('X', 'Y', 'Z'),
        'expected velocity of the air in map axes',
    )
    p.add_argument(
        '--position-only', action='store_true', help='leave out attitudes that were measured'
    )
    p.add_argument(
        '--json', action='store_true', help='print one JSON document instead of the summary'
    )
    output.add_plot(p)
    pages.add_page(p)
    output.add_units(p)
    return p


def main(arguments: Sequence[str] | None = None, prog: str = 'predict') -> int:
    """Run `predict` and return its exit code: 0, 1 if no throw was found, 2 for bad input."""
    return run_program(parser(prog), _run, arguments)


def _run(chosen: argparse.Namespace) -> int:
    from disc_sim_ros.estimation.prediction.predictor import first_call_note  # noqa: PLC0415 - not for --help
    from disc_sim_ros.estimation.prediction.replay import replay  # noqa: PLC0415

    plot = getattr(chosen, 'plot', None)
    config, system = _config(chosen), SYSTEMS[chosen.units]
    recordings = _measurements(chosen)
    note = first_call_note()
    if note:
        output.note(chosen.prog, note)
    count = sum(len(measurements) for measurements in recordings.values())
    throws = replay(recordings, config, _Progress(chosen.prog, count))
    if not throws:
        ask = 'are positions in m with z up, and times in s, in their order?'
        raise DiscSimError(f'{chosen.source}: no throw in {count} measurements; {ask}')
    followed = {throw.recording for throw in throws}
    for name, measurements in recordings.items():
        if name not in followed:
            lost = len(measurements)
            output.note(chosen.prog, f'{name}: not recognised as a throw, {lost} measurements')
    if chosen.json:
        document = {'throws': [_document(throw, config.discs) for throw in throws]}
        output.show(json.dumps(document, allow_nan=False))
    else:
        parts = [_assumed(chosen, config, system)]
        parts += [_summary(throw, config.discs, system) for throw in throws]
        output.show('\n\n'.join(parts))
    if plot is not None:
        output.write_plot(plot, _figure(throws, system))
    if pages.is_wanted(chosen):  # after the numbers: they come even if the disk is full
        line = _write_page(chosen, throws, config)
        if chosen.json:
            output.note(chosen.prog, line)
        else:
            output.show(line)
    return 0


def _write_page(
    chosen: argparse.Namespace, throws: 'Sequence[FollowedThrow]', config: 'PredictorConfig'
) -> str:
    from disc_sim_ros.cli.predict_page import shown_throw  # noqa: PLC0415

    flights = [shown_throw(throw, config, SYSTEMS[chosen.units]) for throw in throws]
    title = f'Landings predicted from {Path(chosen.source).resolve().name}'
    return pages.write(chosen, flights, title, SYSTEMS[chosen.units])


def _config(chosen: argparse.Namespace) -> 'PredictorConfig':
    from disc_sim_ros.estimation.prediction.predictor_options import predictor_config  # noqa: PLC0415
    from disc_sim_ros.physics.environment import Wind  # noqa: PLC0415
    from disc_sim_ros.physics.flight import Setup  # noqa: PLC0415
    from disc_sim_ros.physics.frames import flip_yz  # noqa: PLC0415

    wind = Wind(mean=flip_yz(chosen.wind))
    names = getattr(chosen, 'discs', [chosen.disc])
    setups = [Setup(disc=disc_file.load_disc(name), wind=wind) for name in names]
    return predictor_config(setups, {name: getattr(chosen, name) for name in PREDICTION})


def _measurements(chosen: argparse.Namespace) -> 'dict[str, list[Measurement]]':
    """Return the measurements of each recording: of a bag, or of each throw of a file."""
    from disc_sim_ros.estimation import throw_csv  # noqa: PLC0415
    from disc_sim_ros.estimation.prediction import replay  # noqa: PLC0415

    source = Path(chosen.source)
    if source.suffix.lower() == '.csv':
        if chosen.topic is not None:
            raise ConfigError('--topic', chosen.topic, 'a CSV file has no topics')
        throws = measured_file.read(chosen.source, 'FILE', chosen.prog)
        recordings = {
            throw_csv.label(name): replay.measurements_of(throw_csv.label(name), columns)
            for name, columns in throws.items()
        }
    else:
        recordings = {source.name: _of_bag(source, chosen.topic)}
    if chosen.position_only:
        return {
            name: [dataclasses.replace(m, axis=None) for m in of]
            for name, of in recordings.items()
        }
    return recordings


def _of_bag(source: Path, topic: str | None) -> 'list[Measurement]':
    from disc_sim_ros.analysis import recording  # noqa: PLC0415
    from disc_sim_ros.bags.reader import open_bag  # noqa: PLC0415
    from disc_sim_ros.estimation.prediction import replay  # noqa: PLC0415

    discs = recording.discs(open_bag(source), topic)
    if len(discs) > 1:
        names = ', '.join(disc.motion.topic for disc in discs)
        raise ConfigError('--topic', None, f'choose one of {names}')
    motion = discs[0].motion
    time = (motion.stamps - motion.stamps[0]) / NANOSECONDS
    quaternion = motion.quaternion if motion.has_attitude else None
    return replay.measurements(time, motion.position, quaternion)


def _rows(throw: 'FollowedThrow') -> list[dict[str, float | None]]:
    """Return what was known at some times; where no landing was measured, no miss is known."""
    rows: list[dict[str, float | None]] = []
    for watched in WATCHED:
        p = throw.at(watched)
        if p is None or throw.watched[-1] < watched:
            continue
        variances = p.covariance[:2, :2].diagonal()
        from_last = float(((p.landing - throw.landing[:2]) ** 2).sum()) ** 0.5
        rows.append(
            {
                'watched_s': watched,
                'measured_until_s': p.time - p.reference_time,
                'x_m': float(p.landing[0]),
                'y_m': float(p.landing[1]),
                'landing_s': p.landing_time - p.reference_time,
                'sigma_x_m': float(variances[0]) ** 0.5,
                'sigma_y_m': float(variances[1]) ** 0.5,
                'from_last_m': from_last,
                'miss_m': from_last if throw.is_complete else None,
            }
        )
    return rows


def _document(throw: 'FollowedThrow', discs: Sequence[str]) -> dict[str, Any]:
    x, y, time = throw.landing
    last = throw.predictions[-1]
    return {
        'throw': throw.number,
        'name': throw.name,
        'begins_s': last.reference_time,
        'landing_m': [float(x), float(y)],
        'time_of_flight_s': float(time) - last.reference_time,
        'to_the_landing': throw.is_complete,
        'wind_m_s': [float(w) for w in last.wind],
        'disc_weights': dict(zip(discs, last.weights.tolist(), strict=True)),
        'predictions': _rows(throw),
    }


def _assumed(chosen: argparse.Namespace, config: 'PredictorConfig', system: System) -> str:
    spin = f'{system.number(chosen.throw_spin, "rad/s"):.0f}'
    sigma = system.text(chosen.throw_spin_sigma, 'rad/s', '.0f')
    return (
        f'assumed: {" or ".join(config.discs)} (--disc), '
        f'spin of {spin} +- {sigma} (--throw-spin), '
        f'{config.opposite_spin:.0%} the other way round (--opposite-spin)'
    )


def _summary(throw: 'FollowedThrow', discs: Sequence[str], system: System) -> str:
    x, y, time = throw.landing
    last = throw.predictions[-1]
    whole = throw.is_complete
    lines = [
        f'{throw.name}: measured from {last.reference_time:.3f} s, '
        f'{"lands" if whole else "would land"} at '
        f'x {system.text(x, "m", "z.2f")}, y {system.text(y, "m", "z.2f")} '
        f'after {time - last.reference_time:.2f} s'
    ]
    if not whole:
        left = last.landing_time - last.time
        lines.append(f'  the measurements end {left:.2f} s before the landing: no miss is known')
    m = f'{system.length:<2}'
    distance = f' miss {m}' if whole else f'from the last {m}'
    lines.append(f'  watched s   x {m}     y {m}     sigma x, y {m}   {distance}'.rstrip())
    for row in _rows(throw):
        r = {name: x for name, x in row.items() if x is not None}
        r |= {name: system.number(x, 'm') for name, x in r.items() if name.endswith('_m')}
        until = r['measured_until_s']
        is_stale = until < r['watched_s'] - _STALE
        stale = f'  nothing measured since {until:.2f} s' if is_stale else ''
        lines.append(
            f'  {r["watched_s"]:8.1f}  {r["x_m"]:7.2f}  {r["y_m"]:7.2f}  '
            f'{r["sigma_x_m"]:7.2f} {r["sigma_y_m"]:7.2f}  {r["from_last_m"]:9.2f}{stale}'
        )
    wind = f'{system.number(last.wind[0], "m/s"):z.1f}, {system.text(last.wind[1], "m/s", "z.1f")}'
    lines.append(f'  estimated wind {wind}')
    if len(discs) > 1:
        likely = sorted(
            zip(discs, last.weights, strict=True), key=lambda pair: pair[1], reverse=True
        )
        lines.append('  disc: ' + ', '.join(f'{name} {100 * w:.1f} %' for name, w in likely))
    return '\n'.join(lines)


class _Progress:
    """Shows on stderr how many measurements are done, at most every 10 seconds."""

    def __init__(self, prog: str, total: int) -> None:
        self._prog, self._total = prog, total
        self._started = self._last = time.monotonic()

    def __call__(self, done: int) -> None:
        """Show the number of measurements so far, and a guess of the time left."""
        now = time.monotonic()
        if now - self._last >= _EVERY:
            self._last = now
            left = duration((now - self._started) / done * (self._total - done))
            output.note(self._prog, f'{done} of {self._total} measurements; about {left} left')


def _figure(throws: 'Sequence[FollowedThrow]', system: System) -> 'Figure':
    """Return the miss of each throw over the time of watching."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415
    from matplotlib.ticker import FuncFormatter  # noqa: PLC0415

    from disc_sim_ros.palette import COLOURS  # noqa: PLC0415

    figure = Figure(figsize=(8, 5), layout='constrained')
    FigureCanvasAgg(figure)
    axis = figure.add_subplot()
    for i, throw in enumerate(throws):
        colour = COLOURS[i % len(COLOURS)]
        of = 'landing' if throw.is_complete else 'last prediction: it was measured in part'
        label = f'{throw.name}: miss of the {of}'
        misses = system.number(throw.misses, 'm')
        axis.semilogy(throw.watched, misses, color=colour, label=label)
        sigma = [
            system.number(float(p.covariance[:2, :2].trace()) ** 0.5, 'm')
            for p in throw.predictions
        ]
        label = f'{throw.name}: standard deviation that the predictor states'
        axis.semilogy(throw.watched, sigma, color=colour, ls=':', label=label)
    axis.set(xlabel='measured for, s', ylabel=f'distance on the ground, {system.length}')
    axis.set_ylim(bottom=system.number(LEAST_MISS, 'm'))  # the last miss is 0
    axis.yaxis.set_major_formatter(FuncFormatter(lambda distance, _: f'{distance:g}'))
    axis.grid(color='0.9')
    axis.legend(loc='best', fontsize='small')
    return figure


if __name__ == '__main__':
    sys.exit(main())
