"""`analyse_bag` as a command: bags of sim_node, damaged bags, and bags of other programs."""

import json
import math
from pathlib import Path
import re
import shutil
import subprocess
import sys

from matplotlib import image
import numpy as np
import pytest

from analysis import foreign
from analysis.foreign import START, Parabola
import disc_sim_ros
from disc_sim_ros.analysis import bag_report
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.cli import analyse_bag, fly
from disc_sim_ros.errors import BagError

EXECUTABLE = Path(sys.executable).with_name('analyse_bag')


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


@pytest.fixture
def document(analyse):
    """Run with --json; return the exit code and the document."""

    def run(*arguments):
        code, out, err = analyse(*arguments, '--json')
        assert (err, out.count('\n')) == ('', 1)
        return code, json.loads(out, parse_constant=pytest.fail)

    return run


@pytest.fixture(scope='module')
def steered(tmp_path_factory):
    """A bag of a disc that is steered and blown about, lands, and is thrown again."""
    pytest.importorskip('rclpy')
    from analysis.bags import steered_bag

    return steered_bag(tmp_path_factory.mktemp('bags') / 'steered')


@pytest.fixture
def part(steered, tmp_path):
    """Make a copy of that bag that lacks something."""
    from analysis.bags import copy

    return lambda keep, **more: copy(steered, tmp_path / 'part', keep, **more)


def parabola_bag(tmp_path, **changes):
    messages = Parabola().odometry(**changes)
    return foreign.write(tmp_path / 'bag', {'/thing/odometry': messages})


# ---- bags of sim_node ----


def test_a_steered_flight_in_gusts_is_computed_again_to_the_bit(document, steered):
    code, summary = document(steered, '--verify')
    assert code == 0
    (disc,) = summary['discs']
    first, second = disc['flights']
    for flight in (first, second):
        verified = flight['verification']
        assert verified['passed']
        again = verified['re_flight']
        assert again['exact']
        assert again['messages'] == again['identical_messages'] == flight['messages']['count']
        assert set(again['largest_difference'].values()) == {0.0}
        assert again['doubts'] == []
    assert len(first['verification']['re_flight']['largest_difference']) == 13 + 5
    landing = next(e for e in disc['events'] if e['name'] == 'landed')['values']
    assert first['flight_time_s'] == float(landing['flight_time_s'])
    assert first['range_m'] == pytest.approx(float(landing['range_m']), rel=1e-15)
    assert first['spin_left'] == pytest.approx(float(landing['spin_rad_s']) / 31.416)
    assert [c['topic'] for c in first['changes']].count('applied_coefficients') == 3
    assert (first['ended'], second['ended']) == ('landed', 'reset')
    assert (second['landed'], second['landing_position_m']) == (False, None)
    launch = first['launch']
    assert launch['speed_m_s'] == pytest.approx(14.0)
    assert launch['pitch_deg'] == pytest.approx(2.0)
    assert first['setup']['wind']['turbulence'] == 12.0


def test_the_public_function_finds_the_flights_of_the_command(document, steered):
    _, summary = document(steered)
    analyses = disc_sim_ros.analyse_bag(steered)
    flights = [flight for disc in summary['discs'] for flight in disc['flights']]
    assert [bag_report.document(a)['range_m'] for a in analyses] == [f['range_m'] for f in flights]
    assert [a.passed for a in analyses] == [True, True]
    assert disc_sim_ros.analyse_bag(steered, '/odom')[0].verdict == analyses[0].verdict
    with pytest.raises(BagError, match='/nowhere'):
        disc_sim_ros.analyse_bag(steered, '/nowhere')


