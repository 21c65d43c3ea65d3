"""For all tests: ROS messages check their fields, and nodes are tested one after the other."""

import os

import pytest

os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'  # read when a message is first imported


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep what runs in real time on one of several workers: it shares two cores as it is."""
    for item in items:
        if item.get_closest_marker('ros'):
            item.add_marker(pytest.mark.xdist_group('ros'))
