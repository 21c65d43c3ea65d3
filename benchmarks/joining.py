"""How long the thread of a simulator stalls when a subscriber joins, by transport of Fast DDS.

A node publishes `odom` and `pose` at 1 kHz, and a subscriber in another process starts with it, as
in a launch file; again and again, each time with new processes. Printed is the greatest lateness
of a step up to some seconds after the first message. The C++ program is benchmarks/rcl_loop.cpp.

usage: benchmarks/joining.py [joins of each, 12]; some 6 s for each
"""

import os
import shutil
import signal
import sys
import time

from disc_sim_ros.ros import processes
from node_processes import Watch, role, simulator, wait_for_line

LONG = 0.1  # s
TRANSPORTS = 'FASTDDS_BUILTIN_TRANSPORTS'


def main() -> None:
    """Print a line for each kind of node and transport."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    kinds = ['sim_node', *(['C++'] if shutil.which('g++') else [])]
    with processes.own_domain():
        for transports in ('', 'UDPv4'):
            os.environ.pop(TRANSPORTS, None)
            if transports:
                os.environ[TRANSPORTS] = transports
            for kind in kinds:
                worst = sorted(joined(kind) for _ in range(count))
                print(
                    f'{kind}, {transports or "transports by default"}: '
                    f'{sum(w > LONG for w in worst)} of {count} above {LONG:g} s; greatest '
                    f'lateness {", ".join(f"{1e3 * w:.0f}" for w in worst)} ms',
                    flush=True,
                )


def joined(kind: str) -> float:
    """Return the greatest lateness while a subscriber joins [s]."""
    with simulator(1000, 1000, kind) as node, role('subscribe', 'odom', 'pose') as subscriber:
        if kind == 'C++':
            wait_for_line(subscriber)
            time.sleep(2.0)
            node.send_signal(signal.SIGINT)
            return max(float(line) for line in node.communicate()[0].split())
        with Watch.running() as watch:
            watch.wait()
            wait_for_line(subscriber)
            watch.spin(3.0)
            return watch.worst


if __name__ == '__main__':
    main()
