"""Fixtures of the ROS tests: each test has a private context, in a domain of its own."""

from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import pytest

from disc_sim_ros.ros.processes import reserved_domain


@pytest.fixture
def ros_environment(monkeypatch, tmp_path) -> Iterator[int]:
    """A ROS domain of the test's own in the environment, for its processes too; gives its id."""
    with reserved_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path / 'ros_log'))
        profiles = Path(__file__).with_name('fast_dds.xml')
        # Fast DDS 3, from Kilted on, warns of the old name.
        name = 'FASTDDS' if int(version('rclpy').split('.')[0]) > 7 else 'FASTRTPS'
        monkeypatch.setenv(f'{name}_DEFAULT_PROFILES_FILE', str(profiles))
        yield domain


@pytest.fixture
def ros_context(ros_environment):
    """A private rclpy context, shut down afterwards with everything in it."""
    rclpy = pytest.importorskip('rclpy')
    context = rclpy.Context()
    context.init(args=[])
    yield context
    context.try_shutdown()


@pytest.fixture
def ros(ros_context, tmp_path):
    """A node that starts simulators and communicates with them, see `sim_process.Harness`."""
    from ros.sim_process import Harness

    with Harness(ros_context, tmp_path) as harness:
        yield harness
