"""recorder_node in its own process: how it ends, and the bag that it leaves."""

from contextlib import contextmanager
import os
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip('rclpy')

from nav_msgs.msg import Odometry
from std_msgs.msg import Int64, String

from disc_sim_ros import topics
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from ros.recorder_process import Counter, counts
from ros.sim_process import DEADLINE

pytestmark = pytest.mark.ros


def test_a_killed_recorder_costs_at_most_the_last_second(ros, record, tmp_path):
    recorders = [record() for _ in range(3)]
    counter = Counter(ros, 'count')
    for recorder in recorders:
        recorder.wait_for_topics('/count')
    counter.wait_for_subscriptions(3)
    kill_times = []
    for recorder in recorders:
        counter.publish(570, rate=1000.0)
        kill_times.append(time.monotonic())
        recorder.process.kill()
    for recorder, kill_time in zip(recorders, kill_times, strict=True):
        recorder.wait()
        recorded = counts(recorder.bag, '/count')
        assert recorded == list(range(len(recorded)))
        assert len(recorded) >= sum(sent < kill_time - 1.0 for sent in counter.sent)
        bag = open_bag(recorder.bag)
        assert not bag.complete
        repaired = tmp_path / f'{recorder.bag.name}_repaired'
        repair(recorder.bag, repaired)
        assert open_bag(repaired).complete
        assert counts(repaired, '/count') == recorded


def test_files_split_by_duration_hold_everything_after_repeated_signals(ros, record):
    counter = Counter(ros, 'count')
    recorder = record(max_duration_s=0.2)
    recorder.wait_for_topics('/count')
    counter.wait_for_subscriptions(1)
    counter.publish(1000, rate=1000.0)
    recorder.process.send_signal(signal.SIGINT)
    recorder.process.send_signal(signal.SIGINT)
    assert recorder.end(signal.SIGTERM) == 0
    assert 'Traceback' not in recorder.log
    assert counts(recorder.bag, '/count') == list(range(1000))
    assert len(open_bag(recorder.bag).files) >= 4


@pytest.mark.parametrize('number', [signal.SIGQUIT, signal.SIGHUP])
def test_recorders_of_one_second_have_a_bag_each_and_close_it_at_a_signal(ros, tmp_path, number):
    same = 'import disc_sim_ros.ros.recorder.options as o; o.default_bag = lambda _: "bags/disc"'
    run = 'import runpy\nrunpy.run_module("disc_sim_ros.ros.recorder")'
    logs = [tmp_path / 'a.log', tmp_path / 'b.log']
    processes = []
    for log in logs:
        with log.open('wb') as output:
            processes.append(
                subprocess.Popen(
                    [sys.executable, '-c', f'{same}\n{run}', '--ros-args'],
                    cwd=tmp_path, stdout=output, stderr=output,
                )
            )  # fmt: skip
    for log in logs:
        ros.spin_until(lambda log=log: 'recording all' in log.read_text(), log.name)
    for process in processes:
        process.send_signal(number)
    assert [process.wait(DEADLINE) for process in processes] == [0, 0]
    bags = sorted(path.name for path in (tmp_path / 'bags').iterdir())
    assert bags == ['disc', 'disc_2']
    assert all(open_bag(tmp_path / 'bags' / name).complete for name in bags)


def test_bad_parameters_end_it_with_one_line_before_it_makes_a_folder(record, tmp_path):
    (tmp_path / 'mine').mkdir()
    exists = record(tmp_path / 'mine')
    misspelt = record(max_size=3)
    for recorder, why in ((exists, 'exists'), (misspelt, 'max_size_mib')):
        assert recorder.wait() == 2
        (line,) = recorder.log.splitlines()
        assert line.startswith('recorder_node: error: ')
        assert why in line
    assert list((tmp_path / 'mine').iterdir()) == []
    assert not misspelt.bag.exists()


@contextmanager
def small_disk(folder, size: str):
    folder.mkdir()
    if os.geteuid() != 0:
        pytest.skip('mounting takes root')
    mount = ['mount', '-t', 'tmpfs', '-o', f'size={size}', 'tmpfs', str(folder)]
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip('no file system can be mounted here')
    try:
        yield folder
    finally:
        subprocess.run(['umount', '-l', str(folder)], check=True)


def test_a_full_disk_ends_it_with_a_readable_bag(ros, record, tmp_path):
    with small_disk(tmp_path / 'disk', '3M') as disk:
        noise = ros.node.create_publisher(String, 'noise', 1000)
        recorder = record(disk / 'bag', topics='/noise')
        recorder.wait_for_topics('/noise')
        end = time.monotonic() + DEADLINE
        while recorder.process.poll() is None and time.monotonic() < end:
            noise.publish(String(data=os.urandom(10_000).hex()))
            time.sleep(0.002)
        assert recorder.wait() == 1
        assert 'No space left' in recorder.log.splitlines()[-1]
        assert 'Traceback' not in recorder.log
        bag = open_bag(disk / 'bag')
        assert bag.complete
        assert sum(1 for _ in bag.raw()) > 20


def test_a_folder_that_is_removed_ends_it_with_a_line(ros, record):
    counter = Counter(ros, 'count')
    recorder = record()
    recorder.wait_for_topics('/count')
    counter.wait_for_subscriptions(1)
    shutil.rmtree(recorder.bag)
    counter.publish(1000, rate=1000.0)
    assert recorder.wait() == 1
    assert 'removed' in recorder.log.splitlines()[-1]
    assert 'Traceback' not in recorder.log


def test_a_simulator_that_ends_delivers_its_last_messages(ros, record):
    """The recorder is stalled meanwhile, as on a machine under load."""
    recorder = record()
    sim = ros.start({'publish_rate': 100.0, 'launch.height': 100.0})
    recorder.wait_for_topics('/odom', '/pose', '/spin_rate', '/aero_wrench')
    odom = ros.subscribe(Odometry, topics.ODOM)
    ros.spin_until(lambda: len(odom) > 50, 'a flight')
    recorder.process.send_signal(signal.SIGSTOP)
    sim.process.send_signal(signal.SIGINT)
    time.sleep(0.1)
    recorder.process.send_signal(signal.SIGCONT)
    assert sim.wait() == 0
    assert recorder.end() == 0
    kept = ['/odom', '/pose', '/spin_rate', '/aero_wrench']
    # Latched topics keep one message: a newer one may replace it before a stopped reader has it.
    counted = re.findall(r'(?:gaps|lost|dropped) (\S+):', recorder.log.splitlines()[-1])
    assert set(counted).isdisjoint(kept)  # it says that publishers ended around a stall
    bag = open_bag(recorder.bag)
    ends = {}
    for message in bag.raw(kept):
        ends[message.topic] = message.publish_time
    # Steps are 10 ms apart; a machine under load may need milliseconds for the topics of one.
    assert max(ends.values()) - min(ends.values()) < 5_000_000, 'all end with the same step'


def test_the_last_messages_of_600_topics_are_kept(ros, record):
    recorder = record()
    publishers = [ros.node.create_publisher(Int64, f't{i}', 10) for i in range(600)]
    ros.spin_until(
        lambda: all(p.get_subscription_count() for p in publishers), 'all subscriptions'
    )
    for n, publisher in enumerate(publishers):
        publisher.publish(Int64(data=n))
        time.sleep(0.001)  # the middleware passes on 512 messages at most at a time
    assert recorder.end() == 0
    assert 'nothing lost' in recorder.log.splitlines()[-1]
    filled = [t.message_count for t in open_bag(recorder.bag).topics if t.name.startswith('/t')]
    assert filled == [1] * 600
