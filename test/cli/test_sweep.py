"""`sweep` and `optimise` as commands: what they print, write and refuse."""

import json
import os
from pathlib import Path
import pty
import re
import shlex
import signal
import subprocess
import sys
import time

import numpy as np
from pyarrow import parquet
import pytest

from disc_sim_ros.cli import fly, optimise, sweep
from disc_sim_ros.cli.progress import duration, progress_text
from disc_sim_ros.quantities import VARIED

BIN = Path(sys.executable).parent


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(program, line: str, capsys) -> str:
    with pytest.raises(SystemExit) as ended:
        program.main(shlex.split(line))
    assert ended.value.code == 2
    shown = capsys.readouterr()
    assert shown.out == ''
    assert len(shown.err.splitlines()) == 1
    return shown.err


def test_help_has_every_quantity_with_its_unit(capsys):
    for program in (sweep, optimise):
        with pytest.raises(SystemExit) as ended:
            program.main(['--help'])
        assert ended.value.code == 0
        text = ' '.join(capsys.readouterr().out.split())
        assert text.startswith('usage')
        named = [f'{q.name} ({q.unit})' if q.unit else q.name for q in VARIED.values()]
        assert [word for word in named if word not in text] == []


def test_a_grid_is_summarised_written_and_plotted(capsys):
    line = '--vary pitch=0:30:5 --vary roll=-10:10/3 --step 0.02 --plot a.png --output a.parquet'
    assert sweep.main(shlex.split(line)) == 0
    out = capsys.readouterr().out
    assert 'frisbee: 21 flights (grid of 7 x 3 points): 21 landed' in out
    assert re.search(r'furthest +\d+\.\d\d m at pitch \d+ degrees, roll -?\d+ degrees', out)
    assert 'wrote    a.parquet, 21 rows' in out
    table = parquet.read_table('a.parquet')
    assert table['pitch_deg'].to_pylist()[::3] == [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0]
    assert table['roll_deg'].to_pylist()[:3] == [-10.0, 0.0, 10.0]
    assert Path('a.png').read_bytes().startswith(b'\x89PNG')
    assert sorted(path.name for path in Path().iterdir()) == ['a.parquet', 'a.png']


def test_json_is_one_document_that_agrees_with_the_file(capsys):
    line = '--normal speed=20,1 --scatter pitch=2 --correlation speed,pitch=0.5 --count 500 ' \
        '--seed 4 --step 0.02 --json --output b.parquet --sobol'  # fmt: skip
    assert sweep.main(shlex.split(line)) == 0
    document = json.loads(capsys.readouterr().out)
    table = parquet.read_table('b.parquet')
    ranges = table['range_m'].to_numpy()
    assert document['results']['range_m']['mean'] == pytest.approx(ranges.mean(), rel=1e-9)
    assert document['counts']['landed'] == 500
    assert document['question']['fixed']['speed'] == 15.0
    assert document['question']['scatter']['pitch'] == {'normal': [None, 2.0]}
    x, y = table['x_m'].to_numpy(), table['y_m'].to_numpy()
    assert np.allclose(document['landing_ellipse']['covariance_m2'], np.cov(x, y))
    speed, pitch = table['speed_m_s'].to_numpy(), table['pitch_deg'].to_numpy()
    assert np.corrcoef(speed, pitch)[0, 1] == pytest.approx(0.5, abs=0.02)  # 500 Sobol points


@pytest.mark.parametrize(
    ('line', 'words'),
    [
        ('', 'all flights would be the same; give --vary'),
        ('--vary pitch=10:0:1', 'the grid is empty'),
        ('--vary pitch=0:10:0', 'the grid is empty'),
        ('--vary pitch=0:10', 'START:STOP:STEP'),
        ('--vary pitch=0:10/0', 'N is a whole number'),
        ('--vary pitch', 'NAME='),
        ('--vary pitch=a,b', 'finite numbers|NAME='),
        ('--vary pitch=nan', 'finite numbers'),
        ('--vary pitch=1,1', 'twice'),
        ('--vary pich=1,2', 'choose from speed'),
        ('--vary pitch=1,2 --vary pitch=3,4', 'varied twice'),
        ('--vary pitch=1,2 --pitch 5', '--pitch.*give one of the two'),
        ('--vary spin=30,40 --advance-ratio 0.3', '--advance-ratio'),
        ('--vary speed=-1,2', 'from 0 to 200 m/s'),
        ('--normal speed=20', 'NAME=MEAN,SD'),
        ('--normal speed=20,0', 'standard deviation'),
        ('--normal speed=20,1 --uniform speed=1,2', 'scatters twice'),
        ('--vary speed=10,20 --normal speed=20,1', 'varied already'),
        ('--uniform pitch=5,4', 'high'),
        ('--scatter pitch=2 --correlation pitch,speed=0.5', 'only scattered quantities'),
        ('--scatter pitch=2 --scatter roll=2 --correlation pitch,roll=1.5', 'from -1 to 1'),
        ('--scatter pitch=2 --correlation pitch=0.5', 'A,B=R'),
        ('--scatter pitch=2 --count 0', 'whole number from 1'),
        ('--vary pitch=1,2 --count 5', '--count'),
        ('--vary pitch=1,2 --sobol', '--sobol'),
        ('--vary pitch=1,2 --output a.txt', '.parquet or .csv'),
        ('--vary pitch=1,2 --output none/a.csv', 'does not exist'),
        ('--vary pitch=1,2 --plot a.gif', '.png, .svg or .pdf'),
        ('--vary pitch=1,2 --executor magic', 'choose from threads'),
        ('--vary pitch=1,2 --executor threads=3', 'takes no address'),
        ('--vary pitch=0:30:1e-9', 'at most'),
        ('--vary height=-1,2', 'from 0 to'),
        ('--vary spin=30,900 --step 0.02', 'at most'),
    ],
)
def test_bad_input_is_refused_in_one_line(line, words, capsys, folder):
    error = refused(sweep, line, capsys)
    assert error.startswith('sweep: error: ')
    assert re.search(words, error), error
    assert list(folder.iterdir()) == []


