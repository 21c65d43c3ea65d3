"""Simulators in processes of their own, and a node in the test's process that talks to them."""

from collections.abc import Callable, Mapping
from itertools import islice
from pathlib import Path
import signal
import subprocess
import time
from typing import Any

import pytest
from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from disc_sim_ros.ros.internals import PolledSubscription
from forked import start

DEADLINE = 60.0  # s of wall time for what takes less than one on an idle machine
POLL = 0.005  # s; the executor would wake for each message, which takes three times the CPU
ALL_QOS = QoSProfile(depth=100_000)  # reliable: a slow test loses nothing


class SimProcess:
    """A `sim_node` in a process of its own.

    Attributes:
        name: Its node name with namespace, such as '/red/sim_node'.
        process: The process.
    """

    def __init__(
        self,
        parameters: Mapping[str, object],
        arguments: tuple[str, ...],
        name: str,
        stderr: Path,
        before: str = '',
    ) -> None:
        """Start it; `before` is Python code that its process runs first."""
        words = ['--ros-args']
        for key, value in parameters.items():
            words += ['-p', f'{key}:={str(value).lower() if isinstance(value, bool) else value}']
        self.name = name
        self._stderr = stderr
        self.process = start('disc_sim_ros.ros.sim', [*words, *arguments], stderr, before)

    @property
    def stderr(self) -> str:
        """Return what it has written so far, to stdout as well."""
        return self._stderr.read_text()

    def wait(self) -> int:
        """Wait for the end and return the exit code."""
        try:
            return self.process.wait(DEADLINE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            pytest.fail(f'{self.name} did not end within {DEADLINE:g} s:\n{self.stderr}')

    def end(self, number: signal.Signals = signal.SIGINT) -> int:
        """Send a signal, wait for the end and return the exit code."""
        self.process.send_signal(number)
        return self.wait()


class Harness:
    """A node in the test's process, and the simulators that it has started.

    At the end of its `with` block the simulators that still run get SIGINT and must end with 0.

    Attributes:
        node: The node, to create publishers and clients with.
        sims: The simulators.
    """

    def __init__(self, context: Context, folder: Path) -> None:
        self.node = Node('harness', context=context, start_parameter_services=False)
        self.sims: list[SimProcess] = []
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self._folder = folder
        self._clients: dict[str, Client] = {}
        self._parameters: dict[SimProcess, AsyncParameterClient] = {}
        self._reached: set[str] = set()  # names of simulators that have matched all endpoints
        self._subscriptions: list[tuple[PolledSubscription, list[Any]]] = []
        self._since = 0

    def __enter__(self) -> 'Harness':
        return self

    def __exit__(self, error: object, *_: object) -> None:
        running = [sim for sim in self.sims if sim.process.poll() is None]
        for sim in running:
            sim.process.send_signal(signal.SIGINT)
        codes = {sim.name: sim.wait() for sim in running}
        self._executor.shutdown()
        self.node.destroy_node()
        if error is None:
            assert not any(codes.values()), f'{codes}\n{self._outputs()}'

    def start(
        self,
        parameters: Mapping[str, object],
        *arguments: str,
        namespace: str = '',
        before: str = '',
    ) -> SimProcess:
        """Start a simulator with parameters and more ROS arguments; do not wait for it."""
        if namespace:
            arguments += ('-r', f'__ns:={namespace}')
        stderr = self._folder / f'sim_{len(self.sims)}.txt'
        sim = SimProcess(parameters, arguments, f'{namespace}/sim_node', stderr, before)
        self.sims.append(sim)
        self._client(sim, 'pause', SetBool)
        for service in ('throw', 'reset', 'step'):
            self._client(sim, service, Trigger)
        self._parameters[sim] = AsyncParameterClient(self.node, sim.name)
        return sim

    def spin_until(
        self, condition: Callable[[], Any], what: str = '', deadline: float = DEADLINE
    ) -> None:
        """Take messages until a condition holds; fail after `deadline` [s] of wall time."""
        end = time.monotonic() + deadline
        while not condition():
            if time.monotonic() > end:
                pytest.fail(f'not within {deadline:g} s: {what or condition}\n{self._outputs()}')
            self._executor.spin_once(POLL)
            self._take()

    def _take(self) -> None:
        """Take the messages that have arrived, at most 1000 of a topic."""
        for subscription, received in self._subscriptions:
            for message, info in islice(iter(subscription.take, None), 1000):
                if info['source_timestamp'] > self._since:
                    received.append(message)

    def subscribe(
        self, message_type: type, topic: str, *, raw: bool = False, qos: QoSProfile = ALL_QOS
    ) -> list[Any]:
        """Return a list to which every message of a topic will be added, as bytes where `raw`."""
        received: list[Any] = []
        subscription = PolledSubscription(self.node, message_type, topic, qos, raw=raw)
        self._subscriptions.append((subscription, received))
        self._reached.clear()
        return received

    def forget(self) -> None:
        """Discard all messages published until now, also those on their way."""
        self._since = time.time_ns()
        for _, received in self._subscriptions:
            received.clear()

    def publisher(self, message_type: type, topic: str) -> Publisher:
        """Return a publisher that a simulator has subscribed to."""
        publisher = self.node.create_publisher(message_type, topic, 1000)
        self._reached.clear()
        self.spin_until(publisher.get_subscription_count, f'a subscriber of {topic}')
        return publisher

    def send(self, sim: SimProcess, publisher: Publisher, *messages: Any) -> None:
        """Publish messages to a simulator and wait until they have arrived."""
        self._reach(sim)
        self.spin_until(publisher.get_subscription_count, f'a subscriber of {publisher.topic}')
        for message in messages:
            publisher.publish(message)
        # A later request arrives later. To wait until DDS acknowledges takes 3 s.
        self._result(sim, self._parameters[sim].get_parameters(['use_sim_time']))

    def call(
        self, sim: SimProcess, service: str, service_type: type = Trigger, **fields: Any
    ) -> Any:
        """Call a service of a simulator, such as 'throw', and return the response."""
        client = self._client(sim, service, service_type)
        self._reach(sim)
        self.spin_until(client.service_is_ready, f'the service {client.srv_name}')
        return self._result(sim, client.call_async(service_type.Request(**fields)))

    def pause(self, sim: SimProcess) -> None:
        """Pause a simulator."""
        assert self.call(sim, 'pause', SetBool, data=True).success

    def resume(self, sim: SimProcess) -> None:
        """Let the time of a paused simulator go on."""
        assert self.call(sim, 'pause', SetBool, data=False).success

    def set(self, sim: SimProcess, parameters: Mapping[str, object]) -> Any:
        """Set parameters of a simulator together; return rcl_interfaces/SetParametersResult."""
        client = self._parameters[sim]
        self._reach(sim)
        self.spin_until(client.services_are_ready, f'the parameters of {sim.name}')
        changes = [Parameter(key, value=x).to_parameter_msg() for key, x in parameters.items()]
        return self._result(sim, client.set_parameters_atomically(changes)).result

    def _client(self, sim: SimProcess, service: str, service_type: type) -> Client:
        name = f'{sim.name}/{service}'
        if name not in self._clients:
            self._clients[name] = self.node.create_client(service_type, name)
            self._reached.discard(sim.name)
        return self._clients[name]

    def _reach(self, sim: SimProcess) -> None:
        """Wait until a simulator has matched all endpoints that were created here so far.

        Before that it publishes nothing to a subscription and drops its responses to a client.
        Discovery keeps the order: once it answers the youngest client, the older endpoints are
        matched.
        """
        if sim.name in self._reached:
            return
        client = self.node.create_client(GetParameters, f'{sim.name}/get_parameters')
        futures: list[Future] = []

        def answered() -> bool:
            return any(future.done() for future in futures)

        def call_until_answered() -> bool:
            futures.append(client.call_async(GetParameters.Request()))
            patience = time.monotonic() + 0.2
            while not answered() and time.monotonic() < patience:
                self._executor.spin_once(0.02)
            return answered()

        self.spin_until(client.service_is_ready, f'the service {client.srv_name}')
        self.spin_until(call_until_answered, f'an answer of {sim.name}')
        self.node.destroy_client(client)
        self._reached.add(sim.name)

    def _result(self, sim: SimProcess, future: Future) -> Any:
        self.spin_until(future.done, f'an answer of {sim.name}')
        return future.result()

    def _outputs(self) -> str:
        return '\n'.join(
            f'{sim.name} (code {sim.process.poll()}): {sim.stderr}' for sim in self.sims
        )
