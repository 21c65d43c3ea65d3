"""Definitions are copied as they are; only missing ones are filled."""

from contextlib import suppress
from pathlib import Path
import sys

from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Channel, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
import pytest
from rclpy.serialization import serialize_message
from rosbags.rosbag2 import Reader
from std_srvs.srv import Empty, SetBool, Trigger
import yaml

from bags.making import ODOMETRIES, ODOMETRY, START, STRING, everything, text, topic, write_bag
from disc_sim_ros.bags import metadata, schemas
from disc_sim_ros.bags.mcap_reader import indexed
from disc_sim_ros.bags.mcap_writer import McapFile
from disc_sim_ros.bags.metadata import BagMetadata
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.topic import Qos, Topic, qos_yaml
from disc_sim_ros.bags.writer import BagWriter

CDR_EMPTY = b'\0\1\0\0\0'
BINARY = bytes(range(256))
# Topic, encoding of its messages, schema (name, encoding, data) or None, a message.
FOREIGN = [
    ('/odom', 'cdr', (ODOMETRY, 'ros2msg', schemas.definition(ODOMETRY).encode()), ODOMETRIES[0]),
    ('/stop', 'cdr', ('my_robot_msgs/msg/Stop', 'ros2msg', b''), CDR_EMPTY),
    ('/idl', 'cdr', ('my_msgs/msg/X', 'ros2idl', b'module my_msgs {};'), CDR_EMPTY),
    ('/log', 'json', ('foxglove.Log', 'jsonschema', b'{"type":"object"}'), b'{}'),
    ('/log_empty', 'json', ('anything', 'jsonschema', b''), b'{}'),
    ('/free', 'json', None, b'{}'),
    ('/free_cdr', 'cdr', None, CDR_EMPTY),
    ('/pb', 'protobuf', ('x.Y', 'protobuf', BINARY), b'\x08\1'),
    ('/none', 'cdr', ('my_msgs/msg/Unknown', '', b''), CDR_EMPTY),
]


def foreign_file(path: Path, *, end: bool, topics=FOREIGN) -> None:
    with path.open('wb') as file:
        writer = Writer(file, use_chunking=end)
        writer.start(profile='', library='theirs')
        for number, (name, encoding, schema, data) in enumerate(topics):
            schema_id = 0
            if schema is not None:
                schema_id = writer.register_schema(schema[0], schema[1], schema[2])
            channel = writer.register_channel(name, encoding, schema_id, {'theirs': str(number)})
            writer.add_message(channel, START + number, data, START, number)
        if end:
            writer.finish()
        else:
            writer.flush()


def definitions(path: Path) -> dict[str, tuple]:
    """Name of the topic: its channel and its schema, by the official reader."""
    schemas_found: dict[int, Schema] = {}
    texts = {}
    with path.open('rb') as file, suppress(EndOfFile):
        for record in StreamReader(file).records:
            if isinstance(record, Schema):
                schemas_found[record.id] = record
            elif isinstance(record, Channel):
                schema = schemas_found.get(record.schema_id)
                texts[record.topic] = (
                    record.id,
                    record.schema_id,
                    record.message_encoding,
                    record.metadata,
                    schema and (schema.name, schema.encoding, schema.data),
                )
    return texts


@pytest.mark.parametrize('end', [True, False])
def test_schemas_and_encodings_of_others_are_copied_as_they_are(tmp_path, end):
    foreign_file(tmp_path / 'x.mcap', end=end)
    report = repair(tmp_path / 'x.mcap', tmp_path / 'made')
    assert report.message_count == len(FOREIGN)
    made = definitions(tmp_path / 'made/made_0.mcap')
    assert made == definitions(tmp_path / 'x.mcap')
    assert made['/free'][1] == made['/free_cdr'][1] == 0
    types = {info.name: info.type for info in open_bag(tmp_path / 'made').topics}
    assert types == {name: schema[0] if schema else '' for name, _, schema, _ in FOREIGN}


