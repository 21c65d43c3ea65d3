"""predict: CSV files and bags through the predictor."""

import json
import math
import os
from pathlib import Path
import re
import subprocess
import sys

import pytest

from disc_sim_ros.cli import fly, predict
from disc_sim_ros.estimation.prediction.prior import ThrowPrior
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from estimation.synthetic_throws import throw

SAMPLE = Path(__file__).parents[2] / 'samples/fig5'
FIG5_LANDING = (25.75, -1.67)  # m, of analyse_bag


@pytest.fixture(scope='module')
def csv(tmp_path_factory):
    flown = throw(Setup(disc=load_disc('ultrastar')), ThrowPrior(), 10, rate=30.0)  # of 2.4 s
    file = tmp_path_factory.mktemp('predict') / 'throw.csv'
    rows = (f'{t},{x},{y},{z}\n' for t, (x, y, z) in zip(flown.time, flown.position, strict=True))
    file.write_text('t_s,x_m,y_m,z_m\n' + ''.join(rows))
    return file, flown


def test_csv_gives_the_landing_and_a_plot(csv, tmp_path, capsys):
    file, flown = csv
    plot = tmp_path / 'miss.png'
    assert predict.main([str(file), '--disc-uncertainty', '0', '--json', '--plot', str(plot)]) == 0
    (document,) = json.loads(capsys.readouterr().out)['throws']
    assert document['landing_m'] == pytest.approx(flown.landing[:2], abs=0.06)  # noise of 2 cm
    assert document['to_the_landing']
    misses = [row['miss_m'] for row in document['predictions']]
    assert misses[-1] < misses[0]
    assert plot.read_bytes().startswith(b'\x89PNG')


def test_each_throw_of_a_csv_has_its_own_clock(csv, tmp_path, capsys):
    file, _ = csv
    head, *rows = file.read_text().splitlines()[:40]  # of 1.3 s
    both = tmp_path / 'both.csv'
    both.write_text('\n'.join([f'throw,{head}', *(f'{n},{row}' for n in 'ab' for row in rows)]))
    assert predict.main([str(both), '--disc-uncertainty', '0', '--json']) == 0
    first, second = json.loads(capsys.readouterr().out)['throws']
    assert (first.pop('throw'), second.pop('throw')) == (1, 2)
    assert (first.pop('name'), second.pop('name')) == ('a', 'b')
    assert first == second


def test_a_throw_of_a_csv_that_is_not_recognised_is_named(csv, tmp_path, capsys):
    """Later throws were numbered as if it were not in the file."""
    file, _ = csv
    head, *rows = file.read_text().splitlines()[:40]
    still = [f'{i / 30},0,0,1' for i in range(30)]
    both = tmp_path / 'both.csv'
    lines = [f'{n},{row}' for n, of in (('1', still), ('2', rows)) for row in of]
    both.write_text('\n'.join([f'throw,{head}', *lines]))
    assert predict.main([str(both), '--disc-uncertainty', '0']) == 0
    out, err = capsys.readouterr()
    assert 'throw 2: measured from' in out
    assert 'throw 1' not in out
    assert 'throw 1: not recognised as a throw, 30 measurements' in err


def test_a_long_recording_shows_how_far_it_is(csv, capsys, monkeypatch):
    """A file of 200,000 rows takes hours, which passed without a word."""
    file, _ = csv
    monkeypatch.setattr(predict, '_EVERY', 0.0)
    assert predict.main([str(file), '--disc-uncertainty', '0']) == 0
    lines = [x for x in capsys.readouterr().err.splitlines() if ' measurements; about ' in x]
    total = len(file.read_text().splitlines()) - 1
    assert lines[0].startswith(f'predict: 1 of {total} measurements; about ')
    assert lines[-1] == f'predict: {total} of {total} measurements; about 0 s left'


def test_the_samples_of_fly_are_measurements(tmp_path, capsys):
    file = tmp_path / 'flown.csv'
    assert fly.main(['--csv', str(file), '--samples', '30']) == 0
    landing = re.search(r'landed .* at x ([\d.]+) m, y (-?[\d.]+) m', capsys.readouterr().out)
    assert predict.main([str(file), '--disc', 'frisbee', '--throw-spin', '31', '--json']) == 0
    out, err = capsys.readouterr()
    (document,) = json.loads(out)['throws']
    assert document['landing_m'] == pytest.approx([float(x) for x in landing.groups()], abs=0.1)
    assert 'columns that are not read: velocity_x_m_s' in err


