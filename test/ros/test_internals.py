"""The nodes do without the private parts of rclpy, each removed as a later version may do."""

from pathlib import Path
import re
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Vector3Stamped
import rclpy._rclpy_pybind11 as _rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int64

from disc_sim_ros import topics
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.ros import internals
from disc_sim_ros.ros.internals import PolledSubscription, WatchedSubscription
from ros import rclpy_without
from ros.recorder_process import Counter, Recorder, counts

pytestmark = pytest.mark.ros

PACKAGE = Path(__file__).parents[2] / 'disc_sim_ros'
RELIABLE = QoSProfile(depth=100)
BEST_EFFORT = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def remove(monkeypatch):
    """A function that removes a private part of rclpy for the time of a test."""

    def remove_part(part):
        rclpy_without.PARTS[part](
            lambda owner, name, value: monkeypatch.setattr(owner, name, value, raising=False),
            monkeypatch.delattr,
        )

    return remove_part


@pytest.fixture
def node(ros_context):
    """A node that an executor of the test spins: `node.spin_until(condition)`."""
    made = Node('subscriber', context=ros_context)
    executor = SingleThreadedExecutor(context=ros_context)
    executor.add_node(made)

    def spin_until(condition):
        for _ in range(1000):
            if condition():
                return
            executor.spin_once(0.02)
        pytest.fail('not within 1000 rounds')

    made.spin_until = spin_until
    yield made
    executor.shutdown()
    made.destroy_node()


# ---- nothing private elsewhere ----


def test_no_other_module_uses_private_parts_of_rclpy():
    private = re.compile(
        r'_rclpy|rclpy\.impl|\.handle\b|take_message|_parameter_overrides|event_handlers'
        r'|can_execute|__import_type_support__|self\._logger\b'
    )
    for path in PACKAGE.rglob('*.py'):
        if path.name != 'internals.py':
            assert not private.findall(path.read_text(encoding='utf-8')), path


# ---- messages ----


@pytest.mark.parametrize('removed', ['', 'take_message'])
@pytest.mark.parametrize('raw', [False, True])
def test_messages_are_taken_in_order(node, remove, removed, raw):
    if removed:
        remove(removed)
    subscription = PolledSubscription(node, Int64, 'count', RELIABLE, raw=raw)
    assert (subscription.take == subscription._dequeue) == bool(removed)
    publisher = node.create_publisher(Int64, 'count', RELIABLE)
    node.spin_until(publisher.get_subscription_count)
    node.spin_until(subscription.has_publishers)
    assert subscription.take() is None
    taken = []
    for n in range(100):
        publisher.publish(Int64(data=n))
        if n % 25 == 0:
            node.spin_until(lambda n=n: take_all(subscription, taken) == n + 1)
    node.spin_until(lambda: take_all(subscription, taken) == 100)
    numbers = [message[-8] if raw else message.data for message, _ in taken]
    assert numbers == list(range(100))
    assert all(info['source_timestamp'] > 0 for _, info in taken)
    assert subscription.take() is None
    subscription.destroy()
    node.spin_until(lambda: publisher.get_subscription_count() == 0)


def take_all(subscription, taken):
    while (message := subscription.take()) is not None:
        taken.append(message)
    return len(taken)


def test_a_full_queue_of_the_executor_loses_its_oldest_messages(node, remove):
    remove('take_message')
    subscription = PolledSubscription(node, Int64, 'count', QoSProfile(depth=5))
    publisher = node.create_publisher(Int64, 'count', RELIABLE)
    node.spin_until(publisher.get_subscription_count)
    for n in range(20):
        publisher.publish(Int64(data=n))
        node.spin_until(lambda n=n: subscription._queue and subscription._queue[-1][0].data == n)
    taken = []
    take_all(subscription, taken)
    assert [message.data for message, _ in taken] == [15, 16, 17, 18, 19]


# ---- events ----


@pytest.mark.parametrize('removed', ['', 'EventHandle', 'take_message'])
def test_events_report_each_change_once(node, remove, removed):
    if removed:
        remove(removed)
    subscription = WatchedSubscription(node, Int64, 'count', RELIABLE)
    events = subscription.events
    assert isinstance(events, internals._ReportedEvents) == (removed == 'EventHandle')
    assert (events.publisher_count(), events.lost(), events.has_incompatible()) == (None, 0, False)

    def reported(expected):
        return events.publisher_count() == expected

    first = node.create_publisher(Int64, 'count', RELIABLE)
    node.spin_until(lambda: reported(1))
    assert events.publisher_count() is None
    node.create_publisher(Int64, 'count', RELIABLE)
    node.spin_until(lambda: reported(2))
    node.destroy_publisher(first)
    node.spin_until(lambda: reported(1))
    assert not events.has_incompatible()
    node.create_publisher(Int64, 'count', BEST_EFFORT)
    node.spin_until(events.has_incompatible)
    assert not events.has_incompatible()
    assert events.lost() == 0
    subscription.destroy()


