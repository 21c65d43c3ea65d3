"""What benchmarks/fuzz found, each as small as it gets: refused in one line, never a traceback."""

from dataclasses import replace
import json
import math
import struct

import numpy as np
import pytest

from analysis import bags as flight_bags

pytest.importorskip('rclpy')

from disc_sim_ros.analysis import checks, recording, resimulate, techdisc
from disc_sim_ros.analysis.odometry import Motion, motions
from disc_sim_ros.bags import bag_folder, metadata, schemas
from disc_sim_ros.bags.reader import RawMessage, open_bag
from disc_sim_ros.bags.topic import Topic, parse_qos
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.cli import analyse_bag
from disc_sim_ros.errors import BagError, ConfigError, DiscSimError
from disc_sim_ros.estimation import throw_csv
from disc_sim_ros.estimation.prediction import replay
from disc_sim_ros.estimation.prediction.predictor import Measurement
from disc_sim_ros.physics import disc_file

START = 1_700_000_000_000_000_000  # ns


@pytest.mark.parametrize('diameter', ['1e200', '1e155'])
def test_a_disc_whose_area_is_no_number_is_refused(tmp_path, diameter):
    file = tmp_path / 'huge.yaml'
    file.write_text(f'based_on: frisbee\ndiameter_m: {diameter}\n')
    with pytest.raises(ConfigError):
        disc_file.load_disc(str(file))


@pytest.mark.parametrize('read', [throw_csv.read, techdisc.throws])
@pytest.mark.parametrize('line', [1, 2])
def test_a_cell_longer_than_csv_allows_is_refused_with_its_line(tmp_path, read, line):
    head = 't_s,x_m,y_m,z_m,speedMph,spinRpm,launchAngle,noseAngle,hyzerAngle'
    lines = [head, '0,0,0,1,60,1000,0,0,0']
    lines[line - 1] += ',' + '1' * 140_000
    file = tmp_path / 'throws.csv'
    file.write_text('\n'.join(lines), encoding='utf-8')
    with pytest.raises(ConfigError, match=rf'line {line}[^\n]*larger than field limit') as refused:
        read(file)
    assert len(str(refused.value)) < 400


# The parser of definitions raises something else for each of them.
DEFINITIONS = (
    'string',
    'td msgs/String data',
    '====string data = 1',
    'string aat__data',
    'string data\n' + '=' * 79 + '<\nMSC: x/Y\nfloat64 x',
    'geometry_msgs/Point p 0',
    'float64 0%float64 y 0',
    'string<=',
    '=',
)


@pytest.mark.parametrize('definition', DEFINITIONS)
def test_a_definition_that_is_none_is_told_in_one_line(tmp_path, definition):
    with BagWriter(tmp_path / 'bag') as writer:
        described = Topic(name='/a', type='std_msgs/msg/String', definition=definition)
        topic = writer.add(described)
        writer.write(topic, b'\x00\x01\x00\x00\x03\x00\x00\x00hi\x00', START, START)
    with pytest.raises(BagError, match='/a') as refused:
        list(open_bag(tmp_path / 'bag').messages())
    assert '\n' not in str(refused.value)


NOT_METADATA = (
    'message_count: .inf',
    'message_count: ' + '9' * 5000,
    '[' * 3000,
    'a: &a [*a]',
    '- 1',
    'null',
)


@pytest.mark.parametrize('text', NOT_METADATA)
def test_what_is_no_metadata_is_refused_in_one_line_and_the_messages_are_read(tmp_path, text):
    for parse in (metadata.parse, parse_qos):
        with pytest.raises(BagError) as refused:
            parse(f'topics_with_message_count: []\nrelative_file_paths: []\n{text}')
        assert '\n' not in str(refused.value)
    topic = Topic(name='/a', type='std_msgs/msg/String', definition='string data')
    with BagWriter(tmp_path / 'bag') as writer:
        writer.write(writer.add(topic), b'\x00\x01\x00\x00\x03\x00\x00\x00hi\x00', START, START)
        writer.note(metadata.RECORD, {metadata.KEY: text})
    (tmp_path / 'bag' / metadata.FILE_NAME).write_text(text, encoding='utf-8')
    (message,) = open_bag(tmp_path / 'bag').raw()
    assert message.topic == '/a'


def odometry(log_time, number=0.0):
    """The bytes of an Odometry in `map` of `disc`, with one number in all doubles."""
    text = struct.pack('<I4sI5s', 4, b'map\0', 5, b'disc\0')
    text += bytes(-len(text) % 8)  # alignment counts from behind the encapsulation, as 8 + text
    data = b'\x00\x01\x00\x00' + bytes(8) + text + struct.pack('<85d', *[number] * 85)
    return RawMessage('/odom', log_time, 0, data)


