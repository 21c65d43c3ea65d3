"""`analyse_bag`: summarises, verifies and plots the flights in an MCAP bag, without ROS."""

import argparse
from collections import Counter
from collections.abc import Sequence
import json
import math
from pathlib import Path
import sys
from typing import TYPE_CHECKING, Any

from disc_sim_ros import __version__
from disc_sim_ros.cli import output, pages
from disc_sim_ros.cli.arguments import Parser, path
from disc_sim_ros.cli.main import BAD_INPUT, DIFFERENT, run_program
from disc_sim_ros.errors import BagError, ConfigError, DamageError, DiscSimError, printable
from disc_sim_ros.units import SYSTEMS

if TYPE_CHECKING:
    from disc_sim_ros.analysis.bag_analysis import Analysis
    from disc_sim_ros.analysis.recording import Disc
    from disc_sim_ros.bags.reader import Bag


def parser(prog: str = 'analyse_bag') -> Parser:
    """Return the command line of `analyse_bag`."""
    p = Parser(
        prog=prog,
        description='Summarise the flights in a bag: launch, landing (m, s), commands, wind, and '
        'how complete the recording is. Reads bags of sim_node and any MCAP bag with '
        'nav_msgs/Odometry or geometry_msgs/PoseStamped. Angles are in degrees with the signs of '
        'Crowther & Potts (2007); positions are in map axes: x forward, y left, z up.',
        epilog='Exit code 0, after a note if the end of the bag is missing; 1: the bag is damaged '
        'in the middle; 2: bad input; 3: --verify found a difference, a throw without its motion, '
        'or nothing to verify.',
    )
    p.set_defaults(prog=prog, outputs={'plot': output.check_plot, **pages.CHECKS})
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    p.add_argument('bag', type=path, metavar='BAG', help='folder of the bag, or one .mcap file')
    p.add_argument(
        '--verify',
        action='store_true',
        help='compute each flight again from the recorded release, wind, commands and seed, and '
        'compare it with the recorded odometry; in bags of other programs, check stamps, '
        'quaternions and velocities',
    )
    p.add_argument(
        '--json', action='store_true', help='print one JSON document instead of the summary'
    )
    output.add_units(p)
    output.add_plot(p)
    pages.add_page(p)
    p.add_argument(
        '--disc',
        default=argparse.SUPPRESS,
        metavar='NAME',
        help='only this disc, by its name in the report, its namespace or its frame',
    )
    p.add_argument(
        '--topic',
        default=argparse.SUPPRESS,
        metavar='NAME',
        help='read the motion from this topic (default: from every Odometry topic)',
    )
    return p


def main(arguments: Sequence[str] | None = None, prog: str = 'analyse_bag') -> int:
    """Run `analyse_bag` and return its exit code."""
    return run_program(parser(prog), _run, arguments)


def _run(chosen: argparse.Namespace) -> int:
    plot = getattr(chosen, 'plot', None)
    # Imported once the flags are known to be right: they take a second.
    from disc_sim_ros.analysis import bag_analysis, flights, recording  # noqa: PLC0415
    from disc_sim_ros.bags.reader import open_bag  # noqa: PLC0415

    try:
        bag = open_bag(chosen.bag)
        discs = recording.discs(bag, getattr(chosen, 'topic', None))
    except DamageError:
        raise  # a program that failed, not bad input
    except BagError as error:
        output.note(chosen.prog, f'error: {error}')
        return BAD_INPUT
    discs = _chosen_discs(discs, getattr(chosen, 'disc', None))
    doubts = bag_analysis.doubts_of(bag)
    if not bag.complete:
        text = 'was not closed or is damaged; `repair_bag` makes a complete copy'
        output.note(chosen.prog, f'note: {chosen.bag} {text}')
    analysed = [
        (disc, [bag_analysis.analyse(f, doubts) for f in flights.flights(disc)]) for disc in discs
    ]
    every = [a for _, analyses in analysed for a in analyses]
    if plot is not None:
        _plot(plot, chosen, every)
    if chosen.json:
        document = _bag_document(bag) | {
            'discs': [_disc_document(disc, analyses, chosen) for disc, analyses in analysed]
        }
        output.show(json.dumps(_finite(document), allow_nan=False))
    else:
        lines = _bag_lines(bag)
        for disc, analyses in analysed:
            lines += _disc_lines(disc, analyses, chosen)
        if plot is not None:
            lines.append(f'wrote {plot}')
        output.show('\n'.join(lines))
    if pages.is_wanted(chosen):  # after the numbers: they come even if the disk is full
        line = _write_page(chosen, every)
        if chosen.json:
            output.note(chosen.prog, line)
        else:
            output.show(line)
    return _verified(chosen.prog, discs, every) if chosen.verify else 0


