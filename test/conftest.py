"""For all tests: ROS messages check their fields, and nodes are tested one after the other."""

import os
import signal

import pytest

# A shell has what it starts in the background ignore Ctrl-C, and so would what the tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'  # read when a message is first imported

IN_REAL_TIME, MAKES_WAY = 0, 10  # niceness
FIRST = {  # half of those with nodes
    'sim/test_node_control', 'sim/test_node_input', 'sim/test_node_process', 'recorder/test_node',
    'ros/test_parameters', 'ros/test_parameters_of_a_node',
}  # fmt: skip


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist looks at the marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Deal out the tests of real nodes to two workers, and begin with them.

    They wait more than they work, but more than two at a time would share two cores badly. Next
    come the modules that a group keeps on one worker, for what they make once; then all the rest.
    """
    for item in items:
        if is_ros(item):
            half = 1 if f'{item.path.parent.name}/{item.path.stem}' in FIRST else 2
            item.add_marker(pytest.mark.xdist_group(f'ros {half}'))
    items.sort(key=lambda item: (not is_ros(item), not item.get_closest_marker('xdist_group')))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Fail where pytest-xdist does not see the groups, as with pytest 9.2."""
    grouped = [item for item in session.items if item.get_closest_marker('xdist_group')]
    if getattr(session.config.option, 'loadgroup', False) and grouped:
        assert '@' in grouped[0].nodeid, 'this pytest and this pytest-xdist keep no groups'


def is_ros(item: pytest.Item) -> bool:
    """Say whether a test runs real nodes."""
    return item.get_closest_marker('ros') is not None


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Let what does not run in real time make way, where this can be taken back: for root."""
    if 'PYTEST_XDIST_WORKER' in os.environ and os.geteuid() == 0:
        nice = IN_REAL_TIME if is_ros(item) else MAKES_WAY
        os.setpriority(os.PRIO_PROCESS, 0, nice)
