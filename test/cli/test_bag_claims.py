"""What `analyse_bag` claims of bags that lack something: no part is called more than it is."""

import json
import re
import shutil

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.serialization import deserialize_message, serialize_message

from analysis import bags
import disc_sim_ros
from disc_sim_ros.analysis import bag_report
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.cli import analyse_bag


@pytest.fixture(scope='module')
def steered(tmp_path_factory):
    """A bag of a disc that is thrown, steered, lands, is thrown again and reset."""
    return bags.steered_bag(tmp_path_factory.mktemp('bags') / 'steered')


@pytest.fixture
def part(steered, tmp_path):
    """Make a copy of that bag that lacks something."""
    return lambda keep: bags.copy(steered, tmp_path / 'part', keep)


@pytest.fixture
def verify(capsys):
    """Run `analyse_bag --verify` in this process: exit code, stdout."""

    def run(*arguments):
        code = analyse_bag.main(['--verify', *map(str, arguments)])
        out, err = capsys.readouterr()
        assert not err
        return code, out

    return run


@pytest.fixture
def flights(verify):
    """Return the flights of a bag as `--json` has them."""
    return lambda bag: json.loads(verify(bag, '--json')[1])['discs'][0]['flights']


def odometry(bag):
    """Return the log times of the odometry of the first flight, which lands at rest [ns]."""
    first, second = (m.log_time for m in open_bag(bag).raw(['/release']))
    return [m.log_time for m in open_bag(bag).raw(['/odom']) if first <= m.log_time < second]


@pytest.mark.parametrize(
    ('place', 'removed'), [('before', slice(0, 30)), ('between', slice(60, 75))]
)
def test_holes_are_counted_wherever_they_are(flights, steered, part, place, removed):
    lost = odometry(steered)[removed]
    bag = part(lambda m: m.topic != '/odom' or m.log_time not in lost)
    flight = flights(bag)[0]
    messages = flight['messages']
    counted = {'before': messages['missing_before'], 'between': messages['missing']}
    assert counted == {'before': 0, 'between': 0, place: len(lost)}
    assert messages['missing_after'] == 0
    (first, *_) = disc_sim_ros.analyse_bag(bag)
    line = bag_report.verification_text(first).splitlines()[0]
    assert line.endswith(f' and the landing; {len(lost)} more are missing')
    assert flight['verification']['passed']


def test_messages_missing_up_to_the_end_of_a_flight_are_counted(verify, flights, steered, part):
    end = odometry(steered)[170]
    bag = part(lambda m: m.topic != '/odom' or m.log_time < end)
    (flight,) = flights(bag)
    release = int(open_bag(bag).raw(['/release']).__next__().log_time)
    landing = release + flight['flight_time_s'] * bags.SECOND  # by its event
    lost = sum(end <= at < landing for at in odometry(steered))
    assert lost > 40
    assert (flight['messages']['missing'], flight['messages']['missing_after']) == (0, lost)
    assert flight['verification']['passed']  # up to the event of the landing
    code, out = verify(bag)
    assert f'{lost} missing at the end' in out
    assert f'messages and the landing; {lost} more are missing' in out
    assert code == 3  # of the second throw there is nothing


def test_every_second_message_is_half_of_them(flights, part):
    """Their stamps are even; the configuration tells the rate."""
    number = iter(range(10_000))
    bag = part(lambda m: m.topic != '/odom' or next(number) % 2 == 0)
    messages = flights(bag)[0]['messages']
    assert messages['rate_hz'] == pytest.approx(150.0)
    assert messages['count'] + messages['missing'] + messages['missing_before'] in {224, 225}
    assert messages['missing'] > 100


@pytest.mark.parametrize('which', [1, 2])
def test_a_throw_without_odometry_is_told_and_not_verified(verify, part, which):
    second = bags.START + 1600 * bags.MS

    def keep(m):
        return m.topic != '/odom' or (m.log_time < second) == (which == 2)

    code, out = verify(part(keep))
    assert code == 3
    (flight,) = re.findall(r'  flight (\d):', out)
    assert int(flight) == 3 - which  # by its throw
    assert 'MISSING: no message of the motion after 1 throw (2023-11-14 22:13:2' in out
    assert 'identical to the last bit' in out