def test_a_log_time_of_64_bits_is_read():
    """MCAP counts to 2^64 ns, arrays of numpy to 2^63."""
    (motion,) = motions([odometry(2**64 - 1, 7.0)], 'nav_msgs/msg/Odometry')
    assert motion.log.tolist() == [2**63 - 1]
    assert motion.numbers[0].tolist() == [7.0] * 13


def motion_with(quaternions, stamps):
    n = len(stamps)
    numbers = np.zeros((n, 13))
    numbers[:, 3:7] = quaternions
    numbers[:, 12] = 30.0
    stamps = np.array(stamps, dtype=np.int64)
    return Motion('/odom', 'map', 'disc', stamps, stamps, numbers)


def test_stamps_that_stand_still_tell_of_no_spin():
    still = motion_with([(0.0, 0.0, 0.0, 1.0)] * 3, [START] * 3)
    assert not checks.turns_with_spin(still)


@pytest.mark.parametrize('length', [0.0, 1e-200, 5e-324, 1e200, math.inf, math.nan])
def test_a_quaternion_of_any_length_is_no_crash(length):
    quaternions = [(0.0, 0.0, 0.0, 1.0), (length, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, length)]
    odd = motion_with(quaternions, [START, START + 10_000_000, START + 20_000_000])
    assert isinstance(checks.turns_with_spin(odd), bool)


@pytest.fixture(scope='module')
def steered(tmp_path_factory):
    folder = tmp_path_factory.mktemp('found') / 'bag'
    return flight_bags.steered_bag(folder, publish_rate=20.0, physics_rate=1000.0)


def flight_of(folder):
    from disc_sim_ros.analysis import flights

    (disc,) = recording.discs(open_bag(folder))
    return flights.flights(disc)[0]


def reconfigured(flight, **changes):
    """The flight, with another configuration; a change to None takes the key out."""
    document = {**flight.release.configuration, **changes}
    document = {key: value for key, value in document.items() if value is not None}
    return replace(flight, release=replace(flight.release, configuration=document))


@pytest.mark.parametrize('key', ['publish_rate', 'physics_rate', 'ground', 'wind', 'disc_file'])
def test_a_configuration_that_lacks_something_is_refused(steered, key):
    flight = flight_of(steered)
    resimulate.compare(flight, resimulate.fly_again(flight))  # whole it is one
    with pytest.raises(DiscSimError):
        resimulate.fly_again(reconfigured(flight, **{key: None}))


@pytest.mark.parametrize('key', ['publish_rate', 'physics_rate'])
@pytest.mark.parametrize('value', [0, -1.0, '\0', 'fast', 10**400, math.nan, [], {}])
def test_a_rate_that_is_none_is_refused(steered, key, value):
    with pytest.raises(DiscSimError) as refused:
        resimulate.fly_again(reconfigured(flight_of(steered), **{key: value}))
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize('value', [10**400, 'far', None])
def test_a_release_that_is_no_state_is_refused(steered, value):
    flight = flight_of(steered)
    release = {**flight.release.configuration['release'], 'X': value}
    with pytest.raises(DiscSimError):
        resimulate.fly_again(reconfigured(flight, release=release))


def test_a_landing_that_tells_no_number_differs(steered):
    flight = flight_of(steered)
    values = {**flight.landing.values, 'range_m': 'far'}
    changed = replace(flight, landing=replace(flight.landing, values=values))
    verdict = resimulate.compare(changed, resimulate.fly_again(changed))
    assert verdict.largest['landed.range_m'] == math.inf
    assert not verdict.exact


def test_a_moment_in_a_frame_that_is_not_of_the_disc_is_left_out_and_told(steered):
    flight = flight_of(steered)
    changes = tuple(
        replace(c, frame='disc_\x01') if c.topic == 'applied_moment' else c
        for c in flight.disc.changes
    )
    changed = replace(flight, disc=replace(flight.disc, changes=changes))
    verdict = resimulate.compare(changed, resimulate.fly_again(changed))
    assert not verdict.exact
    assert any(
        "moments in 'disc_\\x01': no frame of the disc" in doubt for doubt in verdict.doubts
    )


