"""recorder_node in its own process: the bag holds what was published, whatever happens."""

import signal
import time

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger

from disc_sim_ros import topics
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.ros.recorder import qos
from ros.recorder_process import Counter, counts
from ros.sim_process import DEADLINE

pytestmark = pytest.mark.ros

LATE_GRAPH = """
import time
from rclpy.node import Node

def late(method):
    '''Let the graph report a change of publishers 0.3 s late.'''
    reported = {}  # by topic: the answer, the newer number of publishers, since when

    def answer_late(self, name):
        now, answer = time.monotonic(), method(self, name)
        count = answer if isinstance(answer, int) else len(answer)
        old, newer, since = reported.setdefault(name, (answer, count, now))
        if count != newer:
            newer, since = count, now
        reported[name] = (answer if now - since > 0.3 else old, newer, since)
        return reported[name][0]

    return answer_late

for name in ('count_publishers', 'get_publishers_info_by_topic'):
    setattr(Node, name, late(getattr(Node, name)))
"""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LATCHED_BEST_EFFORT = QoSProfile(
    depth=1,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    reliability=ReliabilityPolicy.BEST_EFFORT,
)
BEST_EFFORT = QoSProfile(depth=20_000, reliability=ReliabilityPolicy.BEST_EFFORT)
SECOND = 10**9  # ns


def call(ros, service: str) -> str:
    client = ros.node.create_client(Trigger, f'recorder_node/{service}')
    ros.spin_until(client.service_is_ready, service)
    # A service drops its response to a client that is not matched yet: call until there is one.
    futures = []

    def answered() -> bool:
        futures.append(client.call_async(Trigger.Request()))
        end = time.monotonic() + 0.5
        while not any(f.done() for f in futures) and time.monotonic() < end:
            ros._executor.spin_once(0.02)
        return any(f.done() for f in futures)

    ros.spin_until(answered, f'an answer of {service}')
    response = next(f for f in futures if f.done()).result()
    assert response.success, response.message
    return response.message


def cut(messages, ends):
    """Return the messages from the first to the last of those that are in `ends`."""
    places = [n for n, message in enumerate(messages) if message in ends]
    return messages[places[0] : places[-1] + 1]


def test_the_bag_holds_the_bytes_of_a_flight_and_describes_its_topics(ros, record):
    recorder = record()
    ros.start({'auto_throw': False})
    odometry = ros.subscribe(Odometry, topics.ODOM, raw=True)
    configuration = ros.subscribe(String, topics.CONFIGURATION, raw=True, qos=LATCHED)
    recorder.wait_for_topics('/odom', '/configuration', '/flight_events', '/release')
    ros.spin_until(lambda: odometry, 'odometry')
    sim = ros.sims[0]
    before = len(odometry)
    assert ros.call(sim, 'throw').success
    ros.spin_until(lambda: configuration, 'the configuration')
    ros.spin_until(lambda: len(odometry) > before + 400, 'two seconds')
    graph = {
        name: ros.node.get_publishers_info_by_topic(name) for name in ('/odom', '/configuration')
    }
    assert recorder.end() == 0
    assert 'nothing lost' in recorder.log

    bag = open_bag(recorder.bag)
    assert bag.complete
    recorded = [m.data for m in bag.raw(['/odom'])]
    # Recorder and test start and end at different times: in between, they are the same.
    common = set(recorded) & set(odometry)
    assert len(common) > 300
    assert cut(recorded, common) == cut(odometry, common)
    assert [m.data for m in bag.raw(['/configuration'])] == configuration
    for info in bag.topics:
        if info.topic.name in graph:
            expected = qos.bag_topic(info.topic.name, info.topic.type, graph[info.topic.name])
            assert expected.definition
            assert expected.type_hash.startswith('RIHS01_')
            assert info.topic == expected
    times = [(m.publish_time, m.log_time) for m in bag.raw(['/odom'])]
    assert all(0 <= log - sent < SECOND for sent, log in times)


