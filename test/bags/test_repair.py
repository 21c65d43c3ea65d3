"""`repair`, and the program `repair_bag`: what it keeps, says and refuses."""

import json
from pathlib import Path
import re
import shutil
import subprocess
import sys

from mcap.reader import make_reader
from mcap.writer import Writer
import pytest
from rosbags.rosbag2 import Reader
import yaml

from bags.making import ODOMETRIES, ODOMETRY, START, STEP, TYPES, everything, topic, write_bag
from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.repair import repair
from disc_sim_ros.bags.topic import Qos
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.cli.repair_bag import main
from disc_sim_ros.errors import BagError, ConfigError

pytest.importorskip('rclpy')

PROGRAM = Path(sys.executable).with_name('repair_bag')


def run(*arguments) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [PROGRAM, *arguments], capture_output=True, text=True, check=False, timeout=120
    )


@pytest.fixture
def killed(tmp_path) -> Path:
    """A bag whose recorder was killed in its second file."""
    folder = tmp_path / 'killed'
    with BagWriter(folder, custom_data={'drops': '3'}, ros_distro='jazzy') as bag:
        odom = bag.add(topic('/odom', ODOMETRY, Qos(), Qos(reliability='best_effort')))
        bag.attach('sim.yaml', 'text/yaml', b'speed: 15\n', log_time=7, create_time=5)
        for n in range(200):
            bag.write(odom, ODOMETRIES[n], START + n * STEP, START + n)
        bag.split()
        for n in range(200, 300):
            bag.write(odom, ODOMETRIES[n], START + n * STEP, START + n)
        bag.flush()
        shutil.copytree(folder, tmp_path / 'copy')
    shutil.rmtree(folder)
    (tmp_path / 'copy').rename(folder)
    return folder


def test_all_of_a_killed_bag_is_kept(killed, tmp_path, foxglove):
    before = open_bag(killed)
    assert not before.complete
    report = repair(killed, tmp_path / 'made')
    made = open_bag(tmp_path / 'made')
    assert made.complete
    assert everything(made) == everything(before)
    assert made.message_count == 300
    assert made.custom_data == {'drops': '3'}
    assert made.topics == before.topics
    assert [(a.name, a.data, a.log_time, a.create_time) for a in made.attachments] == [
        ('sim.yaml', b'speed: 15\n', 7, 5)
    ]
    assert [p.name for p in made.files] == ['made_0.mcap', 'made_1.mcap']
    assert report.kept == {'/odom': 300}
    assert report.attachments == 1
    assert report.losses == ()
    assert not report.was_whole
    with Reader(tmp_path / 'made') as reader:
        assert sum(1 for _ in reader.messages()) == 300
        [connection] = reader.connections
        assert connection.digest == TYPES.hash_rihs01(ODOMETRY)
    for path, count in zip(made.files, (200, 100), strict=True):
        with path.open('rb') as file:
            assert sum(1 for _ in make_reader(file, validate_crcs=True).iter_messages()) == count
    assert [f['topics']['/odom']['count'] for f in foxglove(*made.files)] == [200, 100]


def test_a_bag_without_metadata_gets_it_back(killed, tmp_path):
    before = yaml.safe_load((killed / 'metadata.yaml').read_text(encoding='utf-8'))
    (killed / 'metadata.yaml').unlink()
    repair(killed, tmp_path / 'killed 2')
    again = yaml.safe_load((tmp_path / 'killed 2/metadata.yaml').read_text(encoding='utf-8'))
    for root in (before, again):
        about = root['rosbag2_bagfile_information']
        for file in about['files']:
            file['path'] = ''
        about['relative_file_paths'] = []
    assert again == before


def test_the_repair_of_a_repaired_bag_changes_nothing(killed, tmp_path):
    repair(killed, tmp_path / 'once')
    report = repair(tmp_path / 'once', tmp_path / 'twice/once')
    assert report.was_whole
    for name in ('metadata.yaml', 'once_0.mcap', 'once_1.mcap'):
        once, twice = (tmp_path / f / name for f in ('once', 'twice/once'))
        assert once.read_bytes() == twice.read_bytes()


