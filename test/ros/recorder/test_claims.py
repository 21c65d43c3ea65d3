"""What a recorder claims at its end: "nothing lost" only where nothing is known to be missing."""

import os
import re
import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip('rclpy')

from std_srvs.srv import Trigger

from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.topics import Loss
from ros.recorder_process import Counter, counts

pytestmark = pytest.mark.ros
STOPPED = 0.7  # s, longer than what a recorder does not mention
# Publishes 0 once it is matched, then at a line from stdin the others, and ends.
PUBLISHER = """
import sys, time, rclpy
from std_msgs.msg import Int64
rclpy.init()
node = rclpy.create_node('other')
publisher = node.create_publisher(Int64, 'count', 1000)
while not publisher.get_subscription_count():
    time.sleep(0.01)
publisher.publish(Int64(data=0))
sys.stdin.readline()
for n in range(1, 501):
    publisher.publish(Int64(data=n))
node.destroy_node()
rclpy.shutdown()
"""


def last_line(recorder) -> str:
    return recorder.log.splitlines()[-1]


def test_a_publisher_that_ends_while_the_recorder_is_stopped_is_not_called_whole(ros, record):
    """The middleware may discard what is on the way from it, and no number shows the gap."""
    recorder = record()
    domain = {'ROS_DOMAIN_ID': str(ros.node.context.get_domain_id())}
    other = subprocess.Popen(
        [sys.executable, '-c', PUBLISHER], stdin=subprocess.PIPE, env=os.environ | domain
    )
    try:
        recorder.wait_for_topics('/count')
        ros.spin_until(lambda: counts(recorder.bag, '/count') == [0], 'the first message')
        recorder.process.send_signal(signal.SIGSTOP)
        other.communicate(b'\n')
        time.sleep(STOPPED)
        recorder.process.send_signal(signal.SIGCONT)
    finally:
        other.kill()
    recorder.wait_for_log('stood still')
    assert recorder.end() == 0
    recorded = counts(recorder.bag, '/count')
    assert recorded == list(range(len(recorded)))  # none, some or all of the others
    last = last_line(recorder)
    assert 'nothing lost' not in last
    assert Loss.STALL in last
    assert open_bag(recorder.bag).custom_data[Loss.STALL].startswith('for ')


def test_what_was_sent_before_the_subscription_is_told(ros, record):
    """From its number the first message tells how many came before."""
    counter = Counter(ros, 'count')
    counter.publish(50)
    recorder = record()
    recorder.wait_for_topics('/count')
    counter.wait_for_subscriptions(1)
    counter.publish(10)
    assert recorder.end() == 0
    assert counts(recorder.bag, '/count') == list(range(50, 60))
    assert 'nothing lost but what was sent before its subscriptions (/count 50' in last_line(
        recorder
    )


def test_a_publisher_that_comes_again_is_told_of_as_well(ros, record):
    """Its first messages come before the recorder is matched with it, or not."""
    recorder = record()
    first = Counter(ros, 'count')
    recorder.wait_for_topics('/count')
    first.wait_for_subscriptions(1)
    first.publish(10)
    ros.spin_until(lambda: counts(recorder.bag, '/count') == list(range(10)), 'the first ten')
    ros.node.destroy_publisher(first._publisher)
    time.sleep(0.5)
    second = Counter(ros, 'count')
    second.publish(30)
    second.wait_for_subscriptions(1)
    second.publish(10)
    # The recorder may learn of the publisher later than that of the recorder.
    ros.spin_until(lambda: counts(recorder.bag, '/count')[-1] == 39, 'the last message')
    assert recorder.end() == 0
    recorded = counts(recorder.bag, '/count')[10:]
    before = 40 - len(recorded)
    assert recorded == list(range(before, 40))
    numbers = [int(n) for n in re.findall(r'/count (\d+)', last_line(recorder))]
    assert numbers == [before] * (before > 0)


def test_numbers_of_a_publisher_that_left_are_not_taken_for_a_gap(ros, record):
    """Its last messages wait beside those of another one while the recorder is stopped."""
    recorder = record()
    both = [Counter(ros, 'count') for _ in range(2)]
    recorder.wait_for_topics('/count')
    for counter, count in zip(both, (1000, 10), strict=True):
        counter.wait_for_subscriptions(1)
        counter.publish(count)
    ros.spin_until(lambda: len(counts(recorder.bag, '/count')) == 1010, 'all of both')
    recorder.process.send_signal(signal.SIGSTOP)
    for _ in range(20):
        for counter in both:
            counter.publish_one()
    time.sleep(0.2)
    ros.node.destroy_publisher(both[0]._publisher)
    recorder.process.send_signal(signal.SIGCONT)
    recorder.wait_for_log('ended')
    both[1].publish(10)
    assert recorder.end() == 0
    recorded = counts(recorder.bag, '/count')
    gaps = int(open_bag(recorder.bag).custom_data.get('gaps /count', 0))
    assert gaps <= 1060 - len(recorded)


def test_a_recorder_without_topics_does_not_claim_that_nothing_was_lost(record):
    recorder = record(topics='["/none"]')
    recorder.wait_for_log('recording /none')
    assert recorder.end() == 0
    assert 'recorded 0 messages of 0 topics, 0.0 MB, no topic came, in' in last_line(recorder)


def test_what_came_in_a_pause_is_told(ros, record):
    recorder = record()
    counter = Counter(ros, 'count')
    recorder.wait_for_topics('/count')
    counter.wait_for_subscriptions(1)
    counter.publish(10)
    pause, resume = (
        ros.node.create_client(Trigger, f'recorder_node/{name}') for name in ('pause', 'resume')
    )
    ros.spin_until(lambda: pause.service_is_ready() and resume.service_is_ready(), 'the services')
    answer(ros, pause)
    counter.publish(25)
    answer(ros, resume)
    counter.publish(10)
    assert recorder.end() == 0
    assert counts(recorder.bag, '/count') == [*range(10), *range(35, 45)]
    (skipped,) = re.findall(r'(\d+) messages that came while it was paused', last_line(recorder))
    assert int(skipped) >= 25  # of /rosout there may be more


def answer(ros, client) -> None:
    future = client.call_async(Trigger.Request())
    ros.spin_until(future.done, 'an answer')
    assert future.result().success