def test_rosbags_opens_a_repaired_bag_with_a_type_that_is_not_installed(tmp_path):
    foreign_file(tmp_path / 'x.mcap', end=False, topics=[FOREIGN[0], FOREIGN[1], FOREIGN[8]])
    content = (tmp_path / 'x.mcap').read_bytes()
    ros = content.replace(b'\0\0\0\0\x06\0\0\0theirs', b'\x04\0\0\0ros2\x02\0\0\0th', 1)
    (tmp_path / 'x.mcap').write_bytes(ros)
    repair(tmp_path / 'x.mcap', tmp_path / 'made')
    with Reader(tmp_path / 'made') as reader:
        counts = {c.topic: (c.msgtype, c.msgcount) for c in reader.connections}
    assert counts == {
        '/odom': (ODOMETRY, 1),
        '/stop': ('my_robot_msgs/msg/Stop', 1),
        '/none': ('my_msgs/msg/Unknown', 1),
    }


@pytest.mark.parametrize('encoding', ['', 'unknown'])
@pytest.mark.parametrize('end', [True, False])
def test_a_missing_definition_is_filled_where_the_type_is_installed(tmp_path, encoding, end):
    topics = [
        ('/odom', 'cdr', (ODOMETRY, encoding, b''), ODOMETRIES[3]),
        ('/short', 'cdr', ('std_msgs/String', encoding, b''), text('a')),
        ('/log', 'json', ('std_msgs/msg/String', encoding, b''), b'{}'),
    ]
    foreign_file(tmp_path / 'x.mcap', end=end, topics=topics)
    report = repair(tmp_path / 'x.mcap', tmp_path / 'made')
    assert report.message_count == 3
    made = definitions(tmp_path / 'made/made_0.mcap')
    assert made['/odom'][4] == (ODOMETRY, 'ros2msg', schemas.definition(ODOMETRY).encode())
    assert made['/short'][4] == ('std_msgs/String', 'ros2msg', schemas.definition(STRING).encode())
    assert made['/log'][4] == ('std_msgs/msg/String', encoding, b'')  # not for ros2msg
    [message] = open_bag(tmp_path / 'made').messages(['/odom'])
    assert message.value.pose.pose.position.x == 3.0


def test_a_type_that_only_metadata_names_survives(tmp_path):
    """Channels without a schema, and topics without messages, as a killed recorder leaves them."""
    folder = tmp_path / 'bag'
    folder.mkdir()
    foreign_file(folder / 'bag_0.mcap', end=True, topics=[
        ('/odom', 'cdr', None, ODOMETRIES[5]), ('/odd', 'cdr', None, CDR_EMPTY)])  # fmt: skip
    named = [('/odom', ODOMETRY, 1), ('/odd', 'odd_msgs/msg/Odd', 1), ('/silent', STRING, 0),
            ('/silent_odd', 'odd_msgs/msg/Even', 0)]  # fmt: skip
    about = BagMetadata(
        topics=tuple(
            metadata.TopicInfo(topic=Topic(name=n, type=t), message_count=c) for n, t, c in named
        ),
        files=(metadata.FileInfo(path='bag_0.mcap', message_count=2, start=START, end=START + 1),),
    )
    (folder / 'metadata.yaml').write_text(metadata.text_of(about), encoding='utf-8')
    before = open_bag(folder)
    assert {t.name: t.type for t in before.topics} == {n: t for n, t, _ in named}
    assert [m.value.pose.pose.position.x for m in before.messages('/odom')] == [5.0]
    repair(folder, tmp_path / 'made')
    made = open_bag(tmp_path / 'made')
    assert {t.name: (t.type, t.message_count) for t in made.topics} == {
        n: (t, c) for n, t, c in named
    }
    schema = {n: d[4] for n, d in definitions(tmp_path / 'made/made_0.mcap').items()}
    assert schema['/odom'] == (ODOMETRY, 'ros2msg', schemas.definition(ODOMETRY).encode())
    assert schema['/odd'] == ('odd_msgs/msg/Odd', '', b'')
    [message] = open_bag(tmp_path / 'made/made_0.mcap').messages('/odom')
    assert message.value.pose.pose.position.x == 5.0