def test_sequences_metadata_and_encodings_of_other_recorders_are_kept(tmp_path):
    with (tmp_path / 'x.mcap').open('wb') as file:
        writer = Writer(file)
        writer.start('', 'others')
        binary = bytes(range(256))
        schema = writer.register_schema('odd.Odd', 'protobuf', binary)
        channel = writer.register_channel('odd', 'protobuf', schema, {'a': 'b'})
        writer.add_message(channel, 5, b'xyz', 3, sequence=9)
        writer.add_metadata('about', {'c': 'd'})
        writer.finish()
    repair(tmp_path / 'x.mcap', tmp_path / 'made')
    with (tmp_path / 'made/made_0.mcap').open('rb') as file:
        reader = make_reader(file)
        [(schema, channel, message)] = reader.iter_messages()
        assert (schema.name, schema.encoding, schema.data) == ('odd.Odd', 'protobuf', binary)
        assert (channel.topic, channel.message_encoding) == ('odd', 'protobuf')
        assert channel.metadata['a'] == 'b'
        assert (message.log_time, message.publish_time, message.sequence) == (5, 3, 9)
        assert {m.name: m.metadata for m in reader.iter_metadata()}['about'] == {'c': 'd'}


def test_the_source_is_not_touched_and_the_target_not_overwritten(killed, tmp_path):
    before = {p.name: p.read_bytes() for p in killed.iterdir()}
    repair(killed, tmp_path / 'made')
    assert {p.name: p.read_bytes() for p in killed.iterdir()} == before
    for target in (tmp_path / 'made', killed, tmp_path / 'made/metadata.yaml'):
        with pytest.raises(ConfigError, match='it exists already'):
            repair(killed, target)
    for target in (killed / 'made', killed / 'deep/made', tmp_path / 'made/../killed/x'):
        with pytest.raises(ConfigError, match='must not lie in'):
            repair(killed, target)
    assert sorted(p.name for p in tmp_path.iterdir()) == ['killed', 'made']


def test_a_bag_of_others_that_was_killed_is_made_whole(tmp_path):
    """As `ros2 bag record` leaves it: chunks without end, no metadata.yaml."""
    (tmp_path / 'bag').mkdir()
    with (tmp_path / 'bag/bag_0.mcap').open('wb') as file:
        writer = Writer(file, chunk_size=50_000)
        writer.start('ros2', 'others')
        schema = writer.register_schema(ODOMETRY, 'ros2msg', schemas.definition(ODOMETRY).encode())
        channel = writer.register_channel('/odom', 'cdr', schema, {})
        for n in range(300):
            writer.add_message(channel, START + n, ODOMETRIES[n], START)
        file.flush()
    left = everything(open_bag(tmp_path / 'bag'))
    assert 200 < len(left) < 300
    repair(tmp_path / 'bag', tmp_path / 'made')
    assert everything(open_bag(tmp_path / 'made')) == left
    with Reader(tmp_path / 'made') as reader:
        assert sum(1 for _ in reader.messages()) == len(left)


# ---- the program ----


def test_the_program_says_what_it_kept_and_lost(killed, tmp_path):
    path = killed / 'killed_1.mcap'
    path.write_bytes(path.read_bytes()[:-2000])
    done = run(killed, tmp_path / 'made')
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == f'{killed} -> {tmp_path / "made"}'
    bag = open_bag(tmp_path / 'made')
    assert lines[1].split() == ['/odom', str(bag.message_count), 'messages']
    assert 'killed_1.mcap: ' in lines[-1]
    assert done.stdout.count('lost') == 1


def test_the_program_prints_json(killed, tmp_path):
    done = run(killed, tmp_path / 'made', '--json')
    assert done.returncode == 0
    assert json.loads(done.stdout) == {
        'source': str(killed),
        'target': str(tmp_path / 'made'),
        'was_whole': False,
        'message_count': 300,
        'kept': {'/odom': 300},
        'attachments': 1,
        'bytes_lost': 0,
        'losses': [],
        'unknown': ['killed_1.mcap has no end: what was not on the disk when its recorder ended'],
        'mended': [
            'killed_1.mcap: it was damaged or had no end',
        ],
    }


