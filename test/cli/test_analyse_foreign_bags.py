"""`analyse_bag` on what other recorders and other people put into bags."""

import json
import re
import xml.etree.ElementTree as ET

from mcap.writer import Writer
import numpy as np
import pytest

from analysis import foreign
from analysis.foreign import START, STORE, Parabola
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.cli import analyse_bag

ODOMETRY = 'nav_msgs/msg/Odometry'
RED = '\x1b[31m'


@pytest.fixture
def analyse(capsys):
    """Run `analyse_bag` in this process: exit code, stdout, stderr."""

    def run(*arguments):
        try:
            code = analyse_bag.main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = end.code
        return code, *capsys.readouterr()

    return run


def write_mcap(path, *channels):
    """Write (topic, name of the type, [(log time, message), ...]) with the official writer."""
    with path.open('wb') as file:
        writer = Writer(file)
        writer.start()
        for topic, name, messages in channels:
            kind = messages[0][1].__msgtype__
            text, _ = STORE.generate_msgdef(kind, ros_version=2)
            schema = writer.register_schema(name, 'ros2msg', text.encode())
            channel = writer.register_channel(topic, 'cdr', schema)
            for at, m in messages:
                data = bytes(STORE.serialize_cdr(m, kind))
                writer.add_message(channel, log_time=at, publish_time=at, data=data)
        writer.finish()
    return path


def diagnostic(name, child, at, **values):
    """Return a flight event of the disc `child`."""
    pairs = [
        foreign.message('diagnostic_msgs/msg/KeyValue', key=k, value=str(v))
        for k, v in {'stamp_ns': at, **values}.items()
    ]
    return foreign.message(
        'diagnostic_msgs/msg/DiagnosticStatus',
        level=0, name=name, message=RED, hardware_id=child, values=pairs,
    )  # fmt: skip


# ---- types ----


def test_the_short_name_of_a_type_is_the_type(analyse, tmp_path):
    path = write_mcap(tmp_path / 'a.mcap', ('/odom', 'nav_msgs/Odometry', Parabola().odometry()))
    code, out, err = analyse(path, '--verify', '--topic', '/odom')
    assert (code, err) == (0, '')
    assert f'at first  {Parabola.speed:.2f} m/s' in out


@pytest.mark.parametrize('other_first', [False, True])
def test_messages_of_another_type_on_a_topic_are_not_motion(analyse, tmp_path, other_first):
    body = Parabola()
    other = [(at + 5, foreign.text('x')) for at, _ in body.odometry()[::7]]
    channels = [('/odom', ODOMETRY, body.odometry()), ('/odom', 'std_msgs/msg/String', other)]
    path = write_mcap(tmp_path / 'a.mcap', *channels[:: -1 if other_first else 1])
    bag = open_bag(path)
    assert {(t.name, t.type): t.message_count for t in bag.topics} == {
        ('/odom', ODOMETRY): len(body.t),
        ('/odom', 'std_msgs/msg/String'): len(other),
    }
    assert [m.value.data for m in bag.messages('/odom', ['std_msgs/String'])] == ['x'] * len(other)
    assert len(list(bag.messages())) == len(body.t) + len(other)
    for more in ((), ('--topic', 'odom')):
        code, out, err = analyse(path, '--verify', '--json', *more)
        assert (code, err) == (0, '')
        (disc,) = json.loads(out)['discs']
        assert disc['messages'] == len(body.t)
        (flight,) = disc['flights']
        assert flight['flight_time_s'] == pytest.approx(body.time, abs=1e-4)
    assert f'/odom ({ODOMETRY}) {len(body.t)}' in analyse(path)[1]


def test_a_topic_of_another_type_alone_is_refused_with_its_types(analyse, tmp_path):
    path = write_mcap(
        tmp_path / 'a.mcap', ('/odom', 'std_msgs/msg/String', [(START, foreign.text('x'))])
    )
    code, _, err = analyse(path, '--topic', '/odom')
    assert code == 2
    assert '/odom is std_msgs/msg/String; motion is read from' in err


def test_other_messages_on_a_topic_of_ours_hide_none_of_ours(analyse, tmp_path):
    body = Parabola()
    event = diagnostic('landed', 'body', START + 10**9)
    path = write_mcap(
        tmp_path / 'a.mcap',
        ('/odom', ODOMETRY, body.odometry()),
        ('/flight_events', 'std_msgs/msg/String', [(START, foreign.text('x'))]),
        ('/flight_events', event.__msgtype__, [(START + 10**9, event)]),
    )
    code, out, _ = analyse(path, '--json')
    assert code == 0
    assert [e['name'] for e in json.loads(out)['discs'][0]['events']] == ['landed']