def test_a_bag_that_ends_between_the_landing_and_the_message_that_shows_it(
    document, tmp_path, capsys
):
    """A recorder that ends at the landing event may miss the odometry that follows."""
    pytest.importorskip('rclpy')
    from analysis.bags import copy

    assert fly.main(['--control', '0', '0.004', '0', '--bag', str(tmp_path / 'bag')]) == 0
    capsys.readouterr()
    whole = [m.data for m in open_bag(tmp_path / 'bag').raw(['/odom'])]
    copy(tmp_path / 'bag', tmp_path / 'part', lambda message: message.data != whole[-1])
    code, summary = document(tmp_path / 'part', '--verify')
    assert code == 0
    (flight,) = summary['discs'][0]['flights']
    assert flight['messages']['count'] == len(whole) - 1
    again = flight['verification']['re_flight']
    assert again['identical_messages'] == len(whole) - 1
    assert again['largest_difference']['landed.flight_time_s'] == 0.0


def test_it_agrees_with_fly(document, capsys, tmp_path):
    pytest.importorskip('rclpy')
    text = '--disc wraith --speed 22 --pitch 8 --spin 90 --height 1.2 --control 0 0.004 0'
    flags = text.split()
    assert fly.main([*flags, '--bag', str(tmp_path / 'bag')]) == 0
    assert re.search(r'  wrote   \S+/bag: \d+ messages of \d+ topics', capsys.readouterr().out)
    assert fly.main([*flags, '--step', '0.001', '--json']) == 0
    flown = json.loads(capsys.readouterr().out)
    code, summary = document(tmp_path / 'bag', '--verify')
    assert code == 0
    (flight,) = summary['discs'][0]['flights']
    assert flight['landing_position_m'] == flown['landing_position_m']
    assert flight['flight_time_s'] == flown['flight_time_s']
    for key in ('range_m', 'drift_m', 'end_spin_rad_s'):
        assert flight[key] == pytest.approx(flown[key], rel=1e-12), key
    # The highest of samples, 5 ms apart: at most g t^2 / 2 below the top.
    assert 0.0 <= flown['apex_m'] - flight['apex_m'] < 9.81 * 0.0025**2
    for key in ('speed_m_s', 'pitch_deg', 'roll_deg', 'spin_rad_s', 'height_m'):
        assert flight['launch'][key] == pytest.approx(flown['launch'][key], abs=1e-12), key


def test_a_bag_without_a_command_differs_from_a_known_time_on(analyse, document, part):
    bag = part(lambda m: m.topic != '/applied_coefficients', custom_data={'drops': '/odom 3'})
    code, summary = document(bag, '--verify')
    assert code == analyse_bag.DIFFERENT == 3
    first, second = (f['verification']['re_flight'] for f in summary['discs'][0]['flights'])
    assert not first['exact']
    assert second['exact']
    # The command acts 223.4 ms after START, the release at 100 or a message later.
    assert 0.116 < first['first_difference_s'] < 0.1234 + 1 / 150
    assert first['largest_difference']['position.x_m'] > 0.01
    assert 'drops: /odom 3' in first['doubts']
    code, out, _ = analyse(bag, '--verify')
    assert code == 3
    assert 'DIFFERENT' in out
    assert 'because: drops: /odom 3' in out
    assert analyse(bag)[0] == 0  # without --verify nothing is judged


def test_lost_odometry_is_counted_and_the_flight_still_verified(document, part):
    lost = iter(range(10_000))
    bag = part(lambda m: m.topic != '/odom' or next(lost) not in {40, 41, 60})
    code, summary = document(bag, '--verify')
    assert code == 0
    messages = summary['discs'][0]['flights'][0]['messages']
    assert messages['missing'] == 3
    assert messages['longest_gap_s'] == pytest.approx(3 / 150, abs=1e-8)


def test_a_bag_that_begins_in_flight_is_reported_with_its_gap(document, part):
    from analysis import bags

    begin = bags.START + 400 * bags.MS

    def late(m):
        latched = {'/release', '/configuration', '/flight_events'}
        return m.log_time >= begin or m.topic in latched

    code, summary = document(part(late), '--verify')
    assert code == 3
    first = summary['discs'][0]['flights'][0]
    assert first['starts_late_s'] == pytest.approx(0.3, abs=0.01)
    assert first['launch']['speed_m_s'] == pytest.approx(14.0)  # as configured
    (doubt,) = first['verification']['re_flight']['doubts']
    assert 'its first message is 0.29' in doubt


