"""`policy_node`: the executable of the node in `disc_sim_ros.ros.policy.node`."""

from collections.abc import Sequence
import sys

from disc_sim_ros.cli.node_program import run_node

USAGE = """\
usage: {prog} [--ros-args [-p NAME:=VALUE]...]

Steer the disc of a sim_node to a target by a learned policy, which does not know the wind.
  -p target:="[24.0, 0.0]"  x and y of the point to land at, m in map
  -p policy:=steer.npz      weights of examples/train_steer.py; default: those of the package
  -p lockstep:=true         throw once: pause the simulator, and step it from action to action
The policy acts 20 times a second. docs/learning.md explains it.
"""


def main(arguments: Sequence[str] | None = None, prog: str = 'policy_node') -> int:
    """Run the node and return its exit code."""
    return run_node(USAGE, _start, arguments, prog)


def _start(words: list[str]) -> int:
    from disc_sim_ros.ros.policy import node  # noqa: PLC0415 - takes a second

    return node.main(words)


if __name__ == '__main__':
    sys.exit(main())
