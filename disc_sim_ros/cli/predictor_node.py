"""`predictor_node`: the executable of the node in `disc_sim_ros.ros.predictor.node`."""

from collections.abc import Sequence
import sys

from disc_sim_ros.cli.node_program import run_node

USAGE = """\
usage: {prog} [--ros-args [-p NAME:=VALUE]... [--params-file FILE] [-r FROM:=TO]...]

Predict where a disc lands, from positions that are measured while it flies, until Ctrl-C.
  -p disc:=ultrastar -p position_sigma:=0.02   what flies, and how exactly it is measured
  -p sources:=odom -p added_noise:=0.02        follow sim_node, with noise
  -r measured_pose:=/mocap/disc/pose           the topic of a tracker
Topics and parameters are in docs/predictor.md.
"""


def main(arguments: Sequence[str] | None = None, prog: str = 'predictor_node') -> int:
    """Run the node and return its exit code."""
    return run_node(USAGE, _start, arguments, prog)


def _start(words: list[str]) -> int:
    from disc_sim_ros.ros.predictor import node  # noqa: PLC0415 - takes a second

    return node.main(words)


if __name__ == '__main__':
    sys.exit(main())
