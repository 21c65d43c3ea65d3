"""`demo` as a command: real processes, a real bag, and no process left running."""

import json
import os
from pathlib import Path
import re
import signal
import subprocess
import sys

from matplotlib import image
import pytest

pytest.importorskip('rclpy')

from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.cli import analyse_bag, demo, fly

pytestmark = pytest.mark.ros

EXECUTABLE = Path(sys.executable).with_name('demo')
DEADLINE = 120.0  # s; ten on an idle machine
SHORT = ['--height', '0.5', '--pitch', '-2', '--spin', '40']


def start(folder, *arguments):
    environment = os.environ | {'ROS_LOG_DIR': str(folder / 'ros_log')}
    return subprocess.Popen(
        [EXECUTABLE, *arguments],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def descendants(pid):
    """Return the processes whose parent is `pid`."""
    processes = []
    for path in Path('/proc').glob('[0-9]*/stat'):
        try:
            parent = int(path.read_text().rpartition(')')[2].split()[1])
        except OSError:
            continue
        if parent == pid:
            processes.append(int(path.parent.name))
    return processes


def is_running(pid):
    try:
        state = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0]
    except OSError:
        return False
    return state != 'Z'


def test_it_throws_records_verifies_and_reports(tmp_path, capsys):
    """Steered, in wind and gusts: the flight of `fly`, recorded completely."""
    flags = [
        *SHORT,
        '--control',
        '0.002',
        '0.003',
        '0',
        '--turbulence',
        '9',
        '--wind',
        '1',
        '2',
        '0',
    ]
    process = start(tmp_path, *flags)
    out, err = process.communicate(timeout=DEADLINE)
    assert process.returncode == 0, err
    assert all(line.startswith('demo: ') for line in err.splitlines()), err
    (folder,) = (tmp_path / 'flights').iterdir()
    bag, page, plot = (folder / name for name in ('bag', 'flight.html', 'flight.png'))
    assert sorted(folder.iterdir()) == [bag, page, plot]
    assert image.imread(plot).shape[2] >= 3
    for text in (
        'identical to the last bit',
        'nothing lost',
        str(page.relative_to(tmp_path)),
        'steered   coefficients changed once, first at 0.000 s',
        f'analyse_bag --verify {bag.relative_to(tmp_path)}',
        f'ros2 bag play {bag.relative_to(tmp_path)}',
        'Foxglove',
    ):
        assert text in out, text
    assert len(out.splitlines()) < 24  # one screen

    assert analyse_bag.main([str(bag), '--json', '--verify']) == 0
    document = json.loads(capsys.readouterr().out)
    (flight,) = document['discs'][0]['flights']
    assert fly.main([*flags, '--step', '0.001', '--json']) == 0
    flown = json.loads(capsys.readouterr().out)
    assert flight['landing_position_m'] == flown['landing_position_m']
    assert flight['flight_time_s'] == flown['flight_time_s']
    assert flight['starts_late_s'] <= 1 / 200
    assert flight['messages']['missing'] == 0
    names = {e['name'] for e in document['discs'][0]['events']}
    assert names - {'time jumped'} == {'thrown', 'landed'}  # a busy machine makes time jump
    topics = {info.topic.name: info.message_count for info in open_bag(bag).topics}
    for name in ('/odom', '/pose', '/transform', '/joint_states', '/imu', '/release', '/markers'):
        assert topics[name], name


@pytest.mark.parametrize(
    ('number', 'when'), [(signal.SIGINT, 'starting'), (signal.SIGTERM, 'throwing')]
)
def test_a_signal_ends_all_processes(tmp_path, number, when):
    process = start(tmp_path, '--height', '20', '--bag', 'mine')
    children = []
    try:
        for line in process.stderr:
            if when in line:
                break
        while not children and process.poll() is None:
            children = descendants(process.pid)
        process.send_signal(number)
        _, err = process.communicate(timeout=DEADLINE)
    finally:
        process.kill()
    assert process.returncode == 128 + number, err
    assert 'Traceback' not in err
    assert children
    assert not [pid for pid in children if is_running(pid)]
    if when == 'throwing':
        assert open_bag(tmp_path / 'mine').complete
    assert not (tmp_path / 'mine.png').exists()


def refused(capsys, arguments, *fragments):
    with pytest.raises(SystemExit) as end:
        demo.main(arguments)
    out, err = capsys.readouterr()
    assert (end.value.code, out) == (2, '')
    assert re.fullmatch(r'demo: error: [^\n]+\n', err)
    for fragment in fragments:
        assert fragment in err


def test_bad_input_is_refused_before_anything_is_started(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'bag').mkdir()
    refused(capsys, ['--bag', 'bag'], '--bag', 'nothing is overwritten')
    refused(capsys, ['--speed', '300'], '--speed', 'from 0 to 200')
    refused(capsys, ['--disc', 'plate'], '--disc', 'plate')
    refused(capsys, ['--height', '-1'], '--height')
    refused(capsys, ['--step', '0.003'], '--step', 'whole number')
    refused(capsys, ['--step', '2e-6'], '--step', 'physics_rate')
    assert [path.name for path in tmp_path.iterdir()] == ['bag']


def test_without_ros_it_is_refused_in_one_line():
    code = "import sys; sys.modules['rclpy'] = None; from disc_sim_ros.cli.demo import main; "
    for arguments, returned, text in (
        ([], 1, 'ROS 2'),
        (['--help'], 0, 'usage: demo'),
    ):
        result = subprocess.run(
            [sys.executable, '-c', f'{code} sys.exit(main({arguments!r}))'],
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
        )
        assert result.returncode == returned
        assert text in result.stdout + result.stderr
        assert len(result.stderr.splitlines()) <= 1
