"""What the writer promises while it writes: splits, flushes, clear refusals."""

import os
from pathlib import Path

from mcap.reader import make_reader
import pytest
from rosbags.rosbag2 import Reader
import yaml

from bags.making import (
    ODOMETRIES,
    ODOMETRY,
    START,
    STEP,
    STRING,
    everything,
    text,
    topic,
    write_bag,
)
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.topic import Qos
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError, ConfigError

pytest.importorskip('rclpy')


def told_by(folder: Path) -> dict:
    root = yaml.safe_load((folder / 'metadata.yaml').read_text(encoding='utf-8'))
    return root['rosbag2_bagfile_information']


def expected(count: int) -> list[tuple]:
    messages = []
    for n in range(count):
        at = START + n * STEP
        messages.append(('/odom', at, at - 5, ODOMETRIES[n % len(ODOMETRIES)]))
        if n % 10 == 0:
            messages.append(('/log', at, at - 7, text(f'message {n}')))
    return messages


# ---- splits ----


def test_a_split_by_duration_loses_nothing(tmp_path):
    bag = write_bag(tmp_path / 'bag', 1000, max_duration=0.3)
    assert everything(open_bag(tmp_path / 'bag')) == expected(1000)
    files = told_by(tmp_path / 'bag')['files']
    assert [f['path'] for f in files] == [f'bag_{n}.mcap' for n in range(4)]
    assert [f['message_count'] for f in files] == [330, 330, 330, 110]
    assert [f['starting_time']['nanoseconds_since_epoch'] for f in files] == [
        START + n * 300 * STEP for n in range(4)
    ]
    assert [f['duration']['nanoseconds'] for f in files] == [299 * STEP] * 3 + [99 * STEP]
    assert bag.counts == {'/odom': 1000, '/log': 100, '/silent': 0}


def test_a_split_by_size_loses_nothing_and_keeps_to_the_size(tmp_path):
    limit = 200_000
    bag = write_bag(tmp_path / 'bag', 2000, max_size=limit, compression='none')
    assert everything(open_bag(tmp_path / 'bag')) == expected(2000)
    sizes = [path.stat().st_size for path in bag.files]
    assert len(sizes) > 5
    # The file that reaches the limit still gets its index: half as much again is plenty.
    assert max(sizes) < 1.5 * limit
    assert min(sizes[:-1]) >= limit
    assert bag.bytes == sum(sizes)
    with Reader(tmp_path / 'bag') as reader:
        assert sum(1 for _ in reader.messages()) == 2200


def test_a_channel_keeps_its_id_through_splits_and_each_file_stands_alone(tmp_path):
    bag = write_bag(tmp_path / 'bag', 300, split_at=(100, 200))
    ids = []
    for path in bag.files:
        with path.open('rb') as file:
            summary = make_reader(file).get_summary()
            ids.append({c.id: c.topic for c in summary.channels.values()})
        assert open_bag(path).message_count == 110
    assert ids == [{1: '/odom', 2: '/log', 3: '/silent'}] * 3


