"""What ROS tests share: a private context each, on a domain that nobody else uses."""

from collections.abc import Iterator
from contextlib import contextmanager
import fcntl
import os
from pathlib import Path
import socket
import tempfile

import pytest

DOMAINS = range(1, 102)  # above, the ports of Fast DDS are among those the system hands out


@contextmanager
def free_domain(locks: Path) -> Iterator[int]:
    """Yield a domain id that no other test, worker or running node has, and keep it taken."""
    first = os.getpid() % len(DOMAINS)
    for domain in [*DOMAINS[first:], *DOMAINS[:first]]:
        with (locks / f'disc_sim_ros_domain_{os.getuid()}_{domain}').open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            if has_participant(domain):
                continue
            yield domain
            return
    pytest.fail(f'no free ROS domain among {DOMAINS[0]} to {DOMAINS[-1]}')


def has_participant(domain: int) -> bool:
    """Say whether a DDS participant of this machine listens on the first port of a domain."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(('', 7400 + 250 * domain + 10))
        except OSError:
            return True
    return False


@pytest.fixture
def ros_environment(monkeypatch, tmp_path) -> Iterator[int]:
    """A domain of the test's own in the environment, for its processes too; gives its id."""
    with free_domain(Path(tempfile.gettempdir())) as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path / 'ros_log'))
        profiles = Path(__file__).with_name('fast_dds.xml')
        monkeypatch.setenv('FASTRTPS_DEFAULT_PROFILES_FILE', str(profiles))
        yield domain


@pytest.fixture
def ros_context(ros_environment):
    """A private rclpy context, shut down afterwards with what was made in it."""
    rclpy = pytest.importorskip('rclpy')
    context = rclpy.Context()
    context.init(args=[])
    yield context
    context.try_shutdown()


@pytest.fixture
def ros(ros_context, tmp_path):
    """A node that starts simulators and talks to them, see `sim_process.Harness`."""
    from ros.sim_process import Harness

    with Harness(ros_context, tmp_path) as harness:
        yield harness
