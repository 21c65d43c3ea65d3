"""A node that records the events of every throw and the passing of time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
import math
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from stamps import Stamps
from std_srvs.srv import Trigger

from disc_sim_ros import topics

Values = dict[str, str]  # of an event or of diagnostics

EVENTS = QoSProfile(depth=100_000)
PATIENCE = 20.0  # s
MATCHING = 1.0  # s, for a service to match its client


@dataclass(frozen=True, slots=True)
class Second:
    """One second: diagnostics of sim_node and the delay of odom.

    Attributes:
        time: By the monotonic clock [s].
        offset: Smallest delay of simulated time behind that clock [s].
        slipped: Reported slips so far [s].
        slips: Number of slips so far.
        worst: Greatest lateness in this second [s].
        missed: Missed deadlines so far.
        throws: Throws so far.
        landings: Landings so far.
    """

    time: float
    offset: float
    slipped: float
    slips: int
    worst: float
    missed: int
    throws: int
    landings: int


class Watcher:
    """Subscribes to events, diagnostics and odom.

    Attributes:
        events: (name, values) of each event, in order; a name has the namespace in front.
        diagnostics: The newest values of the diagnostics of each node.
        seconds: One for each diagnostics of a simulator whose odom arrived meanwhile.
        stamps: The stamps of odom, where a rate was given.
    """

    def __init__(
        self, domain: int, *, rate: float = 0.0, namespaces: Sequence[str] = ('',)
    ) -> None:
        """Join the domain; `rate` is that of odom."""
        self.events: list[tuple[str, Values]] = []
        self.diagnostics: dict[str, Values] = {}
        self.seconds: list[Second] = []
        self.stamps = Stamps(rate or 1.0)
        self._offset = math.inf
        self._context = Context()
        rclpy.init(
            context=self._context,
            domain_id=domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        self._node = Node('soak', context=self._context, start_parameter_services=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        subscribe = self._node.create_subscription
        for space in namespaces:
            name = f'{space}/{topics.FLIGHT_EVENTS}'
            subscribe(DiagnosticStatus, name, partial(self._on_event, space), EVENTS)
        subscribe(DiagnosticArray, '/diagnostics', self._on_diagnostics, EVENTS)
        if rate:
            subscribe(Odometry, topics.ODOM, self._on_odometry, EVENTS, raw=True)

    def close(self) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def spin(self, seconds: float) -> None:
        """Take messages for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(0.05)

    def spin_until(self, condition: Callable[[], object], patience: float, what: str) -> None:
        """Take messages until a condition holds.

        Raises:
            TimeoutError: It does not within `patience` [s].
        """
        end = time.monotonic() + patience
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(f'timed out after {patience:g} s waiting for {what}')
            self._executor.spin_once(0.05)

    def call(self, service: str) -> None:
        """Call a service without arguments.

        Raises:
            TimeoutError: The service does not answer.
        """
        client = self._node.create_client(Trigger, service)
        self.spin_until(client.service_is_ready, PATIENCE, service)
        self.spin(MATCHING)
        future = client.call_async(Trigger.Request())
        self.spin_until(future.done, PATIENCE, f'an answer of {service}')

    def named(self, name: str) -> list[Values]:
        """Return the values of the events of a name."""
        return [values for event, values in self.events if event == name]

    def _on_event(self, space: str, message: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in message.values}
        self.events.append((space + message.name.rpartition(': ')[2], values))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            self.diagnostics[status.name.partition(':')[0]] = values
            if status.name.endswith(': simulation') and math.isfinite(self._offset):
                self._on_second(values)

    def _on_second(self, values: Values) -> None:
        self.seconds.append(
            Second(
                time=time.monotonic(),
                offset=self._offset,
                slipped=float(values['slipped_s']),
                slips=int(values['slips']),
                worst=float(values['worst_lateness_s']),
                missed=int(values['missed_deadlines']),
                throws=int(values['throws']),
                landings=int(values['landings']),
            )
        )
        self._offset = math.inf

    def _on_odometry(self, data: bytes, info: dict[str, Any]) -> None:
        self.stamps.take(data, info)
        self._offset = min(self._offset, time.monotonic() - self.stamps.newest * 1e-9)