def test_topics_without_messages_of_a_killed_bag_keep_their_types(tmp_path):
    bag = BagWriter(tmp_path / 'bag')
    log = bag.add(topic('/log', STRING))
    bag.add(topic('/silent', ODOMETRY))
    bag.write(log, text('a'), 1, 1)
    bag.flush()
    repair(tmp_path / 'bag', tmp_path / 'made')
    bag.close()
    made = definitions(tmp_path / 'made/made_0.mcap')
    assert made['/silent'][4] == (ODOMETRY, 'ros2msg', schemas.definition(ODOMETRY).encode())
    with Reader(tmp_path / 'made') as reader:
        assert {c.topic: c.msgcount for c in reader.connections} == {'/log': 1, '/silent': 0}


def test_every_definition_is_in_the_data_section_of_every_file(tmp_path):
    bag = write_bag(tmp_path / 'bag', 300, split_at=(100, 200))
    for path in bag.files:
        sections: dict[str, list] = {'data': [], 'summary': []}
        section = 'data'
        with path.open('rb') as file:
            for record in StreamReader(file).records:
                if type(record).__name__ == 'DataEnd':
                    section = 'summary'
                if isinstance(record, (Channel, Schema)) and record not in sections[section]:
                    sections[section].append(record)
        for record in sections['summary']:
            assert record in sections['data']
        assert {c.topic for c in sections['data'] if isinstance(c, Channel)} == {
            '/odom',
            '/log',
            '/silent',
        }


def test_definitions_that_stand_in_the_summary_alone_are_put_into_the_data(tmp_path):
    """As the C++ library leaves channels without messages."""
    path = tmp_path / 'x.mcap'
    with path.open('wb') as file:
        writer = Writer(file)
        writer.start('ros2', 'theirs')
        schema = writer.register_schema(STRING, 'ros2msg', b'string data')
        channel = writer.register_channel('/log', 'cdr', schema)
        writer.add_message(channel, 1, text('a'), 1)
        writer._Writer__channels[7] = Channel(7, '/silent', 'cdr', {}, schema)
        writer.finish()
    assert indexed(path) is not None  # its statistics count the other channel alone
    report = repair(path, tmp_path / 'made')
    assert any('summary' in line for line in report.mended)
    with (tmp_path / 'made/made_0.mcap').open('rb') as file:
        section = []
        for record in StreamReader(file).records:
            if type(record).__name__ == 'DataEnd':
                break
            section += [record.topic] if isinstance(record, Channel) else []
    assert set(section) == {'/log', '/silent'}


# ---- messages without fields, services, actions ----


def test_a_message_without_fields_has_a_definition():
    assert schemas.definition('std_msgs/msg/Empty') == ''
    assert schemas.definition('no_msgs/msg/Empty') is None


def event(kind, request, response) -> bytes:
    message = kind.Event()
    message.info.sequence_number = 7
    message.request = [kind.Request(**request)] if request is not None else []
    message.response = [kind.Response(**response)] if response is not None else []
    return serialize_message(message)


def test_events_of_services_are_defined_from_their_srv_file(tmp_path, foxglove):
    events = {
        '/a/_service_event': (Trigger, {}, {'success': True, 'message': 'hey'}),
        '/b/_service_event': (SetBool, {'data': True}, None),
        '/c/_service_event': (Empty, {}, {}),
    }
    with BagWriter(tmp_path / 'bag') as bag:
        for number, (name, (kind, *sides)) in enumerate(events.items()):
            about = topic(name, f'std_srvs/srv/{kind.__name__}_Event')
            assert about.type_hash.startswith('RIHS01_')
            bag.write(bag.add(about), event(kind, *sides), START + number, START)
    values = [m.value for m in open_bag(tmp_path / 'bag').messages()]
    assert [v.info.sequence_number for v in values] == [7, 7, 7]
    assert [len(v.request) for v in values] == [len(v.response) or 1 for v in values] == [1, 1, 1]
    assert values[0].response[0].message == 'hey'
    assert values[1].request[0].data is True
    [file] = foxglove(tmp_path / 'bag/bag_0.mcap')
    trigger = file['topics']['/a/_service_event']['last']['value']
    assert trigger['response'] == [{'success': True, 'message': 'hey'}]
    assert trigger['request'] == [{}]
    with Reader(tmp_path / 'bag') as reader:
        assert sum(1 for _ in reader.messages()) == 3


