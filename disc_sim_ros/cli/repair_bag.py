"""`repair_bag`: makes the bag of a killed recorder whole, without ROS."""

import argparse
import json
from pathlib import Path
import signal
import sys

from disc_sim_ros import __version__
from disc_sim_ros.cli import output
from disc_sim_ros.cli.arguments import Parser
from disc_sim_ros.errors import ConfigError, DiscSimError


def parser() -> Parser:
    """Return the command line of `repair_bag`."""
    p = Parser(
        prog='repair_bag',
        description='Write every complete message of a bag into a new bag with index and '
        'metadata.yaml. Made for bags whose recorder was killed or whose disk was full; damaged '
        'places are skipped and reported, as bytes from the beginning of their file. Log and '
        'publish times (ns), definitions, QoS, attachments and custom_data stay as they are. IN '
        'is only read.',
        epilog='Exit code 0: OUT is a whole bag, whatever was lost on the way; 1: it could not be '
        'made; 2: bad input.',
    )
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    p.add_argument('source', metavar='IN', help='folder of a bag, or an .mcap file')
    p.add_argument('target', metavar='OUT', help='folder to make; it must not exist')
    p.add_argument('--json', action='store_true', help='print one JSON document instead')
    return p


def main(arguments: list[str] | None = None) -> int:
    """Run `repair_bag`; return its exit code: 0, 1 for a failed repair, 2 for bad input."""
    output.mend_streams()
    p = parser()
    chosen = p.parse_args(arguments)
    try:
        _run(chosen)
    except ConfigError as error:
        p.error(str(error))
    except DiscSimError as error:
        sys.stderr.write(f'repair_bag: error: {error}\n')
        return 1
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    return 0


def _run(chosen: argparse.Namespace) -> None:
    from disc_sim_ros.bags.repair import RepairReport, repair  # noqa: PLC0415 - not for --help

    def note(text: str) -> None:
        sys.stderr.write(f'repair_bag: {text}\n')

    report: RepairReport = repair(Path(chosen.source), Path(chosen.target), note)
    if chosen.json:
        output.show(json.dumps(report.document(), allow_nan=False))
    else:
        output.show(report.summary())
