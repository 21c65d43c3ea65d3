"""A page of flights: its data, its one file, and its commands. `test_browser` opens it."""

import json
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from disc_sim_ros import Launch, Setup, Wind, fly, load_disc
from disc_sim_ros.cli import fly as fly_command
from disc_sim_ros.cli import pages
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import frames
from disc_sim_ros.units import SYSTEMS
from disc_sim_ros.view import page as page_module
from disc_sim_ros.view import shown
from disc_sim_ros.view.page import ViewerMissingError, assembled, page

pytest.importorskip('trimesh')

METRIC, US = SYSTEMS['metric'], SYSTEMS['us']


@pytest.fixture(scope='module')
def flight():
    setup = Setup(disc=load_disc('frisbee'), wind=Wind(mean=(1.0, -2.0, 0.0)))
    return fly(Launch(roll=-8.0, yaw=30.0, height=1.0), setup, sample_rate=100.0)


def data_of(content: bytes) -> dict:
    text = re.search(rb'<script type="application/json" id="flights">(.*?)</script>', content)[1]
    return json.loads(text)


def test_the_poses_of_a_page_are_those_of_the_flight(flight):
    values = shown.document(shown.of_flight(flight, 'x', METRIC), METRIC)
    position = np.reshape(values['position'], (-1, 3))
    assert values['t'][-1] == pytest.approx(flight.time, abs=1e-4)  # rounded to 0.1 ms
    assert position[-1] == pytest.approx(flight.position, abs=1e-4)
    # The plastic's x axis by the paper's angles: yaw, pitch, roll, then the spin about z down.
    k = 150
    phi, theta, psi = flight.trajectory.euler[k]
    paper = Rotation.from_euler('ZYX', [psi, theta, phi]) * Rotation.from_euler(
        'z', flight.trajectory.spin_angle[k]
    )
    quaternion = np.reshape(values['attitude'], (-1, 4))[k]
    plastic = Rotation.from_quat(quaternion) * Rotation.from_euler('z', values['spin'][k])
    for axis in np.eye(3):
        expected = frames.map_from_paper(paper.apply(frames.paper_from_map(axis)))
        # Rounded to 1e-6 and 1e-4 rad.
        assert plastic.apply(axis) == pytest.approx(expected, abs=2e-4)


def test_the_spin_angle_is_not_reduced_to_one_turn(flight):
    values = shown.document(shown.of_flight(flight, 'x', METRIC), METRIC)
    turns = (values['spin'][-1] - values['spin'][0]) / (2.0 * np.pi)
    # Clockwise from above is negative about z up; the mean spin is that of the samples.
    expected = -flight.trajectory.spin.mean() * flight.time / (2.0 * np.pi)
    assert turns == pytest.approx(expected, rel=0.02)
    assert abs(turns) > 10.0


def test_the_curves_have_the_units_that_people_asked_for(flight):
    one = shown.of_flight(flight, 'x', METRIC)
    metric, us = shown.document(one, METRIC), shown.document(one, US)
    labels = dict(shown.curve_labels(US))
    assert labels['height'] == 'ft'
    assert labels['spin'] == 'rpm'
    factors = (1 / 0.3048, 3600 / 1609.344, 1.0, 60 / (2 * np.pi), 1.0, 1.0)
    for a, b, factor in zip(metric['curves'], us['curves'], factors, strict=True):
        # Both are rounded to 1e-4.
        assert np.array(b) == pytest.approx(np.array(a) * factor, abs=1e-4 * (1 + factor))
    assert 'ft' in shown.of_flight(flight, 'x', US).result


def test_a_value_that_does_not_exist_is_null():
    standing = fly(
        Launch(speed=0.0, spin=0.0, height=2.0), Setup(disc=load_disc('frisbee')), sample_rate=50.0
    )
    rows = standing.trajectory.rows.copy()
    rows[3, 13] = np.nan
    broken = shown.ShownFlight('x', '', shown.Trajectory(rows, 0.27))
    spin = shown.document(broken, METRIC)['curves'][3]
    assert spin[3] is None
    assert None not in spin[:3]
    json.dumps(shown.document(broken, METRIC), allow_nan=False)


def test_a_long_flight_is_thinned_and_keeps_its_ends(flight):
    thin = shown.thinned(flight.trajectory, 50)
    assert len(thin) == 50
    assert thin.t[[0, -1]] == pytest.approx(flight.trajectory.t[[0, -1]], abs=0.0)
    assert shown.thinned(flight.trajectory) is flight.trajectory


def test_a_flight_without_samples_is_refused():
    flight = fly(Launch(), Setup(disc=load_disc('frisbee')))
    with pytest.raises(ValueError, match='no samples'):
        shown.of_flight(flight, 'x', METRIC)


def test_a_page_is_one_file_of_a_megabyte_that_asks_no_host(flight):
    content = page([shown.of_flight(flight, 'x', METRIC)], 'A <b> & title', METRIC)
    assert len(content) < 1_200_000
    text = content.decode()
    assert '<title>A &lt;b&gt; &amp; title</title>' in text
    assert "default-src 'none'" in text
    assert not re.findall(r'<(?:script|link|img)[^>]*(?:src|href)=', text)
    assert data_of(content)['title'] == 'A <b> & title'