def test_a_change_of_the_wind_profile_is_named(document, tmp_path):
    pytest.importorskip('rclpy')
    from rcl_interfaces.msg import Parameter, ParameterEvent
    from rclpy.serialization import serialize_message

    from analysis import bags
    from disc_sim_ros.bags.writer import BagWriter
    from disc_sim_ros.ros.sim.config import configuration

    rougher = {'wind.roughness_length': 0.8}
    with BagWriter(tmp_path / 'bag') as writer:
        events = bags.BagSinkFactory(writer).sink(ParameterEvent, '/parameter_events', bags.QOS)
        made = bags.Made(writer)
        made.go(0.2)
        made.requests.append(
            lambda: made.simulation.configure(configuration(bags.PARAMETERS | rougher))
        )
        changed = [Parameter(name='wind.roughness_length')]
        event = ParameterEvent(node='/sim_node', changed_parameters=changed)
        now = made.simulation.clock.now
        writer.write(events._topic_id, serialize_message(event), now, now)
        made.go(0.2)
    code, summary = document(tmp_path / 'bag', '--verify')
    assert code == 3
    again = summary['discs'][0]['flights'][0]['verification']['re_flight']
    assert 0.19 < again['first_difference_s'] < 0.22
    assert any('profile of the wind was changed' in doubt for doubt in again['doubts'])


def test_topics_missing_in_the_bag_are_named(document, part, steered, tmp_path):
    from disc_sim_ros.bags.reader import open_bag
    from disc_sim_ros.bags.writer import BagWriter

    kept = ('/odom', '/release', '/configuration')
    bag = open_bag(steered)
    with BagWriter(tmp_path / 'few') as writer:
        ids = {i.topic.name: writer.add(i.topic) for i in bag.topics if i.topic.name in kept}
        for m in bag.raw(kept):
            writer.write(ids[m.topic], m.data, m.log_time, m.publish_time)
    code, summary = document(tmp_path / 'few', '--verify')
    assert code == 3
    doubts = summary['discs'][0]['flights'][0]['verification']['re_flight']['doubts']
    assert 'not recorded: applied_moment, applied_coefficients, applied_wind' in doubts


def test_an_unfinished_bag_is_read_with_a_note(analyse, steered, tmp_path):
    shutil.copytree(steered, tmp_path / 'steered')
    file = tmp_path / 'steered' / 'steered_0.mcap'
    file.write_bytes(file.read_bytes()[:-2000])  # in the index
    code, out, err = analyse(tmp_path / 'steered', '--verify')
    assert code == 0
    assert re.fullmatch(r'analyse_bag: note: \S+ was not closed.*`repair_bag`.*\n', err)
    assert 'identical to the last bit' in out


def test_two_discs_on_one_topic_have_a_report_each(document, analyse, tmp_path):
    pytest.importorskip('rclpy')
    from analysis import bags
    from disc_sim_ros.bags.writer import BagWriter

    with BagWriter(tmp_path / 'red') as writer:
        bags.Made(writer, frame_prefix='red/').go(0.5)
    with BagWriter(tmp_path / 'blue') as writer:
        bags.Made(writer, frame_prefix='blue/', **{'wind.seed': 4}).go(0.4)
    with BagWriter(tmp_path / 'both') as writer:
        ids = {}
        for colour in ('red', 'blue'):
            bag = bags.open_bag(tmp_path / colour)
            for info in bag.topics:
                if info.topic.name not in ids:
                    ids[info.topic.name] = writer.add(info.topic)
            for m in bag.raw():
                writer.write(ids[m.topic], m.data, m.log_time, m.publish_time)
    code, summary = document(tmp_path / 'both', '--verify')
    assert code == 0
    assert [(d['disc'], d['child_frame']) for d in summary['discs']] == [
        ('red', 'red/disc'),
        ('blue', 'blue/disc'),
    ]
    seeds = [d['flights'][0]['setup']['wind']['seed'] for d in summary['discs']]
    assert seeds == [bags.PARAMETERS['wind.seed'], 4]
    code, summary = document(tmp_path / 'both', '--disc', 'blue')
    assert [d['disc'] for d in summary['discs']] == ['blue']
    code, _, err = analyse(tmp_path / 'both', '--disc', 'green')
    assert code == 2
    assert 'choose from red, blue' in err


