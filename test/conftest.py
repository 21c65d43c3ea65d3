"""For all tests: ROS messages check their fields, and nodes are tested one after the other."""

import os

import pytest

os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'  # read when a message is first imported

IN_REAL_TIME, MAKES_WAY = 0, 10  # niceness


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep what runs in real time on one of several workers: it shares two cores as it is."""
    for item in items:
        if item.get_closest_marker('ros'):
            item.add_marker(pytest.mark.xdist_group('ros'))


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Let what does not run in real time make way, where this can be taken back: for root."""
    if 'PYTEST_XDIST_WORKER' in os.environ and os.geteuid() == 0:
        nice = IN_REAL_TIME if item.get_closest_marker('ros') else MAKES_WAY
        os.setpriority(os.PRIO_PROCESS, 0, nice)
