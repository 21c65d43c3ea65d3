"""A node that hears what becomes of every throw, and how time passes."""

from collections.abc import Callable, Sequence
from functools import partial
import math
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from disc_sim_ros.nodes import topics

EVENTS = QoSProfile(depth=100_000)
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
COMMAND_RATE = 50.0  # Hz
PATIENCE = 20.0  # s
TO_BE_FOUND = 1.0  # s, for a service to know its client
SWAY = (0.004, 0.003)  # C_L, C_M at most


class Watcher:
    """Hears events, diagnostics and odom; steers where asked to.

    Attributes:
        events: (name, values) of each event, in order; a name has the namespace in front.
        told: The newest values of the diagnostics of each node.
        offsets: (monotonic time, that minus the stamp of odom) [s], of what came.
    """

    def __init__(
        self, domain: int, *, steer: bool = False, namespaces: Sequence[str] = ('',)
    ) -> None:
        """Join the domain."""
        self.events: list[tuple[str, dict[str, str]]] = []
        self.told: dict[str, dict[str, str]] = {}
        self.offsets: list[tuple[float, float]] = []
        self._domain = domain
        self._context = context(domain)
        self._node = Node('soak', context=self._context, start_parameter_services=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        listen = self._node.create_subscription
        for space in namespaces:
            name = f'{space}/{topics.FLIGHT_EVENTS}'
            listen(DiagnosticStatus, name, partial(self._on_event, space), EVENTS)
        listen(DiagnosticArray, '/diagnostics', self._on_diagnostics, EVENTS)
        listen(Odometry, topics.ODOM, self._on_odometry, NEWEST)
        if steer:
            self._command = self._node.create_publisher(
                Vector3Stamped, topics.CMD_COEFFICIENTS, topics.COMMAND_QOS
            )
            self._node.create_timer(1.0 / COMMAND_RATE, self._steer)

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
            TimeoutError: It does not in time [s].
        """
        end = time.monotonic() + patience
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(f'waited {patience:g} s in vain for {what}')
            self._executor.spin_once(0.05)

    def call(self, service: str) -> None:
        """Call a service without arguments.

        Raises:
            TimeoutError: Nobody answers.
        """
        client = self._node.create_client(Trigger, service)
        self.spin_until(client.service_is_ready, PATIENCE, service)
        self.spin(TO_BE_FOUND)
        answer = client.call_async(Trigger.Request())
        self.spin_until(answer.done, PATIENCE, f'an answer of {service}')

    def greet(self) -> None:
        """Let another participant come, listen, and go."""
        other = context(self._domain)
        node = Node('guest', context=other)
        node.create_subscription(Odometry, topics.ODOM, lambda _: None, topics.STATE_QOS)
        executor = SingleThreadedExecutor(context=other)
        executor.add_node(node)
        executor.spin_once(0.2)
        executor.shutdown()
        node.destroy_node()
        other.try_shutdown()

    def named(self, name: str) -> list[dict[str, str]]:
        """Return the values of the events of a name."""
        return [values for event, values in self.events if event == name]

    def _steer(self) -> None:
        message, now = Vector3Stamped(), time.monotonic()
        message.vector.x = SWAY[0] * math.sin(now)
        message.vector.y = SWAY[1] * math.cos(0.7 * now)
        self._command.publish(message)

    def _on_event(self, space: str, message: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in message.values}
        self.events.append((space + message.name.rpartition(': ')[2], values))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            self.told[status.name.partition(':')[0]] = values

    def _on_odometry(self, message: Odometry) -> None:
        now, stamp = time.monotonic(), message.header.stamp
        self.offsets.append((now, now - stamp.sec - stamp.nanosec * 1e-9))


def context(domain: int) -> Context:
    """Return a participant of its own."""
    made = Context()
    rclpy.init(context=made, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    return made