# ---- attitudes ----


def test_quaternions_of_0_are_no_attitude(analyse, tmp_path):
    body = Parabola()
    path = write_mcap(tmp_path / 'a.mcap', ('/odom', ODOMETRY, body.odometry(norm=0.0)))
    code, out, _ = analyse(path, '--verify')
    assert code == 3, 'a message without an attitude is no sound Odometry'
    assert 'nan' not in out
    assert 'attitude unknown (the quaternions are 0)' in out
    assert f'{len(body.t)} of {len(body.t)} messages have no attitude' in out
    code, out, _ = analyse(path, '--json')
    (flight,) = json.loads(out)['discs'][0]['flights']
    # From positions at 100 Hz: the differences of a parabola are exact but for rounding.
    assert flight['launch']['speed_m_s'] == pytest.approx(body.speed, rel=1e-6)
    assert flight['launch']['climb_deg'] == pytest.approx(body.climb, abs=1e-4)
    assert flight['launch']['roll_deg'] is flight['launch']['spin_rad_s'] is None
    assert flight['flight_time_s'] == pytest.approx(body.time, abs=1e-4)
    assert analyse(path, '--plot', tmp_path / 'a.png')[0] == 0


def test_a_message_without_attitude_gets_that_before_it(analyse, tmp_path):
    body = Parabola()
    messages = body.odometry()
    for i in (0, 1, 50):
        turn = messages[i][1].pose.pose.orientation
        turn.x = turn.y = turn.z = turn.w = 0.0
    path = write_mcap(tmp_path / 'a.mcap', ('/odom', ODOMETRY, messages))
    code, out, _ = analyse(path, '--verify', '--json')
    assert code == 3
    (flight,) = json.loads(out)['discs'][0]['flights']
    # The spin turns the frame by 0.16 rad in the two messages.
    assert flight['launch']['speed_m_s'] == pytest.approx(body.speed, rel=1e-9)
    assert flight['launch']['heading_deg'] == pytest.approx(-body.heading, abs=np.degrees(0.17))
    checks = flight['verification']['checks']
    assert not checks['quaternion_norm']['passed']


# ---- where a flight begins ----


def test_a_bag_that_begins_in_flight_claims_no_launch(analyse, tmp_path):
    body = Parabola()
    flying = body.odometry()
    at = flying[0][0]
    rest = [
        (at - k * 10**7, foreign.odometry(at - k * 10**7, body.position[0], [0, 0, 0, 1],
                                          [0, 0, 0], [0, 0, 0]))
        for k in range(20, 0, -1)
    ]  # fmt: skip
    whole = write_mcap(tmp_path / 'whole.mcap', ('/odom', ODOMETRY, [*rest, *flying]))
    split = write_mcap(tmp_path / 'split.mcap', ('/odom', ODOMETRY, flying[60:]))
    _, out, _ = analyse(whole)
    assert 'launch    12.00 m/s' in out
    _, out, _ = analyse(split)
    assert 'launch' not in out
    assert 'in flight: the bag holds neither the throw nor rest before it' in out
    for path, began in ((whole, 'moved'), (split, 'in flight')):
        _, out, _ = analyse(path, '--json')
        assert json.loads(out)['discs'][0]['flights'][0]['began'] == began


# ---- texts ----


def test_control_characters_from_a_bag_reach_neither_terminal_nor_picture(analyse, tmp_path):
    child = f'dis{RED}c\n$x$'
    topic = f'/a{RED}b\nc/odom'
    flights = [
        m
        for k in range(2)
        for m in Parabola().odometry(start=START + k * 10 * foreign.SECOND, child=child)
    ]
    event = diagnostic(f'la{RED}nded', child, START + 10**9, reason=RED)
    path = write_mcap(
        tmp_path / f'a{RED}.mcap',
        (topic, ODOMETRY, flights),
        (topic.replace('odom', 'flight_events'), event.__msgtype__, [(START, event)]),
    )
    calls = [
        (),
        ('--verify',),
        ('--json',),
        ('--disc', 'nope'),
        ('--topic', 'nope'),
        ('--topic', RED),
        ('--plot', tmp_path / 'a.svg'),
    ]
    for arguments in calls:
        _, out, err = analyse(path, *arguments)
        assert out + err
        assert not re.search('[\x00-\x08\x0b-\x1f\x7f-\x9f]', out + err), arguments
        assert '\nc/odom' not in out + err, 'a name makes no line of its own'
    picture = (tmp_path / 'a.svg').read_bytes()
    assert RED.encode() not in picture
    assert ET.fromstring(picture).tag.endswith('svg')