@pytest.mark.parametrize('prefix', ['', 'red/', 'red_', 'disc', 'a/b/'])
def test_moments_are_those_of_the_disc_whatever_its_prefix(tmp_path, prefix):
    made = flight_bags.steered_bag(tmp_path / 'bag', frame_prefix=prefix)
    flight = flight_of(made)
    moments = [c for c in flight.disc.changes if c.topic == 'applied_moment']
    assert {c.frame for c in moments} == {f'{prefix}disc_body', f'{prefix}disc_air'}
    verdict = resimulate.compare(flight, resimulate.fly_again(flight))
    assert verdict.exact
    assert not verdict.doubts


def test_the_bag_that_was_changed_is_still_analysed(steered, capsys):
    """The flights above are of a bag that `analyse_bag` finds exact."""
    assert analyse_bag.main([str(steered), '--verify', '--json']) == 0
    assert json.loads(capsys.readouterr().out)['discs']


@pytest.mark.parametrize(
    ('topic', 'kind', 'definition'),
    [
        ('/applied_wind', 'geometry_msgs/msg/Vector3Stamped', 'float64 x'),
        ('/applied_moment', 'geometry_msgs/msg/WrenchStamped', 'float64 wrench'),
        ('/flight_events', 'diagnostic_msgs/msg/DiagnosticStatus', 'bool name'),
        ('/release', 'nav_msgs/msg/Odometry', 'int32 header'),
    ],
)
def test_a_message_that_lacks_its_fields_is_told(tmp_path, topic, kind, definition):
    """By a damaged definition: the name of the type still fits."""
    with BagWriter(tmp_path / 'bag') as writer:
        motion = 'nav_msgs/msg/Odometry'
        odom = writer.add(Topic(name='/odom', type=motion, definition=schemas.definition(motion)))
        other = writer.add(Topic(name=topic, type=kind, definition=definition))
        writer.write(odom, odometry(START).data, START, START)
        writer.write(other, b'\x00\x01\x00\x00' + bytes(16), START, START)
    with pytest.raises(BagError, match='not what its topic says'):
        recording.discs(open_bag(tmp_path / 'bag'))


def test_metadata_that_names_thousands_of_files_reads_each_file_that_is_there_once(
    tmp_path, monkeypatch
):
    """A text in the place of the list named each of its characters, in quadratic time."""
    with BagWriter(tmp_path / 'bag') as writer:
        topic = Topic(name='/a', type='std_msgs/msg/String', definition='string data')
        writer.write(writer.add(topic), b'\x00\x01\x00\x00\x03\x00\x00\x00hi\x00', START, START)
    text = tmp_path / 'bag' / metadata.FILE_NAME
    whole = text.read_text(encoding='utf-8')
    read, looks = bag_folder.indexed, []
    monkeypatch.setattr(bag_folder, 'indexed', lambda path: looks.append(path) or read(path))
    for paths in ('"' + 'x' * 3000 + '"', str([f'lost_{n}.mcap' for n in range(3000)])):
        listed = 'relative_file_paths:\n    - bag_0.mcap'
        assert listed in whole
        text.write_text(whole.replace(listed, f'relative_file_paths: {paths}'), encoding='utf-8')
        looks.clear()
        (message,) = open_bag(tmp_path / 'bag').raw()
        assert message.topic == '/a'
        assert len(looks) <= 2


@pytest.mark.parametrize('far', [1e155, -1e308, math.inf, math.nan, 10_001.0])
def test_a_measured_position_out_of_any_field_is_refused(far):
    """Its square was no number: an OverflowError in the search for a throw."""
    with pytest.raises(ConfigError, match=r'measured y: .* -10000 to 10000 m'):
        Measurement(0.0, (1.0, far, 1.0))


def _replayed(file):
    for name, columns in throw_csv.read(file).throws.items():
        replay.measurements_of(name, columns)


@pytest.mark.parametrize(
    ('column', 'number', 'read'),
    [
        ('x_m', '1e155', throw_csv.read),
        ('t_s', '1e200', throw_csv.read),
        ('z_m', '-20000', _replayed),
    ],
)
def test_a_number_in_a_file_of_throws_that_is_none_of_a_throw_is_refused(
    tmp_path, column, number, read
):
    cells = {'t_s': '0.1', 'x_m': '1', 'y_m': '0', 'z_m': '1', column: number}
    file = tmp_path / 'throws.csv'
    file.write_text(f'{",".join(cells)}\n{",".join(cells.values())}\n', encoding='utf-8')
    with pytest.raises(
        ConfigError, match=f'{number.strip("-")}.* (?:finite number|in m)'
    ) as refused:
        read(file)
    assert '\n' not in str(refused.value)
