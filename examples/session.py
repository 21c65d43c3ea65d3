"""Shared by the recorded examples: a simulator and a recorder, one throw, a bag and a plot."""

import argparse
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from datetime import datetime
import math
from pathlib import Path
import subprocess
import sys
import tempfile
import time

from diagnostic_msgs.msg import DiagnosticStatus
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from disc_sim_ros import topics
from disc_sim_ros.cli.arguments import number
from disc_sim_ros.ros import client, processes, qos

PATIENCE = 30.0  # s, for the discovery of the simulator and for its answer
ENDS = ('landed', 'failed', 'reset')


class Flier(Node):
    """Throws the disc through a service and returns the end of the flight."""

    def __init__(self, name: str, context: Context) -> None:
        super().__init__(name, context=context)
        self.ended: DiagnosticStatus | None = None
        self._spinner = SingleThreadedExecutor(context=context)
        self._spinner.add_node(self)
        self.create_subscription(
            DiagnosticStatus, topics.FLIGHT_EVENTS, self._on_event, qos.STATE_QOS
        )
        self._service = self.create_client(Trigger, 'sim_node/throw')

    def is_ready(self) -> bool:
        """Return True if the simulator is discovered; subclasses add their own conditions."""
        publishers = self.count_publishers(topics.FLIGHT_EVENTS)
        return publishers > 0 and self._service.service_is_ready()

    def fly(self, longest: float = 60.0) -> dict[str, str]:
        """Throw, spin until the end of the flight, and return the values of the landing.

        Args:
            longest: Longest time to wait for the end [s].

        Raises:
            RuntimeError: The simulator does not throw, or the flight does not end on the ground.
        """
        if not self.spin_until(self.is_ready, PATIENCE):
            raise RuntimeError('there is no simulator')
        thrown = self._service.call_async(Trigger.Request())
        if not self.spin_until(thrown.done, PATIENCE) or not thrown.result().success:
            raise RuntimeError('the simulator did not throw')
        self.spin_until(lambda: self.ended, longest)
        if self.ended is None or not self.ended.name.endswith(': landed'):
            why = self.ended.message if self.ended else f'it was in the air after {longest:g} s'
            raise RuntimeError(f'the flight did not end on the ground: {why}')
        return {pair.key: pair.value for pair in self.ended.values}

    def spin_until(self, condition: Callable[[], object], patience: float = math.inf) -> bool:
        """Take messages until a condition holds; return False after `patience` [s]."""
        end = time.monotonic() + patience
        while not condition() and time.monotonic() < end:
            self._spinner.spin_once(0.1)
        return bool(condition())

    def _on_event(self, event: DiagnosticStatus) -> None:
        if event.name.rpartition(': ')[2] in ENDS:
            self.ended = event


@contextmanager
def recorded(parameters: Mapping[str, object], bag: Path, pace: float) -> Iterator[Context]:
    """Start sim_node and recorder_node in a ROS domain of their own; yield a context for nodes.

    Args:
        parameters: Parameters of sim_node.
        bag: New folder for the recording.
        pace: Simulated seconds a second.

    Raises:
        DiscSimError: One of them fails.
    """
    with ExitStack() as stack:
        domain = stack.enter_context(processes.own_domain())
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix='example_')))
        waiting = {'auto_throw': False, 'real_time_factor': pace, **parameters}
        sim = stack.enter_context(processes.started('sim_node', waiting, folder))
        to = {'bag': str(bag.absolute()), 'start_paused': True}
        recorder = stack.enter_context(processes.started('recorder_node', to, folder))
        watcher = client.Watcher(domain, (sim, recorder))
        try:
            watcher.wait_until_recorded(bag)
        finally:
            watcher.close()
        context = Context()
        rclpy.init(
            context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO
        )
        stack.callback(context.try_shutdown)
        yield context
        recorder.end()
        sim.end()


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the folder for bag and plot, and the pace of the simulated time."""
    parser.add_argument(
        '--pace',
        type=number(0.01, 10.0, ''),
        default=1.0,
        metavar='X',
        help='simulated seconds a second; from 0.01 to 10',
    )
    parser.add_argument(
        '--folder',
        type=Path,
        metavar='DIR',
        help='new folder for bag and plot (default flights/NAME_DATE_TIME)',
    )


def folder_of(options: argparse.Namespace, name: str) -> Path:
    """Return the folder for bag and plot."""
    chosen: Path | None = options.folder
    return chosen or Path('flights', f'{name}_{datetime.now().astimezone():%Y-%m-%d_%H-%M-%S}')


def show(folder: Path) -> None:
    """Print the contents of the bag, and plot the flight."""
    analyse_bag = [sys.executable, '-m', 'disc_sim_ros.cli.analyse_bag']
    image = folder / 'flight.png'
    subprocess.run(  # noqa: S603 - a program of this package
        [*analyse_bag, str(folder / 'bag'), '--verify', '--plot', str(image)], check=True
    )