def test_bad_input_is_one_line_and_leaves_nothing(killed, tmp_path, capsys):
    (tmp_path / 'text.mcap').write_text('hello')
    cases = [
        ([], 2, 'the following arguments are required: IN, OUT'),
        ([killed, killed], 2, 'it exists already'),
        ([killed, killed / 'x'], 2, 'must not lie in'),
        ([tmp_path / 'no', tmp_path / 'made'], 2, 'there is no such bag'),
        ([tmp_path / 'text.mcap', tmp_path / 'made'], 1, 'no MCAP file'),
        ([killed, '/proc/made'], 2, "OUT: '/proc/made' is not allowed; the folder cannot be made"),
    ]
    for arguments, code, says in cases:
        try:
            returned = main([str(argument) for argument in arguments])
        except SystemExit as ended:  # of argparse
            returned = ended.code
        shown = capsys.readouterr()
        assert returned == code, shown.err
        *notes, last = shown.err.splitlines()
        assert all(note.startswith('repair_bag: reading') for note in notes)
        assert last.startswith('repair_bag: error: ')
        assert says in last
        assert shown.out == ''
    assert sorted(p.name for p in tmp_path.iterdir()) == ['killed', 'text.mcap']


def test_help_names_units_and_exit_codes():
    done = run('--help')
    assert done.returncode == 0
    assert 'usage' in done.stdout
    for word in ('bytes', 'ns', 'Exit code 0'):
        assert word in done.stdout


def test_control_characters_of_a_bag_do_not_reach_the_terminal(tmp_path):
    evil = '/a\x1b[31mred\x07\nnew \u202eline'
    with BagWriter(tmp_path / 'bag') as bag:
        bag.write(bag.add(topic(evil, '\x1b]0;title\x07')), b'\0\1\0\0', 1, 1)
    done = run(tmp_path / 'bag', tmp_path / 'made')
    assert done.returncode == 0, done.stderr
    assert not set(done.stdout + done.stderr) & set('\x1b\x07\u202e')
    assert r'/a\x1b[31mred\x07\nnew \u202eline  1 message' in done.stdout
    assert [t.name for t in open_bag(tmp_path / 'made').topics] == [evil]
    with pytest.raises(BagError) as caught:
        list(open_bag(tmp_path / 'made').messages())
    assert str(caught.value).isprintable()


INTERRUPTED = """
import signal, sys
from disc_sim_ros.bags.mcap_writer import McapFile
from disc_sim_ros.cli import start

def interrupted(file):
    print(file.path, flush=True)
    assert file.path.stat().st_size > 0
    signal.raise_signal(signal.SIGINT)

McapFile.finish = interrupted
sys.exit(start.repair_bag())
"""


def test_ctrl_c_leaves_no_half_bag(killed, tmp_path):
    """It comes when the file that the recorder did not finish has all its messages."""
    before = set(tmp_path.iterdir())
    done = subprocess.run(
        [sys.executable, '-c', INTERRUPTED, killed, tmp_path / 'made'],
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 130
    assert re.fullmatch(
        rf'{re.escape(str(tmp_path))}/\.[^/]+\.part/made/made_1\.mcap\n', done.stdout
    )
    assert 'writing' in done.stderr
    assert 'Traceback' not in done.stderr
    assert set(tmp_path.iterdir()) == before


def test_a_full_disk_is_reported(tmp_path):
    write_bag(tmp_path / 'bag', 2000)
    code = (
        'import resource, sys\n'
        'from disc_sim_ros.cli.repair_bag import main\n'
        'resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, resource.RLIM_INFINITY))\n'
        'sys.exit(main(sys.argv[1:]))'
    )
    done = subprocess.run(
        [sys.executable, '-c', code, tmp_path / 'bag', tmp_path / 'made'],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    says = f'{tmp_path / "made"}: cannot be written (File too large); nothing is left of it'
    assert done.stderr.splitlines()[-1] == f'repair_bag: error: {says}'
    assert 'Traceback' not in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ['bag']


def test_attachments_of_a_recorder_that_was_killed_before_its_first_message_are_kept(tmp_path):
    bag = BagWriter(tmp_path / 'bag')
    bag.attach('a.txt', 'text/plain', b'text')
    bag.flush()
    content = (tmp_path / 'bag/bag_0.mcap').read_bytes()
    bag.close()
    (tmp_path / 'x.mcap').write_bytes(content)
    report = repair(tmp_path / 'x.mcap', tmp_path / 'made')
    assert (report.message_count, report.attachments) == (0, 1)
    assert [a.data for a in open_bag(tmp_path / 'made').attachments] == [b'text']


def test_repair_of_an_empty_file_is_refused(tmp_path):
    (tmp_path / 'x.mcap').touch()
    with pytest.raises(BagError, match='is empty'):
        repair(tmp_path / 'x.mcap', tmp_path / 'made')