def test_many_flights_stay_below_6_mb(flight):
    flights = [shown.of_flight(flight, f'throw {i}', METRIC) for i in range(150)]
    content = page(flights, 'A field test', METRIC)
    assert len(content) < 6_000_000
    tracks = data_of(content)['tracks']
    assert len(tracks) == 150
    assert {t['t'][-1] for t in tracks} == {round(flight.time, 4)}


def test_a_name_cannot_end_the_script(flight):
    name = '</script><script>alert(1)</script>'
    content = page([shown.of_flight(flight, name, METRIC)], name, METRIC)
    assert data_of(content)['tracks'][0]['name'] == name
    assert b'<script>alert' not in content


@pytest.mark.parametrize('broken', ['', '<title>x</title><p>', '<title>x</title></head>'])
def test_another_page_of_trimesh_is_refused(broken):
    with pytest.raises(ViewerMissingError, match='another form'):
        assembled(broken, 'x', {})


def test_another_version_of_trimesh_is_refused(flight, monkeypatch):
    monkeypatch.setattr('trimesh.__version__', '6.0.0')
    with pytest.raises(ViewerMissingError, match=r'needs trimesh 5 .*, not 6\.0\.0'):
        page([shown.of_flight(flight, 'x', METRIC)], 'x', METRIC)


# ---- the command ----


def run(capsys, *arguments: object) -> tuple[int, str, str]:
    try:
        code = fly_command.main([str(a) for a in arguments])
    except SystemExit as end:
        code = end.code
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_fly_writes_a_page_after_its_summary(tmp_path, capsys):
    path = tmp_path / 'throw.html'
    code, out, err = run(capsys, '--html', path)
    assert (code, err) == (0, '')
    assert out.splitlines()[-1].startswith(f'  wrote {path}, ')
    values = data_of(path.read_bytes())
    assert [t['name'] for t in values['tracks']] == ['frisbee']
    assert len(values['tracks'][0]['t']) > 3.6 * pages.RATE


def test_several_discs_are_in_one_page_in_feet(tmp_path, capsys):
    path = tmp_path / 'throws.html'
    both = ('--disc', 'wraith', '--disc', 'teebird', '--height', '1', '--units', 'us')
    code, out, _ = run(capsys, *both, '--html', path)
    assert code == 0
    assert f'wrote {path}' in out
    values = data_of(path.read_bytes())
    assert [t['name'] for t in values['tracks']] == ['wraith', 'teebird']
    assert values['units']['length'] == 'ft'


@pytest.mark.parametrize('discs', [(), ('--disc', 'wraith', '--disc', 'teebird')])
def test_the_samples_of_a_page_are_not_printed(tmp_path, capsys, discs):
    _, alone, _ = run(capsys, '--json', *discs)
    code, out, err = run(capsys, '--json', '--html', tmp_path / 'x.html', *discs)
    assert code == 0
    assert out == alone
    assert err.startswith('fly: wrote ')


@pytest.mark.parametrize(
    ('name', 'reason'), [('none/x.html', 'does not exist'), ('', 'this is a folder')]
)
def test_a_page_that_cannot_be_written_is_refused_before_the_flight(
    tmp_path, capsys, name, reason
):
    code, out, err = run(capsys, '--html', tmp_path / name)
    assert (code, out) == (2, '')
    assert re.fullmatch(rf'fly: error: --html: [^\n]*{reason}[^\n]*\n', err)


def test_the_numbers_come_even_if_the_disk_is_full(capsys):
    code, out, err = run(capsys, '--html', '/dev/full')
    assert code == 2
    assert 'landed' in out
    assert err.endswith('cannot write it (No space left on device)\n')


def test_a_missing_trimesh_is_one_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(__import__('sys').modules, 'trimesh', None)
    code, out, err = run(capsys, '--html', tmp_path / 'x.html')
    assert code == 1
    assert 'landed' in out
    assert err.count('\n') == 1
    assert 'pip install "trimesh>=5,<6"' in err


def test_view_writes_a_page_and_names_a_missing_screen(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ('DISPLAY', 'WAYLAND_DISPLAY'):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr('sys.platform', 'linux')
    code, out, err = run(capsys, '--view')
    (written,) = (tmp_path / 'flights').iterdir()
    assert code == 0
    assert f'flights/{written.name}' in out
    assert err == f'fly: note: {pages.NO_BROWSER}\n'


@pytest.mark.parametrize(('ci', 'expected'), [('', ['file']), ('true', [])])
def test_a_page_opens_where_there_is_a_screen_and_never_in_ci(
    tmp_path, capsys, monkeypatch, ci, expected
):
    addresses = []
    monkeypatch.setattr('webbrowser.open', lambda url: addresses.append(url) or True)
    monkeypatch.setenv('DISPLAY', ':0')
    monkeypatch.setenv('CI', ci)
    run(capsys, '--view', '--html', tmp_path / 'x.html')
    assert [url.partition(':')[0] for url in addresses] == expected


def test_a_page_without_flights_is_refused():
    with pytest.raises(ValueError, match='at least one flight'):
        page_module.page([], 'x', METRIC)


def test_a_folder_for_pages_that_cannot_be_made_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'flights').write_text('a file')
    with pytest.raises(ConfigError, match='cannot make the folder flights'):
        pages._new_name()