def test_latched_messages_and_later_publishers_are_recorded(ros, record):
    latched = ros.node.create_publisher(Int64, 'latched', LATCHED)
    latched.publish(Int64(data=7))
    recorder = record()
    recorder.wait_for_topics('/latched')
    late = Counter(ros, 'late')
    recorder.wait_for_topics('/late')
    late.wait_for_subscriptions(1)
    late.publish(100)
    assert recorder.end(signal.SIGTERM) == 0
    assert counts(recorder.bag, '/latched') == [7]
    assert counts(recorder.bag, '/late') == list(range(100))
    names = {info.topic.name for info in open_bag(recorder.bag).topics}
    assert '/rosout' in names  # of the harness
    assert '/diagnostics' not in names  # of the recorder alone
    last = recorder.log.splitlines()[-1]
    assert last.startswith('recorder_node: recorded ')
    assert f'nothing lost, in {recorder.bag} (open it with analyse_bag' in last


@pytest.mark.parametrize('before', ['', LATE_GRAPH], ids=['', 'late graph'])
def test_a_latched_message_is_recorded_once_if_another_publisher_leaves(ros, record, before):
    latched = ros.node.create_publisher(Int64, 'latched', LATCHED)
    best_effort = ros.node.create_publisher(Int64, 'latched', LATCHED_BEST_EFFORT)
    recorder = record(before=before)
    recorder.wait_for_topics('/latched')
    both = latched, best_effort
    counts_expected = [1, 1]  # once it has discovered both
    ros.spin_until(
        lambda: [p.get_subscription_count() for p in both] == counts_expected, 'a subscription'
    )
    latched.publish(Int64(data=7))
    time.sleep(0.2)  # for the first subscription to get it, best effort
    ros.node.destroy_publisher(best_effort)  # a reliable subscription follows, and gets it again
    ros.spin_until(lambda: latched.get_subscription_count() == 2, 'the second subscription')
    ros.spin_until(lambda: latched.get_subscription_count() == 1, 'the end of the first')
    assert recorder.end() == 0
    assert counts(recorder.bag, '/latched') == [7]


def test_a_second_publisher_that_offers_less_is_recorded_without_gap_or_repetition(ros, record):
    reliable = Counter(ros, 'both')
    recorder = record()
    recorder.wait_for_topics('/both')
    reliable.wait_for_subscriptions(1)
    reliable.publish(200)
    best_effort = Counter(ros, 'both', BEST_EFFORT)
    best_effort.wait_for_subscriptions(1)
    for _ in range(1500):  # longer than the second in which two subscriptions overlap
        reliable.publish_one()
        best_effort.publish_one()
        time.sleep(0.001)
    assert recorder.end() == 0
    expected = sorted([*range(1700), *range(1500)])
    assert sorted(counts(recorder.bag, '/both')) == expected
    (info,) = (i for i in open_bag(recorder.bag).topics if i.topic.name == '/both')
    assert {q.reliability for q in info.topic.qos} == {'reliable', 'best_effort'}


@pytest.mark.parametrize('publishers', [1, 2])
def test_lost_messages_are_counted_in_the_log_and_in_the_bag(ros, record, publishers):
    counters = [Counter(ros, 'count', QoSProfile(depth=10)) for _ in range(publishers)]
    recorder = record()
    recorder.wait_for_topics('/count')
    for counter in counters:
        counter.wait_for_subscriptions(1)
        counter.publish(10)
    message = call(ros, 'flush')
    assert message.endswith('are on the disk')
    recorder.process.send_signal(signal.SIGSTOP)
    for counter in counters:
        counter.publish(5000, rate=1e5)  # more than the network holds for a stopped subscriber
    recorder.process.send_signal(signal.SIGCONT)
    for counter in counters:
        counter.publish(100, rate=1000.0)
    assert recorder.end() == 0
    recorded = counts(recorder.bag, '/count')
    assert max(map(recorded.count, recorded)) <= publishers
    assert (min(recorded), max(recorded)) == (0, 5109)
    missing = 5110 * publishers - len(recorded)
    assert missing > 0
    assert open_bag(recorder.bag).custom_data['gaps /count'] == str(missing)
    assert f'gaps /count: {missing}' in recorder.log.splitlines()[-1]