def _verified(prog: str, discs: 'Sequence[Disc]', analyses: 'Sequence[Analysis]') -> int:
    """Return the exit code of --verify."""
    from disc_sim_ros.analysis.flights import unseen_throws  # noqa: PLC0415

    if not analyses:
        output.note(prog, 'note: there is no flight to verify')
    complete = analyses and not any(unseen_throws(disc) for disc in discs)
    return 0 if complete and all(a.passed for a in analyses) else DIFFERENT


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


def _plot(name: str, chosen: argparse.Namespace, analyses: 'Sequence[Analysis]') -> None:
    if not analyses:
        raise DiscSimError(f'{chosen.bag}: there is no flight to plot')
    from disc_sim_ros.analysis import bag_report, plots  # noqa: PLC0415 - matplotlib

    system = SYSTEMS[chosen.units]
    one = len(analyses) == 1
    title = bag_report.title(analyses[0], system) if one else Path(chosen.bag).name
    output.write_plot(name, plots.bag_figure(analyses, title, system))


def _write_page(chosen: argparse.Namespace, analyses: 'Sequence[Analysis]') -> str:
    if not analyses:
        raise DiscSimError(f'{chosen.bag}: there is no flight to show')
    name = Path(chosen.bag).resolve().name
    system = SYSTEMS[chosen.units]
    return pages.write(chosen, [pages.recorded(a, system) for a in analyses], name, system)


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
    from disc_sim_ros.analysis import bag_report, flights  # noqa: PLC0415

    documents = []
    for a in analyses:
        document = bag_report.document(a)
        if chosen.verify:
            document['verification'] = bag_report.verification_document(a)
        documents.append(document)
    return {
        'disc': disc.name,
        'topic': disc.motion.topic,
        'frame': disc.motion.frame,
        'child_frame': disc.motion.child,
        'messages': len(disc.motion),
        'events': [
            {'name': e.name, 'stamp_ns': e.stamp, 'values': dict(e.values)} for e in disc.events
        ],
        'flights': documents,
        'unseen_throws_ns': [release.stamp for release in flights.unseen_throws(disc)],
    }


def _bag_lines(bag: 'Bag') -> list[str]:
    from disc_sim_ros.analysis.bag_analysis import losses  # noqa: PLC0415

    seconds = _seconds(bag)
    filled = [info for info in bag.topics if info.message_count]
    size = sum(file.stat().st_size for file in bag.files)
    lines = [
        f'{bag.path}: {seconds:.2f} s, {bag.message_count} messages of {len(filled)} topics, '
        f'{size / 1e6:.1f} MB'
    ]
    repeated = {name for name, n in Counter(info.name for info in filled).items() if n > 1}
    counts = [
        printable(
            f'{info.name}{f" ({info.type})" if info.name in repeated else ""} {info.message_count}'
        )
        for info in filled
    ]
    while counts:
        line = '  ' + counts.pop(0)
        while counts and len(line) + len(counts[0]) < 97:
            line += ', ' + counts.pop(0)
        lines.append(line)
    return lines + [printable(f'  {key}: {value}') for key, value in losses(bag.custom_data)]


def _disc_lines(
    disc: 'Disc', analyses: 'Sequence[Analysis]', chosen: argparse.Namespace
) -> list[str]:
    from disc_sim_ros.analysis import bag_report, flights  # noqa: PLC0415

    lines = [printable(f'{disc.name}: {disc.motion.topic}, {len(disc.motion)} messages')]
    if not analyses and not disc.releases:
        lines.append('  no flight: no throw was recorded, and the disc does not move')
    for a in analyses:
        lines.append(bag_report.summary(a, SYSTEMS[chosen.units]))
        if chosen.verify:
            lines.append(bag_report.verification_text(a))
    if unseen := flights.unseen_throws(disc):
        at = ', '.join(f'{bag_report.utc(release.stamp)} UTC' for release in unseen)
        count = f'{len(unseen)} throw{"s" * (len(unseen) > 1)}'
        lines.append(f'  MISSING: no message of the motion after {count} ({at})')
    return lines


def _finite(value: Any) -> Any:
    """Return a document with null instead of NaN and infinity, which JSON does not have."""
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


if __name__ == '__main__':
    sys.exit(main())
