"""`recorder_node`: the node of `disc_sim_ros.ros.recorder.node`."""

import os
import signal
import sys

USAGE = """\
usage: recorder_node [--ros-args [-p NAME:=VALUE]... [--params-file FILE] [-r __ns:=NAMESPACE]...]

Record every topic into an MCAP bag that `ros2 bag`, Foxglove and analyse_bag read, until Ctrl-C.
  -p bag:=my_flight                        the folder to make (bags/disc_DATE_TIME)
  -p topics:="['/odom', '/configuration']" these topics only
  -p exclude:='/rosout|/parameter_events'  all but these
  -p max_size_mib:=512                     a new file of the bag after 512 MiB
Services: ~/pause, ~/resume, ~/split, ~/flush. Parameters are in docs/recorder.md.
"""


def main() -> int:
    """Run the node; Ctrl-C and SIGTERM end it with code 0, also while Python still loads it."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(0))
    if {'-h', '--help'} & set(sys.argv[1:]):
        sys.stdout.write(USAGE)
        return 0
    from disc_sim_ros.ros.recorder import node  # noqa: PLC0415 - takes a second

    return node.main()
