"""A bag is laid out as rosbag2 Jazzy lays it out, and other readers read every message of it."""

import json
from pathlib import Path

from mcap import records
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import get_types_from_msg
import yaml

from bags.making import (
    ODOMETRIES,
    ODOMETRY,
    START,
    STEP,
    STRING,
    TYPES,
    topic,
    write_bag,
)
from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.topic import INFINITE, Qos, Topic, parse_qos, qos_yaml
from disc_sim_ros.bags.writer import BagWriter

pytest.importorskip('rclpy')  # the definitions of messages come with it

COUNT = 2500
# rosbag2_storage: convert<BagMetadata> of Jazzy demands each of these of version 9.
FIELDS = [
    'version',
    'storage_identifier',
    'duration',
    'starting_time',
    'message_count',
    'topics_with_message_count',
    'compression_format',
    'compression_mode',
    'relative_file_paths',
    'files',
    'custom_data',
    'ros_distro',
]
TOPIC_FIELDS = [
    'name',
    'type',
    'serialization_format',
    'offered_qos_profiles',
    'type_description_hash',
]
QOS_FIELDS = [
    'history',
    'depth',
    'reliability',
    'durability',
    'deadline',
    'lifespan',
    'liveliness',
    'liveliness_lease_duration',
    'avoid_ros_namespace_conventions',
]


@pytest.fixture(scope='module')
def folder(tmp_path_factory) -> Path:
    """A bag of two files."""
    path = tmp_path_factory.mktemp('bags') / 'throw 1'
    custom = {'drops': '0', 'note': 'a: "b"\n\tü'}
    write_bag(path, COUNT, split_at=(1700,), custom_data=custom, ros_distro='jazzy')
    return path


def raw_records(path: Path) -> list:
    with path.open('rb') as file:
        return list(StreamReader(file, emit_chunks=True, validate_crcs=True).records)


# ---- metadata.yaml ----


def test_files_are_named_after_the_folder(folder):
    assert sorted(p.name for p in folder.iterdir()) == [
        'metadata.yaml',
        'throw 1_0.mcap',
        'throw 1_1.mcap',
    ]


def test_metadata_has_every_field_in_its_order_and_type(folder):
    root = yaml.safe_load((folder / 'metadata.yaml').read_text(encoding='utf-8'))
    assert list(root) == ['rosbag2_bagfile_information']
    about = root['rosbag2_bagfile_information']
    assert list(about) == FIELDS
    assert about['version'] == 9
    assert about['storage_identifier'] == 'mcap'
    assert about['starting_time'] == {'nanoseconds_since_epoch': START}
    assert about['duration'] == {'nanoseconds': (COUNT - 1) * STEP}
    assert about['message_count'] == COUNT + COUNT // 10
    assert about['compression_format'] == about['compression_mode'] == ''
    assert about['relative_file_paths'] == ['throw 1_0.mcap', 'throw 1_1.mcap']
    assert about['custom_data'] == {'drops': '0', 'note': 'a: "b"\n\tü'}
    assert about['ros_distro'] == 'jazzy'