def test_a_subscription_without_a_handle_gets_its_events_from_the_executor(monkeypatch):
    assert internals._event_handle_class() is _rclpy.EventHandle
    monkeypatch.delattr('rclpy.subscription.Subscription.handle')
    assert internals._event_handle_class() is None


def test_the_package_loads_without_the_private_module():
    code = (
        'import sys, rclpy.node, rclpy.event_handler\n'
        "sys.modules['rclpy._rclpy_pybind11'] = None\n"
        'from disc_sim_ros.ros import internals\n'
        'assert internals._event_handle_class() is None'
    )
    subprocess.run([sys.executable, '-c', code], check=True)


# ---- parameters ----


@pytest.mark.parametrize('removed', ['', '_parameter_overrides'])
def test_overrides_of_parameters_are_found_before_they_are_declared(ros_context, remove, removed):
    if removed:
        remove(removed)
    overrides = {'a': 3, 'b': [1.5, 2.0], 'c': 'x'}
    node = Node(
        'parameters',
        context=ros_context,
        parameter_overrides=[Parameter(name, value=value) for name, value in overrides.items()],
    )
    assert hasattr(node, '_parameter_overrides') != bool(removed)
    values = internals.parameter_overrides(node, ['a', 'b', 'not_set'])
    known = {'a', 'b'} if removed else {'a', 'b', 'c'}
    assert {n: list(v) if n == 'b' else v for n, v in values.items()} == {
        n: overrides[n] for n in known
    }
    assert not any(node.has_parameter(name) for name in (*overrides, 'not_set'))
    assert node.declare_parameter('a', 0).value == 3
    node.destroy_node()


# ---- the nodes ----


@pytest.mark.parametrize('removed', rclpy_without.PARTS)
def test_simulator_and_recorder_work_without_a_private_part(ros, tmp_path, removed):
    before = rclpy_without.without(removed)
    short = {'launch.height': 0.5, 'launch.pitch': -2.0}  # of half a second
    parameters = {'auto_throw': False, 'command_timeout': 5.0} | short
    latched = ros.node.create_publisher(Int64, 'latched', LATCHED)
    latched.publish(Int64(data=7))
    counter = Counter(ros, 'count')
    recorder = Recorder(ros, tmp_path / 'bag', {'flush_period': 0.2}, before)
    try:
        sim = ros.start(parameters, before=before)
        events = ros.subscribe(DiagnosticStatus, topics.FLIGHT_EVENTS)
        applied = ros.subscribe(Vector3Stamped, topics.APPLIED_COEFFICIENTS)
        command = ros.publisher(Vector3Stamped, topics.CMD_COEFFICIENTS)
        recorder.wait_for_topics('/count', '/latched', '/odom', '/flight_events', '/release')
        counter.wait_for_subscriptions(1)
        counter.publish(300)
        message = Vector3Stamped()
        message.vector.y = 0.003
        ros.send(sim, command, message)
        ros.spin_until(lambda: applied, 'the command')
        assert applied[0].vector.y == 0.003
        assert ros.call(sim, 'throw').success
        ros.spin_until(lambda: any(e.name.endswith(': landed') for e in events), 'the landing')
        thrown = next(e for e in events if e.name.endswith(': thrown'))
        assert thrown.message == '15.00 m/s, spin 31.42 rad/s'
        less = Counter(ros, 'count', BEST_EFFORT)  # the recorder adapts its request
        less.wait_for_subscriptions(1)
        recorded = tmp_path / 'bag'
        ros.spin_until(lambda: len(counts(recorded, '/count')) == 300, 'all of /count on the disk')
        assert recorder.end() == 0
    finally:
        recorder.process.kill()
    assert counts(recorded, '/count') == list(range(300))
    assert counts(recorded, '/latched') == [7]
    assert 'nothing lost' in recorder.log.splitlines()[-1]
    bag = open_bag(recorded)
    assert bag.complete
    (described,) = (i.topic for i in bag.topics if i.topic.name == '/count')
    assert {qos.reliability for qos in described.qos} == {'reliable', 'best_effort'}
    assert 'Traceback' not in recorder.log + sim.stderr