def test_topics_that_cannot_be_recorded_do_not_affect_others(ros, record):
    """The type is not installed."""
    unknown = ros.node.create_publisher(JointState, 'unknown', 10)
    diagnostics = ros.subscribe(DiagnosticArray, '/diagnostics')
    recorder = record(before="sys.modules['sensor_msgs'] = sys.modules['sensor_msgs.msg'] = None")
    counter = Counter(ros, 'count')
    recorder.wait_for_topics('/count')
    counter.wait_for_subscriptions(1)
    counter.publish(100)
    recorder.wait_for_log('/unknown is not recorded: no type sensor_msgs/msg/JointState here')
    diagnostics.clear()
    ros.spin_until(lambda: len(diagnostics) > 1, 'diagnostics')
    said = diagnostics[-1].status[0]  # not just "recording"
    assert said.message == 'not recorded /unknown (sensor_msgs/msg/JointState)'
    assert said.level == DiagnosticStatus.WARN
    assert recorder.end() == 0
    assert counts(recorder.bag, '/count') == list(range(100))
    assert recorder.log.count('/unknown is not') == 1
    assert 'Traceback' not in recorder.log
    assert unknown.topic_name, 'it was alive until now'
    last = recorder.log.splitlines()[-1]
    assert 'not recorded /unknown (sensor_msgs/msg/JointState)' in last
    assert 'nothing lost' not in last
    assert open_bag(recorder.bag).custom_data['not recorded /unknown'].startswith('no type')


def test_each_type_of_a_topic_is_a_channel_of_its_own(ros, record):
    """A topic may change its type, have two at once, or clash with one of the recorder."""
    clashing = ros.node.create_publisher(String, 'diagnostics', LATCHED)
    changing = Counter(ros, 'double')
    recorder = record()
    recorder.wait_for_topics('/double', '/diagnostics')
    changing.wait_for_subscriptions(1)
    changing.publish(100)
    clashing.publish(String(data='clash'))
    other_context = Context()  # in one context, ROS refuses a second type
    other_context.init(domain_id=ros.node.context.get_domain_id())
    other = Node('other', context=other_context)
    changed = other.create_publisher(String, 'double', 1000)
    for i in range(-20, 0):  # before there is a subscription, or not
        changed.publish(String(data=str(i)))
    recorder.wait_for_log('/double has another type, std_msgs/msg/String')
    ros.spin_until(changed.get_subscription_count, 'a subscription to the other type')
    ros.spin_until(clashing.get_subscription_count, 'a subscription beside that of the recorder')
    changing.publish(1)
    for i in range(50):
        changed.publish(String(data=str(i)))
        changing.publish(1)

    def texts(topic: str) -> list[str]:
        call(ros, 'flush')
        messages = open_bag(recorder.bag).messages(topic, ['std_msgs/msg/String'])
        return [m.value.data for m in messages]

    ros.spin_until(lambda: texts('/diagnostics') == ['clash'], 'the latched message')
    # A subscription that matches its publisher later than that one does gets what it lacks with
    # the next heartbeat, after up to 3 s.
    ros.spin_until(lambda: texts('/double')[-1:] == ['49'], 'the last text')
    assert recorder.end() == 0
    other.destroy_node()
    other_context.shutdown()
    bag = open_bag(recorder.bag)
    both = {(t.name, t.type): t.message_count for t in bag.topics}
    assert both['/double', 'std_msgs/msg/Int64'] == 151
    strings = [int(m.value.data) for m in bag.messages('/double', ['std_msgs/msg/String'])]
    assert strings == list(range(50 - len(strings), 50))
    assert both['/double', 'std_msgs/msg/String'] == len(strings) >= 50
    lost = 70 - len(strings)
    last = recorder.log.splitlines()[-1]
    assert (
        (f'gaps /double (std_msgs/msg/String): {lost}' in last)
        if lost
        else ('nothing lost' in last)
    )
    assert [m.value.data for m in bag.messages('/double', ['std_msgs/msg/Int64'])] == list(
        range(151)
    )