def test_metadata_describes_each_topic(folder):
    root = yaml.safe_load((folder / 'metadata.yaml').read_text(encoding='utf-8'))
    topics = root['rosbag2_bagfile_information']['topics_with_message_count']
    assert [t['message_count'] for t in topics] == [COUNT, COUNT // 10, 0]
    for t in topics:
        assert list(t) == ['topic_metadata', 'message_count']
        assert list(t['topic_metadata']) == TOPIC_FIELDS
    odom = topics[0]['topic_metadata']
    assert odom['name'] == '/odom'
    assert odom['type'] == ODOMETRY
    assert odom['serialization_format'] == 'cdr'
    assert odom['type_description_hash'] == TYPES.hash_rihs01(ODOMETRY)
    (profile,) = odom['offered_qos_profiles']
    assert list(profile) == QOS_FIELDS
    assert profile['history'] == 'keep_last'
    assert profile['depth'] == 1000
    assert profile['deadline'] == {'sec': 9223372036, 'nsec': 854775807}
    assert profile['avoid_ros_namespace_conventions'] is False
    assert topics[2]['topic_metadata']['offered_qos_profiles'] == []


def test_metadata_describes_each_file(folder):
    root = yaml.safe_load((folder / 'metadata.yaml').read_text(encoding='utf-8'))
    assert root['rosbag2_bagfile_information']['files'] == [
        {
            'path': 'throw 1_0.mcap',
            'starting_time': {'nanoseconds_since_epoch': START},
            'duration': {'nanoseconds': 1699 * STEP},
            'message_count': 1700 + 170,
        },
        {
            'path': 'throw 1_1.mcap',
            'starting_time': {'nanoseconds_since_epoch': START + 1700 * STEP},
            'duration': {'nanoseconds': (COUNT - 1701) * STEP},
            'message_count': (COUNT - 1700) + (COUNT - 1700) // 10,
        },
    ]


def test_a_bag_without_messages_has_the_times_of_rosbag2(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        bag.add(topic('/odom', ODOMETRY))
    root = yaml.safe_load((tmp_path / 'bag/metadata.yaml').read_text(encoding='utf-8'))
    about = root['rosbag2_bagfile_information']
    assert about['starting_time'] == {'nanoseconds_since_epoch': 2**63 - 1}
    assert about['duration'] == {'nanoseconds': 0}
    assert about['custom_data'] is None
    assert about['ros_distro'] == ''  # not known
    opened = open_bag(tmp_path / 'bag')
    assert (opened.complete, opened.message_count, opened.start, opened.end) == (True, 0, 0, 0)


@pytest.mark.parametrize(
    'value', ['', '~', 'true', '1', "'", ' a ', 'a # b', '\x00\x7f\u2028', '🥏']
)
def test_any_text_survives_in_custom_data(tmp_path, value):
    with BagWriter(tmp_path / 'bag', custom_data={'first': value}) as bag:
        bag.custom(f'key {value}', value)
    root = yaml.safe_load((tmp_path / 'bag/metadata.yaml').read_text(encoding='utf-8'))
    custom = root['rosbag2_bagfile_information']['custom_data']
    assert custom == {'first': value, f'key {value}': value}
    assert open_bag(tmp_path / 'bag').custom_data == custom


# ---- MCAP ----


def test_records_stand_in_the_order_of_rosbag2(folder):
    all_records = raw_records(folder / 'throw 1_0.mcap')
    kinds = [type(r).__name__ for r in all_records]
    chunks = kinds.count('Chunk')
    assert chunks >= 2
    assert kinds[:2] == ['Header', 'Metadata']
    data = kinds[2 : kinds.index('DataEnd')]
    # Behind the chunks the channel without messages; its schema is in the first chunk.
    assert data == ['Chunk', 'MessageIndex', 'MessageIndex'] * chunks + ['Channel', 'Metadata']
    assert kinds[kinds.index('DataEnd') :] == [
        'DataEnd',
        *['Schema'] * 2,
        *['Channel'] * 3,
        'Statistics',
        *['ChunkIndex'] * chunks,
        *['MetadataIndex'] * 2,
        *['SummaryOffset'] * 5,
        'Footer',
    ]


def test_header_metadata_channels_and_schemas_say_what_rosbag2_says(folder):
    all_records = raw_records(folder / 'throw 1_1.mcap')
    assert next(r for r in all_records if isinstance(r, records.Header)).profile == 'ros2'
    opened, closed = (r for r in all_records if isinstance(r, records.Metadata))
    for record in (opened, closed):
        assert record.name == 'rosbag2'
        assert list(record.metadata) == ['serialized_metadata']
        about = yaml.safe_load(record.metadata['serialized_metadata'])
        assert list(about) == FIELDS  # without the root, or rosbag2 plays nothing
    channel = next(r for r in all_records if isinstance(r, records.Channel) and r.topic == '/odom')
    assert channel.message_encoding == 'cdr'
    assert channel.metadata == {
        'offered_qos_profiles': qos_yaml([Qos(depth=1000)]),
        'topic_type_hash': TYPES.hash_rihs01(ODOMETRY),
    }
    schema = next(r for r in all_records if isinstance(r, records.Schema) and r.name == ODOMETRY)
    assert schema.encoding == 'ros2msg'
    assert schema.data.decode() == schemas.definition(ODOMETRY)


def test_chunks_are_of_768_kib_and_sequences_0(folder):
    all_records = raw_records(folder / 'throw 1_0.mcap')
    chunks = [r for r in all_records if isinstance(r, records.Chunk)]
    assert {c.compression for c in chunks} == {'zstd'}
    full = chunks[0].uncompressed_size
    assert 768 * 1024 <= full < 768 * 1024 + len(ODOMETRIES[0]) + 31
    with (folder / 'throw 1_0.mcap').open('rb') as file:
        for record in StreamReader(file, validate_crcs=True).records:
            if isinstance(record, records.Message):
                assert record.sequence == 0


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'none'])
def test_each_compression_is_read_back(tmp_path, compression):
    write_bag(tmp_path / 'bag', 300, compression=compression)
    with (tmp_path / 'bag/bag_0.mcap').open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        assert sum(1 for _ in reader.iter_messages()) == 330
    with Reader(tmp_path / 'bag') as reader:
        assert sum(1 for _ in reader.messages()) == 330