# ---- bags of other programs ----


def test_a_bag_of_another_program_is_measured_and_its_kinematics_checked(document, tmp_path):
    parabola = Parabola()
    code, summary = document(parabola_bag(tmp_path), '--verify')
    assert code == 0
    (disc,) = summary['discs']
    assert (disc['topic'], disc['child_frame']) == ('/thing/odometry', 'body')
    (flight,) = disc['flights']
    launch = flight['launch']
    assert launch['speed_m_s'] == pytest.approx(parabola.speed)
    assert launch['climb_deg'] == pytest.approx(parabola.climb)
    assert launch['heading_deg'] == pytest.approx(-parabola.heading)  # right positive
    assert launch['spin_rad_s'] == pytest.approx(parabola.spin)
    assert launch['frame_spins']
    # Between two messages the path is taken for straight, g dt^2 / 8 above the ground.
    assert flight['flight_time_s'] == pytest.approx(parabola.time, abs=2e-5)
    assert flight['range_m'] == pytest.approx(math.hypot(*parabola.landing), abs=2e-4)
    assert flight['apex_m'] == pytest.approx(parabola.apex, abs=9.81 * 0.005**2)
    verified = flight['verification']
    assert 'no configuration' in verified['not_flown_again']
    assert {n: c['passed'] for n, c in verified['checks'].items()} == {
        'stamps': True,
        'quaternion_norm': True,
        'velocity': True,
    }


def unstamped(messages):
    """Return messages as a program sends them that does not fill in the stamp."""
    for _, message in messages:
        message.header.stamp.sec = message.header.stamp.nanosec = 0
    return messages


def test_without_stamps_the_log_times_count_and_nothing_is_verified(document, analyse, tmp_path):
    parabola = Parabola()
    bag = foreign.write(tmp_path / 'bag', {'/odom': unstamped(parabola.odometry())})
    code, summary = document(bag)
    assert code == 0
    (flight,) = summary['discs'][0]['flights']
    assert flight['flight_time_s'] == pytest.approx(parabola.time, abs=2e-5)
    assert flight['launch']['speed_m_s'] == pytest.approx(parabola.speed)
    code, out, _ = analyse(bag, '--verify')
    assert code == 3
    assert 'nothing is verified: the header stamps do not advance' in out
    _, summary = document(bag, '--verify')
    verified = summary['discs'][0]['flights'][0]['verification']
    assert not verified['passed']
    assert verified['checks'] == {}


def test_a_bag_without_a_flight_is_not_verified(analyse, tmp_path):
    still = [(at, m) for at, m in Parabola().odometry()[:1]] * 3
    code, out, err = analyse(foreign.write(tmp_path / 'bag', {'/odom': still}), '--verify')
    assert code == 3
    assert 'no flight' in out
    assert 'there is no flight to verify' in err


def test_odometry_without_twist_is_a_path(document, tmp_path):
    """Many programs leave the twist at 0; speed and climb then follow from the positions."""
    parabola = Parabola()
    messages = parabola.odometry()
    for _, message in messages:
        message.twist.twist.linear = foreign.vector((0.0, 0.0, 0.0))
        message.twist.twist.angular = foreign.vector((0.0, 0.0, 0.0))
    code, summary = document(foreign.write(tmp_path / 'bag', {'/odom': messages}))
    assert code == 0
    (flight,) = summary['discs'][0]['flights']
    # Differences of the position at 100 Hz: second order at the ends, exact for a parabola.
    assert flight['launch']['speed_m_s'] == pytest.approx(parabola.speed, rel=1e-6)
    assert flight['flight_time_s'] == pytest.approx(parabola.time, abs=2e-5)


def test_a_twist_in_the_wrong_frame_is_reported(analyse, tmp_path):
    code, out, _ = analyse(parabola_bag(tmp_path, in_map=True), '--verify')
    assert code == 3
    assert 'velocity: WRONG' in out
    assert 'it is given in map' in out