def test_an_event_that_rosbag2_defines_by_its_srv_file_is_decoded(tmp_path):
    path = tmp_path / 'x.mcap'
    srv = Path(sys.prefix, 'share/std_srvs/srv/SetBool.srv').read_bytes()
    data = b'=' * 80 + b'\nSRV: std_srvs/srv/SetBool\n' + srv
    schema = ('std_srvs/srv/SetBool_Event', 'ros2msg', data)
    foreign_file(
        path, end=True, topics=[('/e', 'cdr', schema, event(SetBool, {'data': True}, None))]
    )
    [message] = open_bag(path).messages()
    assert message.value.request[0].data is True


def test_messages_of_actions_are_defined_from_their_action_file(tmp_path, monkeypatch):
    folder = tmp_path / 'share/my_msgs/action'
    folder.mkdir(parents=True)
    (folder / 'Fly.action').write_text('float64 far\n---\nbool done\n---\nfloat64 now\n')
    uuid = tmp_path / 'share/unique_identifier_msgs/msg'
    uuid.mkdir(parents=True)
    (uuid / 'UUID.msg').write_text('uint8[16] uuid\n')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    schemas.definition.cache_clear()
    rule = '\n' + '=' * 80 + '\nMSG: '
    assert schemas.definition('my_msgs/action/Fly_FeedbackMessage') == (
        'unique_identifier_msgs/UUID goal_id\nFly_Feedback feedback\n'
        f'{rule}my_msgs/Fly_Feedback\nfloat64 now\n'
        f'{rule}unique_identifier_msgs/UUID\nuint8[16] uuid\n'
    )
    event = schemas.definition('my_msgs/action/Fly_SendGoal_Event')
    for part in ('Fly_SendGoal_Request[<=1] request', 'MSG: my_msgs/Fly_Goal\nfloat64 far'):
        assert part in event
    assert schemas.definition('my_msgs/action/Fly_Nothing') is None
    schemas.definition.cache_clear()


# ---- the record of rosbag2 ----


def old_bag(folder: Path) -> None:
    """A bag as version 0.1 wrote it: the record has the root of metadata.yaml."""
    with BagWriter(folder, custom_data={'a': 'b'}, ros_distro='jazzy') as bag:
        odom = bag.add(topic('/odom', ODOMETRY))
        for n in range(10):
            bag.write(odom, ODOMETRIES[n], START + n, START)
    path = folder / f'{folder.name}_0.mcap'
    definition = bag._metadata.definitions[odom]
    path.unlink()
    file = McapFile(path, 'zstd')
    about = (folder / 'metadata.yaml').read_text(encoding='utf-8')
    file.add_metadata('rosbag2', {'serialized_metadata': about})
    for n in range(10):
        file.write(definition, ODOMETRIES[n], START + n, START, 0)
    file.end_chunk()
    file.add_metadata('rosbag2', {'serialized_metadata': about})
    file.finish()
    file.close()


def records_of(path: Path) -> list[dict]:
    with path.open('rb') as file:
        entries = make_reader(file).iter_metadata()
        return [yaml.safe_load(m.metadata['serialized_metadata']) for m in entries]


def test_a_bag_of_version_0_1_gets_the_record_that_rosbag2_plays(tmp_path):
    old_bag(tmp_path / 'old')
    assert all('version' not in r for r in records_of(tmp_path / 'old/old_0.mcap'))
    assert open_bag(tmp_path / 'old/old_0.mcap').custom_data == {'a': 'b'}  # both forms are read
    report = repair(tmp_path / 'old', tmp_path / 'made')
    assert any('metadata record' in line for line in report.mended)
    assert not report.losses
    records = records_of(tmp_path / 'made/made_0.mcap')
    assert len(records) == 2
    for record in records:
        assert record['version'] == 9
        assert record['custom_data'] == {'a': 'b'}
        assert record['ros_distro'] == 'jazzy'
    assert records[-1]['message_count'] == 10
    assert everything(open_bag(tmp_path / 'made')) == everything(open_bag(tmp_path / 'old'))


