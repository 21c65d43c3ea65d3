"""`identify`: from a file to a disc file, and what it refuses."""

import csv
import json
from pathlib import Path
import re
import shutil

import numpy as np
import pytest

from disc_sim_ros.cli import fly, identify
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.flight import fly as fly_disc
from disc_sim_ros.physics.frames import map_from_paper
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.quantities import COEFFICIENT_SPREAD, COEFFICIENTS
from measurements import beside


def write(path: Path, columns: list[str], rows: object) -> Path:
    with path.open('w', newline='') as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(rows)
    return path


@pytest.fixture(scope='module')
def throw(tmp_path_factory) -> Path:
    """Return a file with positions of the first 1.5 s of a flight of `ultrastar`, to 5 mm."""
    launch = Launch(speed=18.0, pitch=10.0, spin=60.0, height=1.3)
    flight = fly_disc(launch, Setup(disc=load_disc('ultrastar')), sample_rate=60.0, duration=1.5)
    trajectory = flight.trajectory
    noise = np.random.default_rng(1).normal(0.0, 0.005, trajectory.position.shape)
    rows = np.column_stack([trajectory.t, map_from_paper(trajectory.position) + noise])
    file = tmp_path_factory.mktemp('throws') / 'one.csv'
    return write(file, ['t_s', 'x_m', 'y_m', 'z_m'], rows.tolist())


def refused(capsys, *words: str) -> str:
    with pytest.raises(SystemExit) as end:
        identify.main(list(words))
    captured = capsys.readouterr()
    lines = captured.err.splitlines()
    assert end.value.code == 2
    assert len(lines) == 1, captured.err
    assert captured.out == ''
    return lines[0]


def test_a_file_becomes_a_disc_a_report_and_a_document(throw, tmp_path, capsys):
    out, folder = tmp_path / 'mine.yaml', tmp_path / 'report'
    words = [str(throw), '--disc', 'ultrastar', '--free', 'C_D0,C_L0', '--spin', '60']
    words += ['--starts', '1', '--json', '--out', str(out), '--report', str(folder)]
    assert identify.main(words) == 0
    document = json.loads(capsys.readouterr().out)
    for name in ('C_D0', 'C_L0'):
        of = document['coefficients'][name]
        assert (
            abs(of['value'] - of['before']) < 4.0 * of['error']
        )  # the disc that flew is the base
    assert document['coefficients']['damping']['error'] is None
    assert document['noise']['position']['taken'] == pytest.approx(0.005, rel=0.2)
    assert load_disc(str(out)).mass == load_disc('ultrastar').mass
    assert '--free C_D0,C_L0 --spin 60 --starts 1' in out.read_text()
    page = (folder / 'report.html').read_text()
    assert page.count('<img') == 3
    assert 'src="http' not in page
    assert '<a href="throws.html">' in page
    data = re.search(
        '<script type="application/json" id="flights">(.*?)</script>',
        (folder / 'throws.html').read_text(),
    )
    (track,) = json.loads(data[1])['tracks']
    measured = np.genfromtxt(throw, delimiter=',', names=True)
    assert track['t'][-1] == pytest.approx(
        np.ptp(measured['t_s']), abs=0.01
    )  # 200 samples a second
    # The noise of the measurements is 5 mm.
    assert track['position'][:3] == pytest.approx(
        [measured[name][0] for name in ('x_m', 'y_m', 'z_m')], abs=0.03
    )
    assert json.loads((folder / 'report.json').read_text())['verdict'] == document['verdict']