def test_topics_with_our_names_and_other_contents_are_tolerated(document, tmp_path):
    texts = ['disc: 3', '[1, 2]', '{', 'disc: a\nmodel: b\nrelease: {X: 1}\nwind: {}']
    bag = foreign.write(
        tmp_path / 'bag',
        {
            '/odom': Parabola().odometry(),
            '/configuration': [(START + i, foreign.text(text)) for i, text in enumerate(texts)],
            '/release': Parabola().odometry()[:1],
            '/flight_events': [(START, foreign.text('landed'))],
        },
    )
    code, summary = document(bag, '--verify')
    assert code == 0
    (flight,) = summary['discs'][0]['flights']
    assert 'no configuration' in flight['verification']['not_flown_again']


def test_nan_in_a_message_is_tolerated(document, tmp_path):
    parabola = Parabola()
    parabola.position[40] = np.nan
    bag = foreign.write(tmp_path / 'bag', {'/odom': parabola.odometry()})
    _, summary = document(bag, '--verify')
    assert [f['ended'] for f in summary['discs'][0]['flights']] == ['rest', 'end of the bag']


# ---- output and refusals ----


def test_the_plot_is_a_picture_and_needs_a_flight(analyse, steered, tmp_path):
    code, out, err = analyse(steered, '--plot', tmp_path / 'flight.png')
    assert (code, err) == (0, '')
    assert f'wrote {tmp_path}/flight.png' in out
    pixels = image.imread(tmp_path / 'flight.png')
    assert pixels.shape[0] > pixels.shape[1]  # with a row for what was commanded
    turn = (0, 0, 0, 1)
    still = [(at, foreign.odometry(at, (0, 0, 1), turn, (0, 0, 0), (0, 0, 0)))
             for at in range(START, START + 100)]  # fmt: skip
    bag = foreign.write(tmp_path / 'still', {'/odom': still})
    code, out, _ = analyse(bag)
    assert code == 0
    assert 'no flight' in out
    code, _, err = analyse(bag, '--plot', tmp_path / 'none.png')
    assert code == 1
    assert 'no flight to plot' in err
    assert not (tmp_path / 'none.png').exists()


def refused(result, *fragments):
    code, out, err = result
    assert (code, out) == (2, '')
    assert re.fullmatch(r'analyse_bag: error: [^\n]+\n', err)
    for fragment in fragments:
        assert fragment in err


def test_input_without_motion_is_refused_in_one_line(analyse, tmp_path):
    refused(analyse(tmp_path / 'nothing'), 'no such bag')
    (tmp_path / 'folder').mkdir()
    refused(analyse(tmp_path / 'folder'), 'no bag')
    (tmp_path / 'x.mcap').write_text('hello')
    refused(analyse(tmp_path / 'x.mcap'), 'no MCAP file')
    words = {'/chatter': [(START, foreign.text('hi'))]}
    bag = foreign.write(tmp_path / 'words', words)
    refused(analyse(bag), 'no nav_msgs/msg/Odometry', '/chatter (std_msgs/msg/String)')
    refused(analyse(bag, '--topic', 'odom'), 'no topic odom', '/chatter')
    refused(analyse(bag, '--topic', '/chatter'), '/chatter is std_msgs/msg/String')
    empty = foreign.write(tmp_path / 'empty', {'/odom': 'nav_msgs/msg/Odometry'})
    refused(analyse(empty), 'the bag is empty')
    refused(analyse(bag, '--plot', tmp_path / 'x.gif'), '--plot')
    refused(analyse(), 'BAG')


def test_help_states_units_and_needs_no_ros():
    code = "import sys; sys.modules['rclpy'] = None; from disc_sim_ros.cli.analyse_bag import main"
    result = subprocess.run(
        [sys.executable, '-c', f'{code}; main(["--help"])'],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    assert result.stdout.startswith('usage: analyse_bag')
    assert 'm/s' in result.stdout.replace('(m, s)', 'm/s')
    assert '3: --verify found a difference' in ' '.join(result.stdout.split())
    assert EXECUTABLE.exists()
