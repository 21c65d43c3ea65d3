"""`sim_node`: the node of `disc_sim_ros.ros.sim.node`."""

import os
import signal
import sys

USAGE = """\
usage: sim_node [--ros-args [-p NAME:=VALUE]... [--params-file FILE] [-r FROM:=TO]...]

Fly the disc in real time on ROS 2, and throw it at once (-p auto_throw:=false waits for ~/throw).
  -p launch.speed:=20.0 -p disc:=wraith    another throw, another disc
  -r __ns:=/red -p frame_prefix:=red/      a disc of its own namespace
  --params-file sim.yaml                   all parameters; config/sim.yaml explains each
Topics and services are in docs/topics.md, parameters in docs/parameters.md.
"""


def main() -> int:
    """Run the node; Ctrl-C and SIGTERM end it with code 0, also while Python still loads it."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(0))
    if {'-h', '--help'} & set(sys.argv[1:]):
        sys.stdout.write(USAGE)
        return 0
    from disc_sim_ros.ros.sim import node  # noqa: PLC0415 - takes a second

    return node.main()