def test_bag_of_the_simulator_gives_its_landing(capsys):
    assert predict.main([str(SAMPLE), '--disc', 'frisbee', '--throw-spin', '31']) == 0
    assumed, _, first, *rest = capsys.readouterr().out.splitlines()
    assert assumed.startswith('assumed: frisbee (--disc), spin of 31 +- 15 rad/s (--throw-spin)')
    landing = [float(word) for word in re.findall(r'[xy] (-?[\d.]+) m', first)]
    # The last prediction weighs measurements as if they had 2 cm of noise.
    assert landing == pytest.approx(FIG5_LANDING, abs=0.02)
    assert any(line.strip().startswith('1.0') for line in rest)


@pytest.mark.parametrize(('spin', 'duration'), [(31.4, 2.2), (-31.4, 3.2)])  # s
def test_another_disc_with_a_slow_spin_either_way_is_followed(spin, duration, tmp_path, capsys):
    """The search stayed at a corner of the table: 1.1 m off from 0.5 to 2.2 s. A disc that spun
    the other way was lost twice in flight, as by a hand, and taken for three throws.
    """
    bag = str(tmp_path / 'bag')
    thrown = ['--spin', str(spin), '--disc', 'frisbee', '--duration', str(duration)]
    assert fly.main(['--bag', bag, *thrown]) == 0
    capsys.readouterr()
    assert predict.main([bag, '--disc', 'ultrastar', '--json']) == 0
    first, *more = json.loads(capsys.readouterr().out)['throws']
    assert all(other['begins_s'] > 3.0 for other in more)  # near the ground the discs differ much
    (row,) = [row for row in first['predictions'] if row['watched_s'] == 2.0]
    landing = (FIG5_LANDING[0], math.copysign(FIG5_LANDING[1], -spin))
    assert math.dist((row['x_m'], row['y_m']), landing) < 0.3  # m


@pytest.mark.parametrize('source', ['csv', 'bag'])
def test_same_recording_gives_the_same_bytes(csv, tmp_path, capsys, source):
    """In two processes, this one and another, whose sets of text have other orders.

    JSON has every number with all its digits, so that equal text is equal bits. What is drawn of
    it does not depend on the kind of the recording.
    """
    file = tmp_path / source
    if source == 'bag':
        short = ['--speed', '14', '--pitch', '-2', '--height', '1', '--duration', '0.55']
        assert fly.main(['--bag', str(file), *short]) == 0
        capsys.readouterr()
    else:
        file = tmp_path / 'throw.csv'
        file.write_text('\n'.join(csv[0].read_text().splitlines()[:20]) + '\n')  # of 0.6 s
    written = []
    for k in range(2):
        drawn = [tmp_path / f'throw{k}.{ending}' for ending in ('png', 'html')]
        words = [str(file), '--json', '--disc', 'frisbee', '--disc', 'ultrastar']
        if source == 'bag':
            words += ['--plot', str(drawn[0]), '--html', str(drawn[1])]
        if k == 0:
            assert predict.main(words) == 0
            said = capsys.readouterr().out
        else:
            said = subprocess.run(
                [sys.executable, '-m', 'disc_sim_ros.cli.predict', *words],
                env=os.environ
                | {'PYTHONHASHSEED': '2' if os.environ.get('PYTHONHASHSEED') == '1' else '1'},
                stdout=subprocess.PIPE,
                text=True,
                check=True,
            ).stdout
        assert json.loads(said)['throws'][0]['predictions']
        written.append([said, *(path.read_bytes() for path in drawn if path.exists())])
    assert written[0] == written[1]
    assert len(written[0]) == (3 if source == 'bag' else 1)


@pytest.mark.parametrize(
    ('content', 'error'),
    [
        ('t_s,x_m,y_m\n0,0,0\n', 'z_m'),
        ('t_s,x_m,y_m,z_m\n0,0,0,high\n', "line 2: z_m: 'high'"),
        ('t_s,x_m,y_m,z_m\n', 'no row'),
        ('t_s,qx,qy,qz,qw\n0,0,0,0,1\n', 'give t_s, x_m, y_m, z_m'),
    ],
)
def test_bad_files_are_refused(tmp_path, capsys, content, error):
    file = tmp_path / 'bad.csv'
    file.write_text(content)
    with pytest.raises(SystemExit) as ended:
        predict.main([str(file)])
    assert ended.value.code == 2
    message = capsys.readouterr().err
    assert error in message
    assert message.count('\n') == 1


def test_measurements_without_a_throw_are_a_failure(tmp_path, capsys):
    file = tmp_path / 'still.csv'
    file.write_text('t_s,x_m,y_m,z_m\n' + ''.join(f'{i / 60},0,0,1\n' for i in range(60)))
    assert predict.main([str(file)]) == 1
    assert 'no throw in 60 measurements; are positions in m' in capsys.readouterr().err
