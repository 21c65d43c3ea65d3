"""The thread that writes a bag: it drops what exceeds the backlog, and reports failures."""

import pytest

pytest.importorskip('rclpy')

from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.topic import Qos, Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError
from disc_sim_ros.ros.recorder import writer_thread
from disc_sim_ros.ros.recorder.writer_thread import BagTopic, WriterThread

DESCRIPTION = Topic(name='/a', type='std_msgs/msg/Int64', definition='int64 data')
QOS = Qos(
    history='unknown', depth=0, reliability='reliable', durability='transient_local'
)  # fmt: skip
DATA = bytes(12)


@pytest.fixture
def topic():
    return BagTopic()


@pytest.fixture
def thread(tmp_path, topic):
    """A thread that is not started, with one topic."""
    writer = BagWriter(tmp_path / 'bag')
    made = WriterThread(writer, 0.1)
    made.add_topic(topic, DESCRIPTION)
    yield made
    writer.close()


def recorded(tmp_path) -> int:
    bag = open_bag(tmp_path / 'bag')
    assert bag.complete
    return sum(1 for _ in bag.raw())


def test_messages_are_dropped_while_too_many_wait(thread, topic, tmp_path, monkeypatch):
    monkeypatch.setattr(writer_thread, 'LARGEST_BACKLOG', 10_000)
    accepted = [thread.put(topic, DATA, n, n) for n in range(100)]
    count = accepted.index(False)
    assert 0 < count < 100
    assert not any(accepted[count:])
    assert 0 < thread.backlog <= 10_000
    thread.start()
    thread.call(BagWriter.flush).result(60.0)
    assert thread.backlog == 0
    assert thread.put(topic, DATA, 100, 100)  # there is room again
    thread.end()
    thread.join(60.0)
    assert thread.failure is None
    assert recorded(tmp_path) == count + 1


def test_any_failure_closes_the_bag_and_is_reported(thread, topic, tmp_path):
    assert thread.put(topic, DATA, 1, 1)
    failed = thread.call(lambda _: 1 // 0)
    thread.start()
    thread.join(60.0)
    with pytest.raises(BagError, match='ZeroDivisionError'):
        failed.result(0.0)
    assert 'ZeroDivisionError' in str(thread.failure)
    assert not thread.put(topic, DATA, 2, 2)
    assert recorded(tmp_path) == 1


def test_messages_name_topics_whose_ids_the_bag_gives(tmp_path):
    """The ids are known only when the thread runs, and need not count the topics from 1."""
    writer = BagWriter(tmp_path / 'bag')
    writer.add(Topic(name='/other', type='std_msgs/msg/Int64', definition='int64 data'))
    thread = WriterThread(writer, 0.1)
    first, second = BagTopic(), BagTopic()
    for topic, name in ((first, '/a'), (second, '/b')):
        thread.add_topic(
            topic, Topic(name=name, type='std_msgs/msg/Int64', definition='int64 data')
        )
    for n in range(3):
        assert thread.put(first, DATA, n, n)
    assert thread.put(second, DATA, 3, 3)
    thread.update_topic(
        second, Topic(name='/b', type='std_msgs/msg/Int64', definition='int64 data', qos=(QOS,))
    )
    thread.start()
    thread.end()
    thread.join(60.0)
    assert thread.failure is None
    bag = open_bag(tmp_path / 'bag')
    counts = {info.topic.name: info.message_count for info in bag.topics}
    assert counts == {'/other': 0, '/a': 3, '/b': 1}
    (described,) = (info.topic for info in bag.topics if info.topic.name == '/b')
    assert described.qos == (QOS,)
