"""A recorder in a process of its own, and topics of counted messages to record."""

from collections.abc import Mapping
from pathlib import Path
import signal
import struct
import subprocess
import time

import pytest
from rclpy.qos import QoSProfile
from std_msgs.msg import Int64

from disc_sim_ros.bags.reader import open_bag
from forked import start
from ros.sim_process import DEADLINE, Harness

RELIABLE = QoSProfile(depth=20_000)
COUNT = struct.Struct('<4xq')  # a serialised std_msgs/Int64


class Recorder:
    """A `recorder_node` in a process of its own, ended with the test.

    Attributes:
        bag: Its folder.
        process: The process.
    """

    def __init__(
        self, ros: Harness, bag: Path, parameters: Mapping[str, object], before: str = ''
    ) -> None:
        """Start it; `before` is Python code that its process runs first."""
        self.bag = bag
        self._ros = ros
        self._log = bag.with_name(f'{bag.name}.log')
        words = ['--ros-args']
        for name, value in {'bag': bag, **parameters}.items():
            text = str(value).lower() if isinstance(value, bool) else value
            words += ['-p', f'{name}:={text}']
        self.process = start(
            'disc_sim_ros.ros.recorder', words, self._log, before and f'import sys\n{before}'
        )

    @property
    def log(self) -> str:
        """Return its output so far."""
        return self._log.read_text()

    def wait_for_log(self, text: str) -> None:
        """Wait until its output has a text."""
        self._ros.spin_until(lambda: text in self.log, f'{text!r} in: {self.log}')

    def wait_for_topics(self, *names: str) -> None:
        """Wait until it has subscribed to topics."""
        self.wait_for_log('recording')
        for name in names:
            self._ros.spin_until(lambda n=name: n in self._recorded(), f'{name} recorded')

    def _recorded(self) -> set[str]:
        lines = [
            line for line in self.log.splitlines() if '] [recorder_node]: recording /' in line
        ]
        return {n for line in lines for n in line.split(': recording ')[1].split(', ')}

    def wait(self) -> int:
        try:
            return self.process.wait(DEADLINE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            pytest.fail(f'the recorder did not end within {DEADLINE:g} s:\n{self.log}')

    def end(self, number: signal.Signals = signal.SIGINT) -> int:
        self.process.send_signal(number)
        return self.wait()


class Counter:
    """Publishes 0, 1, 2, ... on a topic.

    Attributes:
        topic: Name of the topic.
        sent: When each message was published, by the monotonic clock [s].
    """

    def __init__(self, ros: Harness, topic: str, qos: QoSProfile = RELIABLE) -> None:
        self.topic = topic
        self.sent: list[float] = []
        self._publisher = ros.node.create_publisher(Int64, topic, qos)
        self._ros = ros

    def wait_for_subscriptions(self, count: int) -> None:
        """Wait until so many subscriptions are matched."""
        self._ros.spin_until(
            lambda: self._publisher.get_subscription_count() >= count,
            f'{count} subscriptions to {self.topic}',
        )

    def publish(self, count: int, rate: float = 2000.0) -> None:
        """Publish messages, at most `rate` a second."""
        start = time.monotonic()
        for n in range(count):
            time.sleep(max(start + n / rate - time.monotonic(), 0.0))
            self.publish_one()

    def publish_one(self) -> None:
        self._publisher.publish(Int64(data=len(self.sent)))
        self.sent.append(time.monotonic())


def counts(bag: Path, topic: str) -> list[int]:
    """Return the counted messages of a topic in a bag, in their order there."""
    return [COUNT.unpack(message.data)[0] for message in open_bag(bag).raw([topic])]