@pytest.mark.parametrize(
    ('columns', 'rows', 'said'),
    [
        (['t_s', 'x_m', 'y_m', 'z_m'], [[0.1 * i, i, 0, 1] for i in range(4)], '4 samples'),
        (['t_s', 'x_m', 'y_m', 'z_m'], [[1 - 0.1 * i, i, 0, i] for i in range(9)], 'increase'),
        (['t_s', 'x_m', 'y_m', 'z_m'], [[i, 1e4 * i, 0, 1] for i in range(9)], 'm and the times'),
        (['t_s', 'x_m', 'y_m', 'z_m'], [[i, 0.5 * i, 0, 1] for i in range(9)], 'faster than 3'),
        (
            ['t_s', 'x_m', 'y_m', 'z_m'],
            [[0.2 * i, i, 0, 0.1] for i in range(20)],
            'stays at one height',  # a rover
        ),
        (
            ['t_s', 'x_m', 'y_m', 'z_m'],
            [[0.1 * i, i, 0, 2.5 * (0.1 * i - 1.0) ** 2 - 4.0] for i in range(20)],
            'is it down',  # z of the paper
        ),
        (['t_s', 'x_m', 'y_m'], [[0.1 * i, i, 0] for i in range(20)], '--camera-height'),
        (['x_m', 'y_m', 'z_m'], [[i, 0, 1] for i in range(9)], 't_s'),
        (['t_s', 'a', 'b'], [[i, 0, 1] for i in range(9)], 'it needs columns of'),
        (
            ['t_s', 'p_rad_s', 'q_rad_s', 'r_rad_s'],
            [[0.01 * i, 1, 1, 3000] for i in range(20)],
            'degrees',
        ),
        (
            ['t_s', 'p_rad_s', 'q_rad_s', 'r_rad_s'],
            [[0.01 * i, 0, 0, 0.5] for i in range(20)],
            'no disc',
        ),
        (['t_s', 'x_m', 'y_m', 'z_m'], [[0, 'nan', 0, 1]] * 9, 'finite number'),
        (['t_s', 'x_m', 'y_m', 'z_m'], [], 'no row'),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path, capsys, columns, rows, said):
    file = write(tmp_path / 'bad.csv', columns, rows)
    assert said in refused(capsys, str(file))


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (['nothing.csv'], 'cannot read it'),
        (['THROW', '--free', 'C_X'], "'C_X' is not allowed; choose from"),
        (['THROW', '--use', 'radar'], "--use: 'radar'"),
        (['THROW', '--use', 'gyro'], 'it has position'),
        (['THROW', '--out', 'disc.txt'], 'ends in .yaml'),
        (['THROW', '--wind-error', '0'], '--wind-error'),
        (['THROW', '--noise', 'radar=1'], "--noise: 'radar'"),
        (['THROW', '--noise', 'position=0'], '--noise position: 0'),
        (['THROW', '--noise', 'position'], "--noise position: ''"),
        (['THROW', '--noise', 'position=1,position=2'], "--noise: 'position' .* once"),
        (['THROW', '--noise', 'gyro=1'], '--noise gyro: 1 .* these throws use position, not gyro'),
        (['THROW', '--camera-height', '30'], '--camera-height: 30 .* not camera'),
        (['THROW', '--accelerometer-range', '160'], '--accelerometer-range: 160 .* not accel'),
        (['THROW', '--techdisc', 'nothing.csv'], '--techdisc'),
        (['THROW', '--release-spin-error', '0'], '--release-spin-error'),
        (['THROW', '--disc', 'nodisc'], 'nodisc'),
    ],
)
def test_a_bad_flag_is_refused_in_one_line(throw, capsys, words, said):
    line = refused(capsys, *(str(throw) if word == 'THROW' else word for word in words))
    assert re.search(said, line), line


RELEASES = """speedMps,spinRpm,launchAngle,noseAngle,hyzerAngle,throwType
24.7,1317.8,15.5,0.0,21.8,rhbh
24.5,1410.4,5.2,0.0,-0.7,rhbh
"""


def test_a_throw_that_is_given_twice_is_refused(throw, tmp_path, capsys):
    """Errors would be too small, and "a throw that was not used" would be one that was."""
    assert 'it is given twice' in refused(capsys, str(throw), str(throw))
    copy = tmp_path / 'copy.csv'
    shutil.copy(throw, copy)
    said = refused(capsys, str(throw), str(copy))
    assert 'one.csv one and copy.csv copy' in said
    assert 'their position is the same; give each throw once' in said


def test_files_of_one_name_in_two_folders_are_two_throws(throw, tmp_path, capsys):
    one, other = tmp_path / 'a' / throw.name, tmp_path / 'b' / throw.name
    head, *rows = throw.read_text().splitlines()
    for file, count in ((one, 60), (other, 57)):  # the first second, and a little less
        file.parent.mkdir()
        file.write_text('\n'.join([head, *rows[:count]]) + '\n')
    words = [str(one), str(other), '--disc', 'ultrastar', '--free', 'C_D0', '--spin', '60']
    assert identify.main([*words, '--starts', '1', '--json']) == 0
    names = json.loads(capsys.readouterr().out)['throws']
    assert names == [f'{one} one', f'{other} one']