def test_the_poses_alone_are_called_so(verify, part):
    code, out = verify(part(lambda m: m.topic != '/odom'))
    assert code == 0
    assert 'identical to the last bit: the poses of 225 messages and the landing\n' in out


def test_only_what_was_recorded_of_a_landing_is_verified(verify, steered, tmp_path):
    """An event without numbers is no landing that was compared; nor is one that is not there."""
    bag = open_bag(steered)
    for name, keys, said in (
        ('none', None, 'the event of the landing is missing'),
        (
            'few',
            {'stamp_s', 'range_m'},
            'the event of the landing has no flight_time_s, land',
        ),
    ):
        with BagWriter(tmp_path / name) as writer:
            ids = {i.topic.name: writer.add(i.topic) for i in bag.topics}
            for m in bag.raw():
                data = m.data
                if m.topic == '/flight_events':
                    event = deserialize_message(data, DiagnosticStatus)
                    if event.name.endswith('landed'):
                        if keys is None:
                            continue
                        event.values = [v for v in event.values if v.key in keys]
                        data = serialize_message(event)
                writer.write(ids[m.topic], data, m.log_time, m.publish_time)
        code, out = verify(tmp_path / name)
        assert code == 0
        assert 'identical to the last bit: 225 messages\n' in out
        assert f'note: {said}' in out


def test_a_reset_that_no_event_tells_is_the_reason_of_a_difference(verify, part):
    code, out = verify(part(lambda m: m.topic != '/flight_events'))
    assert code == 3
    assert 'because: the event of the throw is missing, and so may be others' in out


def test_the_exit_code_of_a_damaged_bag_is_the_one_that_help_names(steered, tmp_path, capsys):
    """1 for a byte that changed; 0 after a note for an end that is cut off."""
    for name, damage, code, said in (
        ('flipped', lambda b: b[:4000] + bytes([b[4000] ^ 0xFF]) + b[4001:], 1, 'damaged at byte'),
        ('cut', lambda b: b[: len(b) * 2 // 3], 0, 'note: .* was not closed or is damaged'),
    ):
        bag = shutil.copytree(steered, tmp_path / name)
        (file,) = bag.glob('*.mcap')
        file.write_bytes(damage(file.read_bytes()))
        assert analyse_bag.main([str(bag)]) == code
        assert re.search(said, capsys.readouterr().err)


@pytest.mark.parametrize(
    'topics',
    [
        {'/release', '/configuration'},
        {'/applied_wind', '/applied_coefficients', '/applied_moment'},
        {'/flight_events'},
    ],
)
def test_what_was_recorded_twice_counts_once(verify, steered, tmp_path, topics):
    """As by two subscriptions of a recorder."""
    bag, source = tmp_path / steered.name, open_bag(steered)
    with BagWriter(bag) as writer:
        ids = {i.topic.name: writer.add(i.topic) for i in source.topics}
        for m in source.raw():
            for _ in range(2 if m.topic in topics else 1):
                writer.write(ids[m.topic], m.data, m.log_time, m.publish_time)
    (once, twice) = (verify(path) for path in (steered, bag))
    assert twice[0] == once[0] == 0
    assert _flights(twice[1]) == _flights(once[1])


def _flights(out):
    """Return the report without the counts of the bag."""
    return out[out.index('disc: /odom') :]


def test_log_times_out_of_order_are_the_reason_of_a_difference(verify, steered, tmp_path):
    """The clock of another recorder was set back by an hour in flight."""
    bag, source = tmp_path / 'bag', open_bag(steered)
    set_at, hour = bags.START + 800 * bags.MS, 3600 * bags.SECOND
    with BagWriter(bag) as writer:
        ids = {i.topic.name: writer.add(i.topic) for i in source.topics}
        for m in source.raw():
            log = m.log_time - (hour if m.log_time > set_at else 0)
            writer.write(ids[m.topic], m.data, log, m.publish_time)
    code, out = verify(bag)
    assert code == 3
    assert 'because: stamps go back 1 times: the log times are out of order' in out
