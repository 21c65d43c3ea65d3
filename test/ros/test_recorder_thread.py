"""The thread that writes a bag: what does not fit is counted, what fails is told."""

import time

import pytest

pytest.importorskip('rclpy')

from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError
from disc_sim_ros.ros.recorder import writer_thread
from disc_sim_ros.ros.recorder.discovery import TakingThread
from disc_sim_ros.ros.recorder.writer_thread import BagThread

TOPIC = Topic(name='/a', type='std_msgs/msg/Int64', definition='int64 data')
DATA = bytes(12)


@pytest.fixture
def thread(tmp_path):
    """A thread that has not been started, with one topic."""
    writer = BagWriter(tmp_path / 'bag')
    made = BagThread(writer, 0.1)
    made.call(lambda w: w.add(TOPIC))
    yield made
    writer.close()


def recorded(tmp_path) -> int:
    bag = open_bag(tmp_path / 'bag')
    assert bag.complete
    return sum(1 for _ in bag.raw())


def test_messages_are_refused_while_too_many_wait(thread, tmp_path, monkeypatch):
    monkeypatch.setattr(writer_thread, 'LARGEST_BACKLOG', 10_000)
    taken = [thread.put(1, DATA, n, n) for n in range(100)]
    kept = taken.index(False)
    assert 0 < kept < 100
    assert not any(taken[kept:])
    assert 0 < thread.backlog <= 10_000
    thread.start()
    thread.call(BagWriter.flush).result(60.0)
    assert thread.backlog == 0
    assert thread.put(1, DATA, 100, 100)  # there is room again
    thread.end()
    thread.join(60.0)
    assert thread.failure is None
    assert recorded(tmp_path) == kept + 1


def test_whatever_fails_the_bag_is_closed_and_the_reason_told(thread, tmp_path):
    assert thread.put(1, DATA, 1, 1)
    failed = thread.call(lambda _: 1 // 0)
    thread.start()
    thread.join(60.0)
    with pytest.raises(BagError, match='ZeroDivisionError'):
        failed.result(0.0)
    assert 'ZeroDivisionError' in str(thread.failure)
    assert not thread.put(1, DATA, 2, 2)
    assert recorded(tmp_path) == 1


def test_a_listener_rests_only_where_there_is_no_more_and_tells_why_it_ended():
    rounds = []

    def take() -> bool:
        rounds.append(time.monotonic())
        if len(rounds) == 30:
            raise ValueError('no ears')
        return len(rounds) < 20

    listener = TakingThread(take, 0.05)
    listener.start()
    listener.join(60.0)
    assert 'no ears' in str(listener.failure)
    assert rounds[29] - rounds[20] >= 9 * 0.05
    listener.end()
