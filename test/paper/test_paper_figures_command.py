"""`paper_figures` as a command."""

import csv
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

import pytest

from disc_sim_ros.cli import paper_figures
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.paper import report, run
from disc_sim_ros.paper.figure_files import WrittenFigure

pytestmark = pytest.mark.xdist_group('paper_figures')

PROGRAM = [sys.executable, '-m', 'disc_sim_ros.cli.paper_figures']


def started(*arguments, folder):
    return subprocess.run(
        [*PROGRAM, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    """A folder with two figures and the table, made by two processes."""
    folder = tmp_path_factory.mktemp('made')
    (folder / 'out').mkdir()
    (folder / 'out' / 'mine.txt').write_text('keep', encoding='utf-8')
    (folder / 'out' / 'roll_rate.csv').write_text('old', encoding='utf-8')
    done = started(
        '--out', 'out', '--only', 'roll_rate,3,statements', '--formats', 'png', '--jobs', '2',
        folder=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder / 'out', done.stdout


def test_it_writes_only_figures_tables_and_reports(made):
    folder, _ = made
    names = {path.name for path in folder.iterdir()}
    assert names == {
        'mine.txt', 'report.md', 'report.html', 'statements.csv',
        'fig03.csv', 'fig03.png', 'fig03_dark.png',
        'roll_rate.csv', 'roll_rate.png', 'roll_rate_dark.png',
    }  # fmt: skip
    assert (folder / 'mine.txt').read_text(encoding='utf-8') == 'keep'
    with (folder / 'roll_rate.csv').open(encoding='utf-8', newline='') as file:
        assert len(list(csv.DictReader(file))) == 12


def test_it_shows_progress_and_the_outcome(made):
    _, printed = made
    lines = printed.splitlines()
    assert [line[:6] for line in lines[1:4]] == ['[ 1/3]', '[ 2/3]', '[ 3/3]']
    assert re.search(r'Roll rate: .*, \d+\.\d s$', printed, re.MULTILINE)
    for damping in ('10 % damping', 'damping as printed'):
        outcome = rf'^Of \d+ statements, {damping}: \d+ reproduced, \d+ differs'
        assert re.search(outcome, printed, re.MULTILINE)
    assert 'within 1 cm' in printed
    assert re.search(r'^wrote out/report.html .* in \d+ s$', printed, re.MULTILINE)


def test_the_reports_are_complete(made):
    folder, _ = made
    html = (folder / 'report.html').read_text(encoding='utf-8')
    markdown = (folder / 'report.md').read_text(encoding='utf-8')
    beside = set(re.findall(r'(?:src|href|srcset)="([^"#]+)"', html))
    beside |= set(re.findall(r'\]\(([^)]+)\)', markdown))
    assert beside == {path.name for path in folder.iterdir()} - {
        'mine.txt', 'report.md', 'report.html'
    }  # fmt: skip
    assert 'http' not in html
    assert html.count('<picture>') == 2
    assert html.count('(prefers-color-scheme: dark)') == 2 + 1  # pictures and page
    assert html.index('Fig. 3') < html.index('Roll rate')  # in the paper's order
    for text in (html, markdown):
        assert 'damping as printed' in text
        assert 'axes 3' in text
        assert 'test_reference_of_figures.py' in text
    with (folder / 'statements.csv').open(encoding='utf-8', newline='') as file:
        statements = len(list(csv.DictReader(file)))
    assert html.count('<tr>') == 1 + 2 + 1 + statements
    rows = [line for line in markdown.splitlines() if line.startswith('| ')]
    assert len(rows) == html.count('<tr>')


def test_a_distant_second_integration_is_reported():
    far = WrittenFigure('7', 'Fig. 7: x', 'c', ('f.',), ('fig07.csv',), 'θ 10°', 0.02, 1.0)
    written = report.Report((far,), None, dark=True)
    assert 'NOT within 1 cm' in ' '.join(written.summary())
    assert written.checks()[0][-1] == 'NOT within 1 cm'
    assert 'NOT within 1 cm' in report.html(written)


def test_light_only_and_svg_in_one_process(tmp_path, capsys):
    arguments = ['--out', str(tmp_path / 'a' / 'b'), '--only', 'roll_rate', '--no-dark']
    assert paper_figures.main([*arguments, '--formats', 'svg', '--jobs', '1']) == 0
    names = {path.name for path in (tmp_path / 'a' / 'b').iterdir()}
    assert names == {'roll_rate.csv', 'roll_rate.svg', 'report.md', 'report.html'}
    html = (tmp_path / 'a' / 'b' / 'report.html').read_text(encoding='utf-8')
    assert '<img src="roll_rate.svg"' in html
    assert '<source' not in html
    assert 'statements' not in capsys.readouterr().out


@pytest.mark.parametrize(
    ('arguments', 'says'),
    [
        (['--only', '13'], "--only: '13' is not allowed; choose from 3, 4"),
        (['--only', ''], "--only: '' is not allowed"),
        (['--formats', 'gif'], "--formats: 'gif' is not allowed; choose from png, svg"),
        (['--jobs', '0'], "--jobs: '0' is not allowed; give a whole number from 1 to 64"),
        (['--jobs', 'two'], '--jobs'),
        (['--out', 'file'], "--out: 'file' is not allowed; this is not a folder"),
        (['--out', 'file/below'], '--out: '),
        (['--out', '/proc/none'], '--out: '),
        (['--out', 'a\0b'], '--out: '),
        (['extra'], 'unrecognized arguments: extra'),
    ],
)
def test_bad_input_is_refused_in_one_line_with_code_2(
    arguments, says, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    Path('file').write_text('', encoding='utf-8')
    with pytest.raises(SystemExit) as ended:
        paper_figures.main(arguments)
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith('paper_figures: error: ')
    assert says in error
    assert error.count('\n') == 1
    assert {path.name for path in tmp_path.iterdir()} == {'file'}


def test_a_folder_without_permission_is_refused(tmp_path, monkeypatch):
    def refuse(**_):
        raise PermissionError(13, 'Permission denied')

    # Root may write everywhere, so the refusal is simulated.
    monkeypatch.setattr(paper_figures.tempfile, 'TemporaryFile', refuse)
    with pytest.raises(ConfigError, match=r'cannot write there \(Permission denied\)'):
        paper_figures.writable_folder(str(tmp_path))


def test_a_full_disk_is_reported_in_one_line_with_code_1(tmp_path, monkeypatch, capsys):
    def full(*_, **__):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(run, 'part', full)
    assert paper_figures.main(['--out', str(tmp_path), '--only', '3']) == 1
    assert 'No space left on device' in capsys.readouterr().err


def test_the_parts_of_the_command_are_all_figures_and_the_statements():
    assert paper_figures.PARTS == run.PARTS
    assert set(paper_figures.SLOW) < set(run.PARTS)


def test_help_imports_neither_ros_nor_matplotlib():
    code = (
        'import sys\n'
        'from disc_sim_ros.cli import paper_figures\n'
        'try:\n'
        "    paper_figures.main(['--help'])\n"
        'except SystemExit as end:\n'
        '    assert end.code == 0\n'
        "assert not {'rclpy', 'matplotlib'} & set(sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout.startswith('usage: paper_figures')
    for word in ('m/s', 'degrees', '--only', 'roll_rate', '--jobs'):
        assert word in done.stdout


def test_ctrl_c_ends_it_with_130_without_a_traceback(tmp_path):
    program = subprocess.Popen(
        [*PROGRAM, '--out', 'out'], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True,
    )  # fmt: skip
    assert 'parts into' in program.stdout.readline()
    children = Path(f'/proc/{program.pid}/task/{program.pid}/children')
    deadline = time.monotonic() + 120
    while len(children.read_text().split()) < 3 and time.monotonic() < deadline:
        time.sleep(0.05)  # until both jobs, and what Python starts beside them, are there
    os.killpg(program.pid, signal.SIGINT)  # as a terminal does: to all of them
    _, error = program.communicate(timeout=120)
    assert program.returncode == 130
    assert 'Traceback' not in error
    with pytest.raises(ProcessLookupError):
        _wait_for_end(program.pid)


def _wait_for_end(group):
    """Raise ProcessLookupError once the group has no process left."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        os.killpg(group, 0)
        time.sleep(0.05)
