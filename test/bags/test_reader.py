"""Bags of others, bags in pieces, and what is no bag at all."""

from mcap.writer import CompressionType, IndexType, Writer
import pytest
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter
import yaml

from bags.making import (
    ODOMETRIES,
    ODOMETRY,
    START,
    STEP,
    STRING,
    TYPES,
    everything,
    text,
    topic,
    write_bag,
)
from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.errors import BagError

pytest.importorskip('rclpy')


def mcap_file(path, count: int, *, end: bool = True, **options) -> None:
    """A file by `mcap.Writer`."""
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=20_000, **options)
        writer.start('ros2', 'others')
        schema = writer.register_schema(ODOMETRY, 'ros2msg', schemas.definition(ODOMETRY).encode())
        channel = writer.register_channel('/odom', 'cdr', schema)
        for n in range(count):
            writer.add_message(channel, START + n, ODOMETRIES[n % 500], START, sequence=n)
        if end:
            writer.finish()
        else:
            writer.flush()


def test_messages_come_decoded_in_the_order_of_log_times_across_files(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        odom, log = bag.add(topic('/odom', ODOMETRY)), bag.add(topic('/log', STRING))
        for n in (3, 1, 7):
            bag.write(odom, ODOMETRIES[n], START + n, START)
        bag.split()
        for n in (2, 9, 1):
            bag.write(log, text(f'm{n}'), START + n, START)
        bag.flush()
        bag.write(odom, ODOMETRIES[0], START, START)
    opened = open_bag(tmp_path / 'bag')
    assert (opened.start, opened.end) == (START, START + 9)
    got = [
        (
            m.topic,
            m.log_time - START,
            m.value.data if m.type == STRING else m.value.pose.pose.position.x,
        )
        for m in opened.messages()
    ]
    assert got == [
        ('/odom', 0, 0.0),
        ('/odom', 1, 1.0),
        ('/log', 1, 'm1'),
        ('/log', 2, 'm2'),
        ('/odom', 3, 3.0),
        ('/odom', 7, 7.0),
        ('/log', 9, 'm9'),
    ]
    assert [m.topic for m in opened.raw(['/log'])] == ['/log'] * 3
    assert [m.topic for m in opened.raw('/log')] == ['/log'] * 3
    assert list(opened.raw(['/nothing'])) == []
    assert {t.name: (t.type, t.message_count) for t in opened.topics} == {
        '/odom': (ODOMETRY, 4),
        '/log': (STRING, 3),
    }


def test_a_bag_of_rosbags_is_read(tmp_path):
    with RosbagsWriter(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        connection = bag.add_connection('/odom', ODOMETRY, typestore=TYPES)
        for n in range(50):
            bag.write(connection, START + n * STEP, ODOMETRIES[n])
        bag.set_custom_data('a', 'b')
    opened = open_bag(tmp_path / 'bag')
    assert opened.complete
    assert opened.message_count == 50
    assert opened.custom_data == {'a': 'b'}
    assert [m.value.pose.pose.position.x for m in opened.messages()] == list(range(50))


@pytest.mark.parametrize(
    'options',
    [
        {},
        {'compression': CompressionType.LZ4},
        {'use_chunking': False},  # as `ros2 bag record --storage-preset-profile fastwrite`
        {'index_types': IndexType.NONE},
        {'use_statistics': False, 'enable_crcs': False},
        {'repeat_channels': False, 'repeat_schemas': False},
    ],
)
@pytest.mark.parametrize('end', [True, False])
def test_a_lone_file_of_others_is_read(tmp_path, options, end):
    mcap_file(tmp_path / 'x.mcap', 700, end=end, **options)
    bag = open_bag(tmp_path / 'x.mcap')
    assert bag.complete == end
    assert not bag.losses
    assert bag.message_count == 700
    assert everything(bag) == [
        ('/odom', START + n, START, ODOMETRIES[n % 500]) for n in range(700)
    ]
    assert [m.sequence for m in bag.raw()] == list(range(700))


def test_a_folder_without_metadata_is_read_in_the_order_of_its_numbers(tmp_path):
    for n in (10, 9, 2):
        mcap_file(tmp_path / f'bag_{n}.mcap', 3)
    bag = open_bag(tmp_path)
    assert [p.name for p in bag.files] == ['bag_2.mcap', 'bag_9.mcap', 'bag_10.mcap']
    assert not bag.complete  # rosbag2 would want metadata.yaml
    assert bag.message_count == 9


def test_a_file_that_metadata_does_not_list_yet_is_read(tmp_path):
    """The recorder was killed between the new file and its metadata."""
    bag = write_bag(tmp_path / 'bag', 300, split_at=(200,))
    path = tmp_path / 'bag/metadata.yaml'
    root = yaml.safe_load(path.read_text(encoding='utf-8'))
    about = root['rosbag2_bagfile_information']
    for key in ('files', 'relative_file_paths'):
        about[key] = about[key][:1]
    about['message_count'] = 220
    path.write_text(yaml.safe_dump(root, sort_keys=False), encoding='utf-8')
    assert open_bag(tmp_path / 'bag').files == bag.files
    assert not open_bag(tmp_path / 'bag').complete  # metadata.yaml counts 220
    assert open_bag(tmp_path / 'bag').message_count == 330


@pytest.mark.parametrize('content', [b'', b'\x89MC', bytes(5000)])
def test_a_next_file_without_beginning_costs_nothing(tmp_path, content):
    """The recorder was killed, or the power went, just when it was made."""
    write_bag(tmp_path / 'bag', 100)
    (tmp_path / 'bag/bag_1.mcap').write_bytes(content)
    bag = open_bag(tmp_path / 'bag')
    assert len(everything(bag)) == bag.message_count == 110
    assert not bag.complete
    report = repair(tmp_path / 'bag', tmp_path / 'made')
    assert report.message_count == 110
    assert report.bytes_lost == len(content)
    assert open_bag(tmp_path / 'made').complete


def test_torn_metadata_is_taken_for_none(tmp_path):
    write_bag(tmp_path / 'bag', 100, custom_data={'a': 'b'})
    whole = (tmp_path / 'bag/metadata.yaml').read_bytes()
    for size in range(0, len(whole), 97):
        (tmp_path / 'bag/metadata.yaml').write_bytes(whole[:size])
        bag = open_bag(tmp_path / 'bag')
        assert bag.message_count == 110
        assert bag.custom_data == {'a': 'b'} or size > len(whole) - 60


def edited(tmp_path, **changes) -> None:
    write_bag(tmp_path / 'bag', 10)
    path = tmp_path / 'bag/metadata.yaml'
    root = yaml.safe_load(path.read_text(encoding='utf-8'))
    root['rosbag2_bagfile_information'].update(changes)
    path.write_text(yaml.safe_dump(root, sort_keys=False), encoding='utf-8')


@pytest.mark.parametrize(
    ('changes', 'says'),
    [
        ({'storage_identifier': 'sqlite3'}, 'sqlite3.*ros2 bag convert'),
        ({'relative_file_paths': ['no_0.mcap']}, 'every file .* is missing .no_0.mcap'),
    ],
)
def test_a_folder_whose_files_are_of_another_kind_or_gone_is_named(tmp_path, changes, says):
    edited(tmp_path, **changes)
    (tmp_path / 'bag/bag_0.mcap').unlink()
    with pytest.raises(BagError, match=says) as caught:
        open_bag(tmp_path / 'bag')
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(
    'changes',
    [
        {'storage_identifier': ''},
        {'storage_identifier': None},
        {'storage_identifier': 'sqlite3'},
        {'compression_mode': 'FILE', 'compression_format': 'zstd'},
        {'compression_mode': 'message', 'compression_format': 'zstd'},
        {'relative_file_paths': None, 'files': None},
    ],
)
def test_the_disk_comes_before_what_metadata_says(tmp_path, changes):
    edited(tmp_path, **changes)
    bag = open_bag(tmp_path / 'bag')
    assert len(everything(bag)) == bag.message_count == 11
    repair(tmp_path / 'bag', tmp_path / 'made')
    made = open_bag(tmp_path / 'made')
    assert everything(made) == everything(bag)
    assert made.complete
    assert made.metadata.compression_mode == ''  # its messages and files are not compressed
    assert made.metadata.storage == 'mcap'


@pytest.mark.parametrize(
    ('name', 'content', 'says'),
    [
        ('a.mcap', b'', 'is empty'),
        ('a.mcap', b'\x00' * 100_000, 'no MCAP file'),
        ('a.mcap', b'hello', 'no MCAP file'),
        ('a.db3', b'SQLite format 3\0' * 9, 'sqlite3 bag.*ros2 bag convert'),
        ('a.mcap.zstd', b'\x28\xb5\x2f\xfd' * 9, 'the compressed file is damaged'),
        ('a.mcap.lz4', b'\x04\x22\x4d\x18' * 9, 'the compressed file is damaged'),
        ('a.bag', b'#ROSBAG V2.0\n', 'ROS 1'),
    ],
)
def test_what_is_no_bag_is_named(tmp_path, name, content, says):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(BagError, match=says) as caught:
        open_bag(tmp_path / name)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(
    ('names', 'says'),
    [
        ([], 'no .mcap file'),
        (['a_0.db3'], 'sqlite3'),
        (['a_0.mcap.zstd'], 'is empty'),
    ],
)
def test_a_folder_that_is_no_bag_is_named(tmp_path, names, says):
    for name in names:
        (tmp_path / name).touch()
    with pytest.raises(BagError, match=says):
        open_bag(tmp_path)


def test_what_is_not_there_is_named(tmp_path):
    with pytest.raises(BagError, match='there is no such bag'):
        open_bag(tmp_path / 'bag')


def test_messages_that_cannot_be_decoded_are_named(tmp_path):
    with (tmp_path / 'a.mcap').open('wb') as file:
        writer = Writer(file)
        writer.start('ros2', 'others')
        json_schema = writer.register_schema('Odd', 'jsonschema', b'{}')
        writer.add_message(writer.register_channel('/odd', 'json', json_schema), 1, b'{}', 1)
        string = writer.register_schema(STRING, 'ros2msg', b'string data')
        writer.add_message(writer.register_channel('/cut', 'cdr', string), 2, b'\0\1\0\0\xff', 2)
        writer.finish()
    bag = open_bag(tmp_path / 'a.mcap')
    assert bag.message_count == 2
    assert len(list(bag.raw())) == 2
    with pytest.raises(BagError, match="/odd: messages in 'json'"):
        list(bag.messages(['/odd']))
    with pytest.raises(BagError, match='/cut at 2 ns is no std_msgs/msg/String'):
        list(bag.messages(['/cut']))


@pytest.mark.parametrize('wrong', ['channel of a chunk', 'count'])
def test_an_index_that_contradicts_itself_is_not_believed(tmp_path, wrong):
    """A reader would skip messages, and call the bag complete; all checksums are right."""
    path = tmp_path / 'a.mcap'
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=400)
        writer.start('ros2')
        schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data')
        a, b = (writer.register_channel(name, 'cdr', schema) for name in ('/a', '/b'))
        for n in range(200):
            writer.add_message(a if n % 2 else b, n, bytes(20), n)
        chunks = writer._Writer__chunk_indices
        assert len(chunks) > 10
        if wrong == 'count':
            counts = writer._Writer__statistics.channel_message_counts
            counts[a], counts[b] = 90, 110
        else:
            del chunks[1].message_index_offsets[a]
        writer.finish()
    bag = open_bag(path)
    assert {t.name: t.message_count for t in bag.topics} == {'/a': 100, '/b': 100}
    assert sum(1 for _ in bag.raw(['/a'])) == 100
