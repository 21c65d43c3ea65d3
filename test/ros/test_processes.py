"""ROS domains of their own for programs that start nodes, and what becomes of failed nodes."""

import os
import time

import pytest

from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.ros import processes
from disc_sim_ros.ros.processes import own_domain, started


def test_own_domains_differ_and_stay_on_this_machine(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '0')
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')
    with own_domain() as first, own_domain() as second:
        assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
        assert os.environ['ROS_DOMAIN_ID'] == str(second)
        assert 0 < first != second > 0


@pytest.mark.parametrize('before', [{}, {'ROS_DOMAIN_ID': '7'}])
def test_the_environment_is_afterwards_as_before(monkeypatch, before):
    for name in ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE'):
        monkeypatch.delenv(name, raising=False)
    for name, value in before.items():
        monkeypatch.setenv(name, value)
    unchanged = dict(os.environ)
    with own_domain():
        assert dict(os.environ) != unchanged
    assert dict(os.environ) == unchanged

    def fail():
        with own_domain():
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert dict(os.environ) == unchanged


def test_no_free_domain_is_an_error(monkeypatch):
    with own_domain() as domain:
        monkeypatch.setattr(processes, 'DOMAINS', range(domain, domain + 1))
        with pytest.raises(DiscSimError, match='no free ROS domain'), own_domain():
            pass


def wait_for_end(process):
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        process.check()
        time.sleep(0.05)


def test_a_node_that_fails_is_reported_with_its_last_line(tmp_path):
    pytest.importorskip('rclpy')
    parameters = {'launch.sped': 3.0}
    with (
        own_domain(),
        started('sim_node', parameters, tmp_path) as process,
        pytest.raises(DiscSimError, match=r'sim_node ended with code 2: .*launch\.speed'),
    ):
        wait_for_end(process)