def test_a_split_of_nothing_makes_no_empty_file(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        bag.split()
        odom = bag.add(topic('/odom', ODOMETRY))
        bag.split()
        bag.write(odom, ODOMETRIES[0], 1, 1)
        bag.split()
        bag.split()
    assert [f['message_count'] for f in told_by(tmp_path / 'bag')['files']] == [1, 0]
    assert open_bag(tmp_path / 'bag').message_count == 1


# ---- on the way ----


def test_flushed_messages_are_there_while_the_bag_is_being_written(tmp_path):
    with BagWriter(tmp_path / 'bag', flush_period=3600.0) as bag:
        odom = bag.add(topic('/odom', ODOMETRY, Qos()))
        bag.write(odom, ODOMETRIES[0], START, START)
        assert open_bag(tmp_path / 'bag').message_count == 0
        bag.flush()
        bag.write(odom, ODOMETRIES[1], START + 1, START)
        opened = open_bag(tmp_path / 'bag')
        assert everything(opened) == [('/odom', START, START, ODOMETRIES[0])]
        assert not opened.complete
        assert told_by(tmp_path / 'bag')['message_count'] == 1
        assert bag.message_count == 2
        assert (bag.start, bag.end) == (START, START)
    assert open_bag(tmp_path / 'bag').complete


def test_write_flushes_by_itself_when_the_period_is_over(tmp_path):
    with BagWriter(tmp_path / 'bag', flush_period=0.001) as bag:
        odom = bag.add(topic('/odom', ODOMETRY))
        for n in range(20_000):  # far longer than a millisecond
            bag.write(odom, ODOMETRIES[0], START + n, START)
            if told_by(tmp_path / 'bag')['message_count']:
                return
    pytest.fail('nothing was flushed')


def test_a_publisher_that_comes_before_the_first_message_is_in_the_channel(tmp_path):
    first, second = Qos(), Qos(durability='transient_local')
    with BagWriter(tmp_path / 'bag') as bag:
        odom = bag.add(topic('/odom', ODOMETRY, first))
        bag.flush()
        bag.update(odom, topic('/odom', ODOMETRY, first, second))
        bag.write(odom, ODOMETRIES[0], 1, 1)
    profiles = told_by(tmp_path / 'bag')['topics_with_message_count'][0]['topic_metadata'][
        'offered_qos_profiles'
    ]
    assert [p['durability'] for p in profiles] == ['volatile', 'transient_local']
    assert open_bag(tmp_path / 'bag/bag_0.mcap').topics[0].topic.qos == (first, second)


@pytest.mark.parametrize('split', [True, False])
def test_qos_of_a_publisher_that_comes_later_is_kept_and_rosbags_reads_every_message(
    tmp_path, split
):
    """rosbags leaves out the messages of channels whose QoS is not that of metadata.yaml."""
    first, second = Qos(), Qos(durability='transient_local')
    with BagWriter(tmp_path / 'bag') as bag:
        odom = bag.add(topic('/odom', ODOMETRY, first))
        bag.write(odom, ODOMETRIES[0], 1, 1)
        if split:
            bag.split()
        bag.update(odom, topic('/odom', ODOMETRY, first, second))
        bag.write(odom, ODOMETRIES[0], 2, 2)
        with pytest.raises(BagError, match='/other'):
            bag.update(odom, topic('/other', ODOMETRY))
    [info] = open_bag(tmp_path / 'bag').topics
    assert info.topic.qos == (first, second)
    assert info.message_count == 2
    repair(tmp_path / 'bag', tmp_path / 'made')
    for folder in ('bag', 'made'):
        with Reader(tmp_path / folder) as reader:
            assert sum(1 for _ in reader.messages()) == 2
        assert open_bag(tmp_path / folder).topics[0].topic.qos == (first, second)


def test_attachments_are_read_back_by_foxglove(tmp_path, foxglove):
    with BagWriter(tmp_path / 'bag') as bag:
        odom = bag.add(topic('/odom', ODOMETRY))
        bag.write(odom, ODOMETRIES[0], 1, 1)
        bag.attach('sim.yaml', 'text/yaml', b'speed: 15\n', log_time=7, create_time=5)
        bag.write(odom, ODOMETRIES[1], 2, 2)
    [attachment] = open_bag(tmp_path / 'bag').attachments
    assert (attachment.name, attachment.media_type, attachment.data) == (
        'sim.yaml',
        'text/yaml',
        b'speed: 15\n',
    )
    assert (attachment.log_time, attachment.create_time) == (7, 5)
    [file] = foxglove(tmp_path / 'bag/bag_0.mcap')
    assert file['attachments'] == [{'name': 'sim.yaml', 'text': 'speed: 15\n'}]
    assert file['topics']['/odom']['count'] == 2


def test_messages_of_one_topic_with_two_types_are_both_kept(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        bag.write(bag.add(topic('/x', ODOMETRY)), ODOMETRIES[0], 1, 1)
        bag.write(bag.add(topic('/x', STRING)), text('a'), 2, 2)
    repair(tmp_path / 'bag', tmp_path / 'made')
    for folder in ('bag', 'made'):
        assert [m.type for m in open_bag(tmp_path / folder).messages()] == [ODOMETRY, STRING]
        with Reader(tmp_path / folder) as reader:
            types = [connection.msgtype for connection, _, _ in reader.messages()]
        assert types == [ODOMETRY, STRING]


# ---- refusals ----


def test_a_bag_is_never_overwritten(tmp_path):
    write_bag(tmp_path / 'bag', 10)
    before = (tmp_path / 'bag/bag_0.mcap').read_bytes()
    with pytest.raises(ConfigError, match='it exists already'):
        BagWriter(tmp_path / 'bag')
    assert (tmp_path / 'bag/bag_0.mcap').read_bytes() == before


def test_a_folder_that_cannot_be_made_is_an_error_of_one_line(tmp_path):
    (tmp_path / 'file').touch()
    with pytest.raises(ConfigError, match='the folder cannot be made') as caught:
        BagWriter(tmp_path / 'file/bag')
    assert '\n' not in str(caught.value)
    with pytest.raises(ConfigError, match='the folder cannot be made'):
        BagWriter(Path('/proc/bag'))


@pytest.mark.skipif(os.geteuid() == 0, reason='root may write everywhere')
def test_an_unwritable_folder_is_an_error(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(ConfigError, match='Permission denied'):
        BagWriter(tmp_path / 'bag')


@pytest.mark.parametrize(
    ('option', 'value'),
    [
        ('compression', 'gzip'),
        ('flush_period', 0),
        ('flush_period', float('nan')),
        ('max_size', 10),
        ('max_duration', -1.0),
    ],
)
def test_bad_options_are_refused_before_anything_is_made(tmp_path, option, value):
    with pytest.raises(ConfigError, match=option):
        BagWriter(tmp_path / 'bag', **{option: value})
    assert not (tmp_path / 'bag').exists()


def test_bad_messages_are_refused_and_the_bag_goes_on(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        odom = bag.add(topic('/odom', ODOMETRY))
        with pytest.raises(BagError, match='id 9'):
            bag.write(9, b'', 1, 1)
        with pytest.raises(BagError, match='/odom: times'):
            bag.write(odom, b'', -1, 1)
        with pytest.raises(TypeError):
            bag.write(odom, 'text', 1, 1)
        bag.write(odom, ODOMETRIES[0], 5, 4)
    assert everything(open_bag(tmp_path / 'bag')) == [('/odom', 5, 4, ODOMETRIES[0])]
    with pytest.raises(BagError, match='closed'):
        bag.write(odom, b'', 1, 1)
    with pytest.raises(BagError, match='closed'):
        bag.flush()
    bag.close()