@pytest.mark.parametrize('distro', ['humble', ''])
def test_distro_and_custom_data_of_a_lone_file_survive(tmp_path, distro):
    write_bag(tmp_path / 'bag', 30, custom_data={'a': 'b'}, ros_distro=distro)
    content = (tmp_path / 'bag/bag_0.mcap').read_bytes()
    (tmp_path / 'x.mcap').write_bytes(content[:-40])
    repair(tmp_path / 'x.mcap', tmp_path / 'made')
    root = yaml.safe_load((tmp_path / 'made/metadata.yaml').read_text(encoding='utf-8'))
    assert root['rosbag2_bagfile_information']['ros_distro'] == distro
    assert root['rosbag2_bagfile_information']['custom_data'] == {'a': 'b'}
    assert records_of(tmp_path / 'made/made_0.mcap')[-1]['ros_distro'] == distro


def test_distro_and_custom_data_that_a_reindex_dropped_are_taken_from_the_record(tmp_path):
    write_bag(tmp_path / 'bag', 30, custom_data={'a': 'b'}, ros_distro='jazzy')
    path = tmp_path / 'bag/metadata.yaml'
    root = yaml.safe_load(path.read_text(encoding='utf-8'))
    root['rosbag2_bagfile_information'] |= {'custom_data': None, 'ros_distro': ''}
    path.write_text(yaml.safe_dump(root, sort_keys=False), encoding='utf-8')
    repair(tmp_path / 'bag', tmp_path / 'made')
    for folder in ('bag', 'made'):
        about = open_bag(tmp_path / folder).metadata
        assert (about.custom_data, about.ros_distro) == ({'a': 'b'}, 'jazzy')


def test_the_distro_that_older_recorders_kept_beside_the_text_survives(tmp_path):
    path = tmp_path / 'x.mcap'
    about = metadata.record_of(BagMetadata())['serialized_metadata']
    with path.open('wb') as file:
        writer = Writer(file)
        writer.start('ros2', 'theirs')
        schema = writer.register_schema(STRING, 'ros2msg', b'string data')
        channel = writer.register_channel('/log', 'cdr', schema)
        writer.add_message(channel, 1, text('a'), 1)
        writer.add_metadata('rosbag2', {'serialized_metadata': about, 'ROS_DISTRO': 'iron'})
        writer.finish()
    repair(path, tmp_path / 'made')
    assert open_bag(tmp_path / 'made').metadata.ros_distro == 'iron'


def test_a_bag_without_a_known_distro_gets_none(tmp_path):
    foreign_file(tmp_path / 'x.mcap', end=False)
    repair(tmp_path / 'x.mcap', tmp_path / 'made')
    assert open_bag(tmp_path / 'made').metadata.ros_distro == ''


def test_qos_of_an_old_bag_that_differs_between_metadata_and_files_is_made_one(tmp_path):
    """Version 0.1 kept publishers that came later in metadata.yaml alone."""
    old_bag(tmp_path / 'old')
    path = tmp_path / 'old/metadata.yaml'
    root = yaml.safe_load(path.read_text(encoding='utf-8'))
    about = root['rosbag2_bagfile_information']['topics_with_message_count'][0]['topic_metadata']
    about['offered_qos_profiles'] = yaml.safe_load(qos_yaml([Qos(), Qos(depth=3)]))
    path.write_text(yaml.safe_dump(root, sort_keys=False), encoding='utf-8')
    with Reader(tmp_path / 'old') as reader:
        assert not list(reader.messages())
    repair(tmp_path / 'old', tmp_path / 'made')
    with Reader(tmp_path / 'made') as reader:
        assert sum(1 for _ in reader.messages()) == 10
    assert open_bag(tmp_path / 'made').topics[0].topic.qos == (Qos(), Qos(depth=3))