def test_pause_resume_and_split(ros, record):
    latched = [ros.node.create_publisher(Int64, 'latched', LATCHED) for _ in range(2)]
    counter = Counter(ros, 'count')
    recorder = record(start_paused=True)
    recorder.wait_for_topics('/count', '/latched')
    counter.wait_for_subscriptions(1)
    for publisher in latched:
        ros.spin_until(publisher.get_subscription_count, 'the recorder')
    for n in range(4):
        latched[n % 2].publish(Int64(data=n))
    counter.publish(50)
    status = ros.subscribe(DiagnosticArray, topics.DIAGNOSTICS)
    ros.spin_until(lambda: [s for s in status if s.status[0].message == 'paused'], 'diagnostics')
    assert 'recording' in call(ros, 'resume')
    counter.publish(500)
    assert 'bag_0_1.mcap' in call(ros, 'split')
    counter.publish(500)
    assert 'paused' in call(ros, 'pause')
    counter.publish(50)
    status.clear()
    ros.spin_until(lambda: status, 'diagnostics')
    (newest,) = status[-1].status
    values = {v.key: v.value for v in newest.values}
    assert values['bag'] == newest.hardware_id == str(recorder.bag)
    assert int(values['messages']) >= 1001
    assert int(values['bytes']) > 0
    assert 0.0 <= float(values['worst_lateness_s']) < DEADLINE
    assert int(values['free_bytes']) > 0
    assert recorder.end() == 0
    recorded = counts(recorder.bag, '/count')
    assert recorded == list(range(recorded[0], recorded[-1] + 1))
    assert (recorded[0], recorded[-1]) == (50, 1049)
    assert sorted(counts(recorder.bag, '/latched')) == [2, 3]  # the last of each publisher
    bag = open_bag(recorder.bag)
    assert [path.name for path in bag.files] == ['bag_0_0.mcap', 'bag_0_1.mcap']
    assert sum(len(counts(path, '/count')) for path in bag.files) == 1000


def test_log_times_follow_simulated_time(ros, record):
    counter = Counter(ros, 'count')
    clock = ros.node.create_publisher(Clock, '/clock', 10)
    recorder = record(use_sim_time=True, topics='/count /diagnostics')
    early = record(use_sim_time=True, topics='/count')
    for one in (recorder, early):
        one.wait_for_topics('/count')
    counter.wait_for_subscriptions(2)
    counter.publish(10)  # before the first /clock
    early.wait_for_log('no /clock has come')
    assert early.end() == 0
    assert 'log times of 10 messages' in early.log
    delays = [m.log_time - m.publish_time for m in open_bag(early.bag).raw(['/count'])]
    assert len(delays) == 10
    assert all(0 <= delay < DEADLINE * SECOND for delay in delays)
    ros.spin_until(clock.get_subscription_count, 'its clock')
    tick = Clock()
    tick.clock.sec = 100
    clock.publish(tick)
    end = time.monotonic() + 10.0

    def has_recorded_waiting() -> bool:
        call(ros, 'flush')
        return len(counts(recorder.bag, '/count')) >= 10

    while not has_recorded_waiting():
        assert time.monotonic() < end
    counter.publish(10)
    assert recorder.end() == 0
    messages = list(open_bag(recorder.bag).raw(['/count']))
    assert [m.log_time for m in messages] == [100 * SECOND] * 20
    own_topic = open_bag(recorder.bag).raw(['/diagnostics'])
    assert list(own_topic)  # recorded because it is selected


def test_two_recorders_of_one_name_go_on_with_a_bag_each(ros, record):
    counter = Counter(ros, 'count')
    both = record(), record()
    for recorder in both:
        recorder.wait_for_topics('/count')
    counter.wait_for_subscriptions(2)
    counter.publish(100)
    both[0].wait_for_log('there is another node /recorder_node')
    for recorder in both:
        assert recorder.end() == 0
        assert counts(recorder.bag, '/count') == list(range(100))
