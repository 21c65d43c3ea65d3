"""Settings of all tests: ROS messages check their fields, tests of nodes run in two groups."""

import gc
import os
import signal
from typing import Any

import pytest
from xdist.scheduler import LoadGroupScheduling

# A shell makes its background processes ignore Ctrl-C, and nohup makes them ignore SIGHUP; the
# processes of the tests inherit it.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'  # read when a message is first imported
# Read when numpy is first imported, here and in hundreds of programs: its threads wait for work in
# a loop, and to start them takes a third of the time of the import. The matrices here are small.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

IN_REAL_TIME, IN_BACKGROUND = 0, 10  # niceness
FIRST = {  # the files of the first group, which takes about as long as the second
    'sim/test_node_claims', 'sim/test_node_control', 'sim/test_node_input',
    'sim/test_node_process', 'recorder/test_node', 'ros/test_faults', 'ros/test_parameters',
    'ros/test_parameters_of_a_node', 'ros/test_throw_when_ready', 'cli/test_demo',
}  # fmt: skip


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist looks at the marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give the tests of real nodes to two workers, and run them first.

    They mostly wait, but more than two at a time would disturb each other on two cores. Next are
    the modules that a group keeps on one worker, to share a fixture, also if they run real nodes;
    then all other tests, file by file.
    """
    for item in items:
        if is_ros(item) and not group_of(item):
            half = 1 if f'{item.path.parent.name}/{item.path.stem}' in FIRST else 2
            item.add_marker(pytest.mark.xdist_group(f'ros {half}'))
    items.sort(key=lambda item: (not group_of(item).startswith('ros '), not group_of(item)))


class ByFile(LoadGroupScheduling):  # type: ignore[misc] - without types
    """Gives workers the tests without a group file by file, not one by one.

    For each piece of work a worker waits for a message, and all pieces before are looked at: with
    5,000 pieces that takes 7 s of a core. One worker alone makes the fixtures of a module.
    """

    def _split_scope(self, node_id: str) -> str:
        return str(super()._split_scope(node_id)).partition('::')[0]


@pytest.hookimpl(optionalhook=True)  # also without pytest-xdist
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> ByFile | None:
    """Return what spreads the tests with `--dist loadgroup`."""
    return ByFile(config, log) if config.getvalue('dist') == 'loadgroup' else None


def pytest_collection_finish(session: pytest.Session) -> None:
    """Fail if pytest-xdist ignores the groups, as with pytest 9.2.

    The tests themselves are two million objects. The garbage collector need not look through them
    in each full collection: that took a tenth of the time of tests in plain Python.
    """
    gc.collect()
    gc.freeze()
    grouped = [item for item in session.items if group_of(item)]
    if getattr(session.config.option, 'loadgroup', False) and grouped:
        assert '@' in grouped[0].nodeid, 'this pytest and this pytest-xdist keep no groups'


def group_of(item: pytest.Item) -> str:
    """Return the group that keeps a test on one worker, or ''."""
    mark = item.get_closest_marker('xdist_group')
    return str(mark.args[0]) if mark else ''


def is_ros(item: pytest.Item) -> bool:
    """Return True if a test runs real nodes."""
    return item.get_closest_marker('ros') is not None


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Lower the priority of tests without nodes, if it can be raised again: for root."""
    if 'PYTEST_XDIST_WORKER' in os.environ and os.geteuid() == 0:
        nice = IN_REAL_TIME if is_ros(item) else IN_BACKGROUND
        os.setpriority(os.PRIO_PROCESS, 0, nice)
