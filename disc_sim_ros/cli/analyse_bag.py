"""`analyse_bag`: what a bag tells of the flights in it, and whether it is true. No ROS."""

import argparse
import json
import math
from pathlib import Path
import signal
import sys
from typing import TYPE_CHECKING, Any

from disc_sim_ros import __version__
from disc_sim_ros.cli import output
from disc_sim_ros.cli.arguments import Parser
from disc_sim_ros.errors import ConfigError, DiscSimError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from disc_sim_ros.analysis.bag_report import Analysis
    from disc_sim_ros.analysis.recording import Disc
    from disc_sim_ros.bags.reader import Bag

DIFFERENT = 3  # exit code
PLOTS = ('png', 'svg', 'pdf')


def parser() -> Parser:
    """Return the command line of `analyse_bag`."""
    p = Parser(
        prog='analyse_bag',
        description='Tell of the flights in a bag: launch, landing (m, s), commands, wind and how '
        'complete its messages are. A bag of sim_node, or any MCAP bag with nav_msgs/Odometry or '
        'geometry_msgs/PoseStamped. Angles have the signs of Crowther & Potts (2007), in degrees; '
        'positions are in map axes: x forward, y left, z up.',
        epilog='Exit code 0; 1: the bag is damaged; 2: bad input; 3: --verify found a difference.',
    )
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    p.add_argument('bag', metavar='BAG', help='folder of the bag, or one .mcap file')
    p.add_argument(
        '--verify',
        action='store_true',
        help='fly each recorded release, wind, command and seed again and compare with the '
        'recorded odometry; of other bags check stamps, quaternions and velocities',
    )
    p.add_argument('--json', action='store_true', help='print one JSON document instead')
    p.add_argument(
        '--plot',
        default=argparse.SUPPRESS,
        metavar='FILE.png',
        help='write a plot too; the name ends in .png, .svg or .pdf',
    )
    p.add_argument(
        '--disc',
        default=argparse.SUPPRESS,
        metavar='NAME',
        help='only this disc: its name in the report, its namespace or its frame',
    )
    p.add_argument(
        '--topic',
        default=argparse.SUPPRESS,
        metavar='NAME',
        help='take the motion from this topic (default: from every Odometry)',
    )
    return p


def main(arguments: list[str] | None = None) -> int:
    """Run `analyse_bag`; return its exit code."""
    output.mend_streams()
    p = parser()
    chosen = p.parse_args(arguments)
    try:
        return _run(chosen)
    except ConfigError as error:
        p.error(str(error))
    except DiscSimError as error:
        sys.stderr.write(f'analyse_bag: error: {error}\n')
        return 1
    except KeyboardInterrupt:
        return 128 + signal.SIGINT


def _run(chosen: argparse.Namespace) -> int:
    plot = getattr(chosen, 'plot', None)
    if plot is not None:
        if Path(plot).suffix.removeprefix('.').lower() not in PLOTS:
            raise ConfigError('--plot', plot, 'the name must end in .png, .svg or .pdf')
        output.check_writable('--plot', plot)
    # What takes a second to import is imported when the flags are known to be right.
    from disc_sim_ros.analysis import bag_report, flights, recording  # noqa: PLC0415
    from disc_sim_ros.bags.reader import open_bag  # noqa: PLC0415
    from disc_sim_ros.errors import BagError  # noqa: PLC0415

    try:
        bag = open_bag(chosen.bag)
        discs = recording.discs(bag, getattr(chosen, 'topic', None))
    except BagError as error:
        sys.stderr.write(f'analyse_bag: error: {error}\n')
        return 2
    discs = _chosen_discs(discs, getattr(chosen, 'disc', None))
    doubts = _doubts(bag)
    if not bag.complete:
        _note(f'{chosen.bag} was not ended or is damaged; `repair_bag` makes it whole')
    found = [
        (disc, [bag_report.analyse(f, doubts) for f in flights.flights(disc)]) for disc in discs
    ]
    if plot is not None:
        _plot(plot, chosen.bag, [a for _, analyses in found for a in analyses])
    if chosen.json:
        document = _bag_document(bag) | {
            'discs': [_disc_document(disc, analyses, chosen) for disc, analyses in found]
        }
        output.show(json.dumps(_finite(document), allow_nan=False))
    else:
        lines = _bag_lines(bag)
        for disc, analyses in found:
            lines += _disc_lines(disc, analyses, verify=chosen.verify)
        if plot is not None:
            lines.append(f'wrote {plot}')
        output.show('\n'.join(lines))
    every = [a for _, analyses in found for a in analyses]
    return DIFFERENT if chosen.verify and not all(map(bag_report.passed, every)) else 0


