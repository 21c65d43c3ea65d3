"""`recorder_node`: the executable of the node in `disc_sim_ros.ros.recorder.node`."""

from collections.abc import Sequence
import sys

from disc_sim_ros.cli.node_program import run_node

USAGE = """\
usage: {prog} [--ros-args [-p NAME:=VALUE]... [--params-file FILE] [-r __ns:=NAMESPACE]...]

Record every topic until Ctrl-C into an MCAP bag that `ros2 bag`, Foxglove and analyse_bag read.
  -p bag:=my_flight                        the folder to make (bags/disc_DATE_TIME)
  -p topics:="['/odom', '/configuration']" only these topics
  -p exclude:='/rosout|/parameter_events'  all topics except these
  -p max_size_mib:=512                     start a new file of the bag after 512 MiB
Services: ~/pause, ~/resume, ~/split, ~/flush. Parameters are in docs/recorder.md.
"""


def main(arguments: Sequence[str] | None = None, prog: str = 'recorder_node') -> int:
    """Run the node and return its exit code."""
    return run_node(USAGE, _start, arguments, prog)


def _start(words: list[str]) -> int:
    from disc_sim_ros.ros.recorder import node  # noqa: PLC0415 - takes a second

    return node.main(words)


if __name__ == '__main__':
    sys.exit(main())
