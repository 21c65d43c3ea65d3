"""`fly --bag` as a command."""

import os
from pathlib import Path
import re
import subprocess
import sys

import pytest

from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.cli import fly

SHORT = ('--height', '0.3', '--pitch', '-5')


@pytest.fixture
def run(capsys):
    """Run `fly` in this process: exit code, stdout, stderr."""

    def call(*arguments):
        try:
            code = fly.main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = end.code
        return code, *capsys.readouterr()

    return call


def refused(result, *fragments):
    code, out, err = result
    assert (code, out) == (2, '')
    assert re.fullmatch(r'fly: error: [^\n]+\n', err)
    for fragment in fragments:
        assert fragment in err


def test_it_writes_a_bag_and_reports_it(run, tmp_path):
    pytest.importorskip('rclpy')
    code, out, err = run(*SHORT, '--bag', tmp_path / 'a b' / 'bag')
    assert (code, err) == (0, '')
    bag = open_bag(tmp_path / 'a b' / 'bag')
    assert bag.complete
    assert f'wrote   {tmp_path}/a b/bag: {bag.message_count} messages' in out
    assert bag.start % 1_000_000_000 == 0
    odom = next(info for info in bag.topics if info.topic.name == '/odom')
    assert odom.message_count > 20
    run(*SHORT, '--bag', tmp_path / 'half', '--samples', 100)
    half = next(i for i in open_bag(tmp_path / 'half').topics if i.topic.name == '/odom')
    assert half.message_count == odom.message_count // 2 + 1
    code, _, _ = run(*SHORT, '--bag', tmp_path / 'slow', '--step', 0.01)
    assert code == 0  # 100 Hz: a step has no more than one message
    assert sorted(path.name for path in tmp_path.iterdir()) == ['a b', 'half', 'slow']


def test_a_bag_that_cannot_be_written_is_refused_before_the_flight(run, tmp_path):
    pytest.importorskip('rclpy')
    (tmp_path / 'bag').mkdir()
    refused(run('--bag', tmp_path / 'bag'), '--bag', 'exists already')
    refused(run('--bag', tmp_path / 'b', '--samples', 300), '--samples: 300', 'whole multiple')
    refused(run('--bag', tmp_path / 'b', '--step', 0.003), '--step: 0.003', 'whole number')
    refused(run('--bag', tmp_path / 'b', '--spin', 900, '--step', 0.1), '--step')
    refused(run('--bag', tmp_path / 'b', '--json'), '--json')
    refused(run('--bag', tmp_path / 'bag' / 'x', '--height', -1), '--height')
    file = tmp_path / 'file'
    file.touch()
    code, _, err = run(*SHORT, '--bag', file / 'bag')
    assert code == 2
    assert '--bag' in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'file']


def test_without_ros_it_names_the_missing_packages_in_one_line(tmp_path):
    code = (
        "import sys; sys.modules['rclpy'] = None; from disc_sim_ros.cli.fly import main; "
        f'sys.exit(main(["--bag", {str(tmp_path / "bag")!r}]))'
    )
    result = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, check=False, timeout=120
    )
    refused((result.returncode, result.stdout, result.stderr), '--bag', 'ROS 2', 'rclpy')


def test_make_fly_also_works_without_ros(tmp_path):
    """The target itself, with programs in place of those of .venv that print their arguments."""
    root = Path(__file__).parents[2]
    (tmp_path / 'Makefile').write_text((root / 'Makefile').read_text())

    def program(name, line):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f'#!/bin/sh\n{line}\n')
        path.chmod(0o755)

    def make_fly():
        command = ['make', 'fly', 'DISC=my disc', "THROW=--speed 25 --bag 'a b'"]
        environment = {k: v for k, v in os.environ.items() if not k.startswith('MAKE')}
        return subprocess.run(
            command,
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=True,
            timeout=120,
        ).stdout

    program('tools/setup-venv', 'exit 0')
    for name in ('demo', 'fly'):
        program(f'.venv/bin/{name}', f'printf "{name}"; printf "<%s>" "$@"')
    program('.venv/bin/python', 'exit 0')
    assert make_fly() == 'demo<--disc><my disc><--speed><25><--bag><a b>'
    program('.venv/bin/python', 'exit 1')
    note, _, called = make_fly().partition('\n')
    assert note.startswith('fly: .venv has no ROS 2')
    files = '<--plot><flights/fig5.png><--html><flights/fig5.html>'
    assert called.startswith(f'fly{files}<--disc><my disc><--speed><25>')
    assert (tmp_path / 'flights').is_dir()