def _chosen_discs(discs: 'list[Disc]', name: str | None) -> 'list[Disc]':
    if name is None:
        return discs
    wanted = name.strip('/')
    chosen = [
        disc
        for disc in discs
        if wanted in {disc.name, disc.namespace.strip('/'), disc.motion.child}
    ]
    if not chosen:
        raise ConfigError('--disc', name, f'choose from {", ".join(d.name for d in discs)}')
    return chosen


def _doubts(bag: 'Bag') -> tuple[str, ...]:
    """Return why a whole bag may lack messages."""
    from disc_sim_ros.analysis.bag_report import losses  # noqa: PLC0415

    doubts = [f'{key}: {value}' for key, value in losses(bag.custom_data)]
    if not bag.complete:
        doubts.append('the bag was not ended or is damaged')
    return tuple(doubts)


def _plot(name: str, bag: str, analyses: 'Sequence[Analysis]') -> None:
    if not analyses:
        raise DiscSimError(f'{bag}: nothing flies in it, there is no plot to make')
    from disc_sim_ros.analysis import bag_plots, plots  # noqa: PLC0415

    title = bag_plots.title(analyses[0]) if len(analyses) == 1 else Path(bag).name
    figure = bag_plots.bag_figure(analyses, title)
    kind = Path(name).suffix.removeprefix('.').lower()
    output.write_whole('--plot', name, plots.image(figure, kind))


def _bag_document(bag: 'Bag') -> dict[str, Any]:
    seconds = _seconds(bag)
    return {
        'version': __version__,
        'bag': str(bag.path),
        'complete': bag.complete,
        'start_ns': bag.start,
        'duration_s': seconds,
        'messages': bag.message_count,
        'custom_data': bag.custom_data,
        'topics': [
            {
                'name': info.topic.name,
                'type': info.topic.type,
                'messages': info.message_count,
                'rate_hz': _rate(info.message_count, seconds),
            }
            for info in bag.topics
        ],
    }


def _disc_document(
    disc: 'Disc', analyses: 'Sequence[Analysis]', chosen: argparse.Namespace
) -> dict[str, Any]:
    from disc_sim_ros.analysis import bag_report  # noqa: PLC0415

    flights = []
    for a in analyses:
        document = bag_report.document(a)
        if chosen.verify:
            document['verification'] = bag_report.verification(a)
        flights.append(document)
    return {
        'disc': disc.name,
        'topic': disc.motion.topic,
        'frame': disc.motion.frame,
        'child_frame': disc.motion.child,
        'messages': len(disc.motion),
        'events': [
            {'name': e.name, 'stamp_ns': e.stamp, 'values': dict(e.values)} for e in disc.events
        ],
        'flights': flights,
    }


def _bag_lines(bag: 'Bag') -> list[str]:
    from disc_sim_ros.analysis.bag_report import losses  # noqa: PLC0415

    seconds = _seconds(bag)
    filled = [info for info in bag.topics if info.message_count]
    size = sum(file.stat().st_size for file in bag.files)
    lines = [
        f'{bag.path}: {seconds:.2f} s, {bag.message_count} messages of {len(filled)} topics, '
        f'{size / 1e6:.1f} MB'
    ]
    counts = [f'{info.topic.name} {info.message_count}' for info in filled]
    while counts:
        line = '  ' + counts.pop(0)
        while counts and len(line) + len(counts[0]) < 97:
            line += ', ' + counts.pop(0)
        lines.append(line)
    return lines + [f'  {key}: {value}' for key, value in losses(bag.custom_data)]


def _disc_lines(disc: 'Disc', analyses: 'Sequence[Analysis]', *, verify: bool) -> list[str]:
    from disc_sim_ros.analysis import bag_text  # noqa: PLC0415

    lines = [f'{disc.name}: {disc.motion.topic}, {len(disc.motion)} messages']
    if not analyses:
        lines.append('  no flight: nothing was thrown, and nothing moves')
    for a in analyses:
        lines.append(bag_text.summary(a))
        if verify:
            lines.append(bag_text.verification(a))
    return lines


def _finite(value: Any) -> Any:
    """Return a document with null for numbers that JSON does not know."""
    match value:
        case dict():
            return {key: _finite(x) for key, x in value.items()}
        case list():
            return [_finite(x) for x in value]
        case float() if not math.isfinite(value):
            return None
    return value


def _seconds(bag: 'Bag') -> float:
    return (bag.end - bag.start) / 1e9


def _rate(count: int, seconds: float) -> float | None:
    return (count - 1) / seconds if count > 1 and seconds > 0.0 else None


def _note(text: str) -> None:
    sys.stderr.write(f'analyse_bag: note: {text}\n')


if __name__ == '__main__':
    sys.exit(main())
