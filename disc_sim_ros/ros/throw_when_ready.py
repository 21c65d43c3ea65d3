"""Throws the disc of a sim_node when a recorder or a predictor is ready, for launch files."""

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys

from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.ros.client import Watcher
from disc_sim_ros.ros.signals import exit_on_signal

PROGRAM = 'throw_when_ready'


def main(arguments: Sequence[str] | None = None) -> int:
    """Wait and throw; return the exit code: 0, or 1 if that takes too long."""
    exit_on_signal()  # nothing is open that would have to be closed
    p = argparse.ArgumentParser(prog=PROGRAM, description=__doc__)
    p.add_argument('--namespace', default='', help='namespace of both nodes')
    who = p.add_mutually_exclusive_group(required=True)
    who.add_argument('--bag', help='the folder that a recorder of all topics fills')
    who.add_argument('--predictor', action='store_true', help='a predictor_node follows odom')
    p.add_argument('--wait', type=float, default=0.0, help='wait so long in addition [s]')
    chosen = p.parse_args(arguments)
    try:
        watcher = Watcher(None, namespace=chosen.namespace)
        if chosen.predictor:
            watcher.wait_until_followed()
        else:
            watcher.wait_until_recorded(Path(chosen.bag), resume=False)
        watcher.pause(chosen.wait)
        watcher.throw()
    except DiscSimError as error:
        sys.stderr.write(f'{PROGRAM}: error: {error}\n')
        return 1
    watcher.close()
    return 0


if __name__ == '__main__':
    sys.exit(main())