def test_a_type_that_is_not_installed_has_a_schema_without_text(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        odd = bag.add(Topic(name='/odd', type='odd_msgs/msg/Odd'))
        empty = bag.add(topic('/empty', 'std_msgs/msg/Empty'))
        bag.write(odd, b'\0\1\0\0\0', 1, 1)
        bag.write(empty, b'\0\1\0\0\0', 2, 2)
    all_records = raw_records(tmp_path / 'bag/bag_0.mcap')
    about = {r.name: (r.encoding, r.data) for r in all_records if isinstance(r, records.Schema)}
    # No encoding: no definition is there. An empty text defines a message without fields.
    assert about == {'odd_msgs/msg/Odd': ('', b''), 'std_msgs/msg/Empty': ('ros2msg', b'')}
    assert [m.type for m in open_bag(tmp_path / 'bag').messages(['/empty'])] == [
        'std_msgs/msg/Empty'
    ]


# ---- definitions and hashes ----


def test_a_definition_has_its_parts_in_the_order_of_rosbag2():
    text = schemas.definition(ODOMETRY)
    rule = '\n' + '=' * 80 + '\nMSG: '
    root, *parts = text.split(rule)
    assert [part.split('\n', 1)[0] for part in parts] == [
        'geometry_msgs/PoseWithCovariance',
        'geometry_msgs/Pose',
        'geometry_msgs/Point',
        'geometry_msgs/Quaternion',
        'geometry_msgs/TwistWithCovariance',
        'geometry_msgs/Twist',
        'geometry_msgs/Vector3',
        'std_msgs/Header',
        'builtin_interfaces/Time',
    ]
    [share] = [p / 'share' for p in schemas.prefixes() if (p / 'share/nav_msgs').is_dir()][:1]
    assert root == (share / 'nav_msgs/msg/Odometry.msg').read_text(encoding='utf-8')
    pose = (share / 'geometry_msgs/msg/Pose.msg').read_text(encoding='utf-8')
    assert parts[1] == f'geometry_msgs/Pose\n{pose}'


def installed_types() -> list[str]:
    paths = [path for p in schemas.prefixes() for path in sorted(p.glob('share/*/msg/*.msg'))]
    return [f'{path.parts[-3]}/msg/{path.stem}' for path in paths]


def test_definitions_of_all_installed_types_hold_all_that_they_need():
    names = installed_types()
    assert len(names) > 100
    for name in names:
        text = schemas.definition(name)
        parsed = get_types_from_msg(text, name)
        assert name in parsed
        for _, fields in parsed.values():
            for _, kind in fields:
                while kind[0] in {3, 4}:  # an array or a sequence of something
                    kind = kind[1][0]  # noqa: PLW2901
                assert kind[0] == 1 or kind[1] in parsed, (name, kind)


def test_type_hashes_are_those_that_rosbags_computes():
    # rosbags computes other hashes for types with char, which ROS takes for uint8.
    odd = ('rmw_dds_common/', 'service_msgs/', 'std_msgs/msg/Char')
    names = [n for n in installed_types() if n in TYPES.types and not n.startswith(odd)]
    assert len(names) > 80
    wrong = [n for n in names if schemas.type_hash(n) != TYPES.hash_rihs01(n)]
    assert not wrong


@pytest.mark.parametrize('name', ['', 'Odometry', 'nav_msgs/msg/No', '../x/msg/Y', 'a/b/c/d'])
def test_what_is_not_installed_has_no_definition(name):
    assert schemas.definition(name) is None
    assert schemas.type_hash(name) is None


# ---- quality of service ----


@pytest.mark.parametrize(
    'profiles',
    [
        (),
        (Qos(),),
        (Qos(history='keep_all', depth=0, reliability='best_effort', deadline=1_500_000_001),
         Qos(durability='transient_local', liveliness='manual_by_topic', lifespan=0,
             liveliness_lease_duration=INFINITE, avoid_ros_namespace_conventions=True)),
    ],
)  # fmt: skip
def test_qos_comes_back(profiles):
    assert parse_qos(qos_yaml(profiles)) == profiles


def test_qos_of_bags_before_jazzy_is_understood():
    old = (
        '- history: 1\n  depth: 7\n  reliability: 2\n  durability: 1\n'
        '  deadline:\n    sec: 2147483647\n    nsec: 4294967295\n'
        '  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n'
        '  liveliness_lease_duration:\n    sec: 1\n    nsec: 5\n'
        '  avoid_ros_namespace_conventions: false'
    )
    assert parse_qos(old) == (
        Qos(
            depth=7,
            reliability='best_effort',
            durability='transient_local',
            liveliness_lease_duration=1_000_000_005,
        ),
    )


# ---- other readers ----


def test_rosbags_reads_every_message(folder):
    numbers = []
    with Reader(folder) as reader:
        assert reader.message_count == COUNT + COUNT // 10
        assert reader.ros_distro == 'jazzy'
        for connection, _, data in reader.messages():
            value = TYPES.deserialize_cdr(data, connection.msgtype)
            if connection.topic == '/odom':
                numbers.append(value.pose.pose.position.x)
                assert connection.ext.offered_qos_profiles[0].depth == 1000
    assert numbers == [n % len(ODOMETRIES) for n in range(COUNT)]


def test_mcap_and_mcap_ros2_read_every_message(folder):
    times = []
    for path in (folder / 'throw 1_0.mcap', folder / 'throw 1_1.mcap'):
        with path.open('rb') as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for _, channel, message, value in reader.iter_decoded_messages():
                if channel.topic == '/odom':
                    n = (message.log_time - START) // STEP
                    assert value.pose.pose.position.x == n % len(ODOMETRIES)
                    times.append((message.log_time, message.publish_time))
    assert times == [(START + n * STEP, START + n * STEP - 5) for n in range(COUNT)]


def test_foxglove_reads_every_message(folder, foxglove):
    files = foxglove(folder / 'throw 1_0.mcap', folder / 'throw 1_1.mcap')
    assert [f['profile'] for f in files] == ['ros2', 'ros2']
    odom = [f['topics']['/odom'] for f in files]
    assert [t['count'] for t in odom] == [1700, COUNT - 1700]
    assert odom[0]['type'] == ODOMETRY
    assert odom[0]['first']['value']['pose']['pose']['position']['x'] == 0
    assert odom[1]['last']['value']['pose']['pose']['position']['x'] == (COUNT - 1) % len(
        ODOMETRIES
    )
    assert odom[0]['first']['value']['child_frame_id'] == 'disc'
    assert int(odom[1]['last']['logTime']) == START + (COUNT - 1) * STEP
    assert int(odom[1]['last']['publishTime']) == START + (COUNT - 1) * STEP - 5
    log = files[1]['topics']['/log']
    assert log['type'] == STRING
    assert log['last']['value'] == {'data': f'message {COUNT - 10}'}
    assert files[0]['topics']['/silent']['count'] == 0


def test_the_lock_of_the_foxglove_readers_names_no_registry():
    lock = json.loads(Path(__file__).with_name('js').joinpath('package-lock.json').read_text())
    assert lock['packages']
    assert not any('resolved' in package for package in lock['packages'].values())
