"""`sim_node`: the executable of the node in `disc_sim_ros.ros.sim.node`."""

from collections.abc import Sequence
import sys

from disc_sim_ros.cli.node_program import run_node

USAGE = """\
usage: {prog} [--ros-args [-p NAME:=VALUE]... [--params-file FILE] [-r FROM:=TO]...]

Simulate the flight of a disc in real time on ROS 2. The disc is thrown at the start;
with -p auto_throw:=false the node waits for a call of ~/throw.
  -p launch.speed:=20.0 -p disc:=wraith    another throw, another disc
  -r __ns:=/red -p frame_prefix:=red/      a second disc, in a namespace of its own
  --params-file sim.yaml                   all parameters; config/sim.yaml explains each
Topics and services are in docs/topics.md, parameters in docs/parameters.md.
"""


def main(arguments: Sequence[str] | None = None, prog: str = 'sim_node') -> int:
    """Run the node and return its exit code."""
    return run_node(USAGE, _start, arguments, prog)


def _start(words: list[str]) -> int:
    from disc_sim_ros.ros.sim import node  # noqa: PLC0415 - takes a second

    return node.main(words)


if __name__ == '__main__':
    sys.exit(main())
