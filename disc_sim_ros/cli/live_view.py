"""`live_view`: the executable of the node in `disc_sim_ros.ros.live.node`."""

from collections.abc import Sequence
import sys

from disc_sim_ros.cli.node_program import run_node

USAGE = """\
usage: {prog} [--ros-args [-p NAME:=VALUE]...]

Show the discs of the running simulators in a browser, until Ctrl-C. It prints the address of the
page, which has a button to throw.
  -p port:=8080          port of the page; 0: a free one
  -p address:=127.0.0.1  only this machine; 0.0.0.0: every network interface
  -p rate:=30.0          states per second
  -p units:=metric       or us
Parameters are in docs/view.md.
"""


def main(arguments: Sequence[str] | None = None, prog: str = 'live_view') -> int:
    """Run the node and return its exit code."""
    return run_node(USAGE, _start, arguments, prog)


def _start(words: list[str]) -> int:
    from disc_sim_ros.ros.live import node  # noqa: PLC0415 - takes a second

    return node.main(words)


if __name__ == '__main__':
    sys.exit(main())