def test_each_throw_needs_a_row_of_the_releases(throw, tmp_path, capsys):
    file = tmp_path / 'releases.csv'
    file.write_text(RELEASES)
    line = refused(capsys, str(throw), '--techdisc', str(file))
    assert 'it has 2 releases, THROWS have 1 throws' in line


def test_two_filmed_throws_and_their_releases_make_a_better_disc(tmp_path, capsys):
    """The drone stood 100 m above the field; that it stood near its middle is an assumption. A
    noise of 1 m stands for what the model does not follow. The catalogue's disc misses the two
    landings by 13 m in the mean from the releases as measured (docs/discs.md).
    """
    measured = beside('data/throws/wraith_drone.csv')
    if not measured.is_file():
        pytest.skip(f'{measured} is not beside the repository')
    releases = tmp_path / 'releases.csv'
    releases.write_text(RELEASES)
    words = [str(measured), '--disc', 'wraith', '--techdisc', str(releases), '--starts', '1']
    words += ['--camera-height', '100', '--camera-at', '50', '0', '--camera-error', '25']
    words += ['--wind', '4.8', '0', '--wind-error', '1', '--noise', 'camera=1', '--anyway']
    words += ['--free', 'C_L0,C_D0']  # all nine take four times as long
    assert identify.main([*words, '--json']) == 0
    document = json.loads(capsys.readouterr().out)
    assert document['noise']['camera']['rms'] < 0.5  # m
    for name, of in document['coefficients'].items():
        assert abs(of['value'] - of['before']) < 2.0 * COEFFICIENT_SPREAD[name], name
    misses = document['miss_without_m'].values()
    assert np.mean([miss['from_release'] for miss in misses]) < 13.0
    assert np.mean([miss['from_path'] for miss in misses]) < 13.0


@pytest.mark.parametrize('name', ['nowhere', 'page.md'])
def test_what_is_no_bag_is_named(tmp_path, capsys, name):
    (tmp_path / 'page.md').write_text('# A page')
    assert identify.main([str(tmp_path / name)]) == 1
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith(f'identify: error: {tmp_path / name}: ')
    assert captured.err.count('\n') == 1


def test_throws_that_determine_nothing_still_give_a_release(throw, tmp_path, capsys):
    """Eight positions in 0.35 s tell no coefficient better than the catalogue does."""
    head, *rows = throw.read_text().splitlines()
    few = tmp_path / 'few.csv'
    few.write_text('\n'.join([head, *rows[:22:3]]))
    out = tmp_path / 'mine.yaml'
    words = [str(few), '--disc', 'ultrastar', '--spin', '60', '--starts', '1', '--out', str(out)]
    assert identify.main(words) == 1
    captured = capsys.readouterr()
    assert 'residuals of position' in captured.out
    assert captured.out.count('left at the base') == len(COEFFICIENTS)
    assert captured.err.endswith(
        f'{out}: not written, because these throws determine no coefficient\n'
    )
    assert not out.exists()


def test_a_folder_that_exists_is_not_written_over(throw, tmp_path, capsys):
    assert 'exists already' in refused(capsys, str(throw), '--report', str(tmp_path))


def test_a_bag_of_the_simulator_gives_its_disc_back(tmp_path, capsys):
    """`fly --bag` writes what the recorder would; its Imu has no noise."""
    pytest.importorskip('rclpy')
    bag = tmp_path / 'bag'
    throw = ['--disc', 'ultrastar', '--speed', '17', '--height', '1.2', '--spin', '60']
    throw += ['--roll-rate', '1', '--duration', '1.2']
    assert fly.main([*throw, '--bag', str(bag)]) == 0
    capsys.readouterr()
    words = [str(bag), '--disc', 'ultrastar', '--free', 'C_D0,damping', '--starts', '1', '--json']
    assert identify.main(words) == 0
    document = json.loads(capsys.readouterr().out)
    assert set(document['noise']) >= {'position', 'attitude'}
    # Without noise what remains is the step of the fit, 2 ms against 1 ms.
    assert document['coefficients']['C_D0']['value'] == pytest.approx(
        document['coefficients']['C_D0']['before'], abs=2e-4
    )
    assert document['coefficients']['damping']['value'] == pytest.approx(1.0, abs=0.02)
