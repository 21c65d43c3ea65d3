"""`repair_bag`: makes the bag of a killed recorder complete again, without ROS."""

import argparse
from collections.abc import Sequence
import json
from pathlib import Path
import sys

from disc_sim_ros import __version__, files
from disc_sim_ros.cli import output
from disc_sim_ros.cli.arguments import Parser, path
from disc_sim_ros.cli.main import run_program


def parser(prog: str = 'repair_bag') -> Parser:
    """Return the command line of `repair_bag`."""
    p = Parser(
        prog=prog,
        description='Copy every complete message of a bag into a new bag with index and '
        'metadata.yaml: of a recorder that was killed or whose disk was full, of a bag with lost '
        'or compressed files, or of one that `ros2 bag play` refuses. Damaged and missing parts '
        'are skipped and reported by their position in the file, in bytes, with the number of '
        'messages where it is known. Log and publish times (ns), definitions, QoS, attachments '
        'and custom_data do not change; a file in which nothing is wrong is copied byte for byte. '
        'IN is only read.',
        epilog='Exit code 0: OUT is a complete bag, even if messages of IN were lost; 1: OUT '
        'could not be made, or nothing of IN can be kept; 2: bad input.',
    )
    p.set_defaults(prog=prog, outputs={'target': _check_target})
    p.add_argument('--version', action='version', version=f'%(prog)s {__version__}')
    p.add_argument(
        'source', type=path, metavar='IN', help='folder of a bag, or an .mcap or .mcap.zstd file'
    )
    p.add_argument('target', type=path, metavar='OUT', help='folder to make; it must not exist')
    p.add_argument(
        '--json', action='store_true', help='print one JSON document instead of the summary'
    )
    return p


def main(arguments: Sequence[str] | None = None, prog: str = 'repair_bag') -> int:
    """Run `repair_bag` and return its exit code: 0, 1 for a failed repair, 2 for bad input."""
    return run_program(parser(prog), _run, arguments)


def _check_target(name: str) -> None:
    files.check_new_folder('OUT', Path(name))


def _run(chosen: argparse.Namespace) -> int:
    from disc_sim_ros.bags.repair import repair  # noqa: PLC0415 - not for --help

    report = repair(
        Path(chosen.source), Path(chosen.target), lambda text: output.note(chosen.prog, text)
    )
    if chosen.json:
        output.show(json.dumps(report.document(), allow_nan=False))
    else:
        output.show(report.summary())
    return 0


if __name__ == '__main__':
    sys.exit(main())