def test_an_existing_file_is_overwritten_only_with_force(capsys, folder):
    (folder / 'sweep.parquet').write_text('mine')
    assert '--force' in refused(sweep, '--vary pitch=1,2', capsys)
    assert (folder / 'sweep.parquet').read_text() == 'mine'
    assert sweep.main(['--vary', 'pitch=1,2', '--force']) == 0
    assert parquet.read_metadata('sweep.parquet').num_rows == 2


def test_ctrl_c_keeps_finished_flights_and_resume_refuses_another_study(folder, capsys):
    words = ['--scatter', 'pitch=2', '--count', '20000', '--batch', '200', '--step', '0.002',
             '--output', 'c.csv']  # fmt: skip
    leader, follower = pty.openpty()
    process = subprocess.Popen([BIN / 'sweep', *words], cwd=folder, stderr=follower)
    os.close(follower)
    shown = b''
    try:
        deadline = time.monotonic() + 120.0
        while b'left' not in shown and time.monotonic() < deadline:
            shown += os.read(leader, 4096)
        process.send_signal(signal.SIGINT)
        while True:
            try:
                shown += os.read(leader, 4096)
            except OSError:  # the other end is closed
                break
        assert process.wait(60.0) == 130
    finally:
        process.kill()
        os.close(leader)
    text = shown.decode()
    assert re.search(r'\[#*\.+\] +\d+% \d+ of 20000 flights, \d+/s, .* left', text)
    stopped = re.search(r'sweep: stopped; (\d+) of 20000 flights are kept in c.csv.parts', text)
    assert 'Traceback' not in text
    parts = list((folder / 'c.csv.parts').glob('*.parquet'))
    assert int(stopped[1]) == 200 * len(parts)
    assert not (folder / 'c.csv').exists()
    changed = [*words[:-6], '--batch', '200', '--step', '0.005', '--output', 'c.csv', '--resume']
    assert 'step 0.002, now 0.005' in refused(sweep, shlex.join(changed), capsys)
    # A smaller count is refused as well: the count belongs to the study.
    smaller = [*words, '--resume', '--count', '400']
    assert 'count 20000, now 400' in refused(sweep, shlex.join(smaller), capsys)


def test_resume_of_a_finished_sweep_prints_the_same_summary(capsys):
    words = ['--scatter', 'pitch=2', '--count', '300', '--step', '0.02']
    assert sweep.main(words) == 0
    first = capsys.readouterr().out.splitlines()
    assert sweep.main([*words, '--resume']) == 0
    again = capsys.readouterr().out.splitlines()
    assert again[:-1] == first[:-1]


def test_fly_repeats_the_flight_that_optimise_prints(capsys):
    line = '--limit pitch=0:40 --speed 15 --spin 31 --roll 0 --wind 2 0 0 --step 0.02 --plot o.png'
    assert optimise.main(shlex.split(line)) == 0
    out = capsys.readouterr().out
    printed = float(re.search(r'flight +(\d+\.\d+) m', out)[1])
    command = shlex.split(re.search(r'again +(fly .*)', out)[1])
    assert Path('o.png').read_bytes().startswith(b'\x89PNG')
    assert fly.main([*command[1:], '--json']) == 0
    flown = json.loads(capsys.readouterr().out)
    assert flown['range_m'] == pytest.approx(printed, abs=5e-3)  # printed with two digits
    assert flown['launch']['wind_m_s'] == [2.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ('line', 'words'),
    [
        ('--for accuracy', '--target'),
        ('--target 20 0', 'only accuracy'),
        ('--speed 15 --limit speed=5:10', '--speed fixes it'),
        ('--limit pitch=10:5', 'the lower first'),
        ('--limit pitch=5', 'NAME=LOW:HIGH'),
        ('--limit mass=0.1:0.2', '--limit'),
        ('--percentile 10', 'no quantity scatters'),
        ('--for beauty', 'invalid choice'),
        ('--speed 15 --spin 31 --pitch 5 --roll 0', 'at least one'),
    ],
)
def test_bad_input_of_optimise_is_refused_in_one_line(line, words, capsys):
    error = refused(optimise, line, capsys)
    assert error.startswith('optimise: error: ')
    assert words in error


def test_the_progress_line_has_share_rate_and_time_left():
    text = progress_text(250, 1000, 100, 2.0)
    assert text == '[######..................]  25% 250 of 1000 flights, 50/s, 15 s left'
    assert [duration(x) for x in (8.4, 200.0, 7500.0)] == ['8 s', '3 min 20 s', '2 h 5 min']
