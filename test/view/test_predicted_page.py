"""The page of `predict --html`, also in a browser: what was predicted while the disc flew."""

import json

import numpy as np
import pytest

import browser
from disc_sim_ros.cli import predict
from disc_sim_ros.cli.predict_page import shown_throw
from disc_sim_ros.estimation.prediction import replay
from disc_sim_ros.estimation.prediction.predictor import PredictorConfig
from disc_sim_ros.estimation.prediction.prior import ThrowPrior
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.frames import map_from_paper
from disc_sim_ros.units import SYSTEMS
from disc_sim_ros.view import predicted, shown
from disc_sim_ros.view.page import page
from estimation.synthetic_throws import throw
from view.test_browser import SIZES, TWO_FRAMES, picture, shown_at
from view.test_page import data_of

pytest.importorskip('trimesh')
pytestmark = pytest.mark.xdist_group('browser')  # followed once
METRIC, US = SYSTEMS['metric'], SYSTEMS['us']
CONFIG = PredictorConfig(setup=Setup(disc=load_disc('ultrastar')))
in_browser = pytest.mark.skipif(browser.program() is None, reason=browser.MISSING)


@pytest.fixture(scope='module')
def flown():
    return throw(Setup(disc=load_disc('ultrastar')), ThrowPrior(), 6, rate=30.0)


@pytest.fixture(scope='module')
def followed(flown):
    (one,) = replay.replay({'': replay.measurements(flown.time, flown.position)}, CONFIG)
    return one


@pytest.fixture(scope='module')
def file(followed, tmp_path_factory):
    path = tmp_path_factory.mktemp('predicted') / 'throw.html'
    path.write_bytes(page([shown_throw(followed, CONFIG, METRIC)], 'Predicted', METRIC))
    return path


@pytest.fixture
def csv(flown, tmp_path):
    """The first 0.7 s of the measurements: predicted in a moment."""
    path = tmp_path / 'throw.csv'
    rows = zip(flown.time[:22], flown.position, strict=False)
    lines = (f'{t},{x},{y},{z}\n' for t, (x, y, z) in rows)
    path.write_text('t_s,x_m,y_m,z_m\n' + ''.join(lines))
    return path


@pytest.fixture(scope='module', params=SIZES)
def opened(request, file, chromium):
    with shown_at(chromium, request.param, file) as tab:
        yield tab


def at(tab, time: float) -> dict:
    """Return what the page draws of the predictions at a time."""
    tab.value(f'discView.play(false), discView.seek({time})')
    tab.value(TWO_FRAMES)
    return tab.value('discView.foretold(0)')


# ---- without a browser ----


def test_the_fitted_flight_passes_the_measurements_and_lands_where_predicted(followed, flown):
    flight = replay.fitted_flight(followed, CONFIG, 200.0)
    place = map_from_paper(flight.position)
    begin = followed.predictions[-1].reference_time
    for axis in range(3):
        fitted = np.interp(
            [m.time - begin for m in followed.measurements], flight.t, place[:, axis]
        )
        measured = np.array([m.position[axis] for m in followed.measurements])
        # Noise of 2 cm in each coordinate; the fit of a flight cannot follow it.
        assert np.sqrt(np.mean((fitted - measured) ** 2)) < 0.03
    assert place[-1, :2] == pytest.approx(followed.landing[:2], abs=1e-3)
    assert 0.0 <= place[-1, 2] < 0.1  # the rim of the tilted disc touches the ground


def test_a_prediction_has_the_covariance_of_the_last_ellipse(followed):
    """As predictor_node publishes it; that of the linear fit is too small."""
    at_30_hz = [p.covariance[0, 0] for p in followed.predictions]
    # An ellipse comes every 0.05 s, at 30 Hz after two measurements.
    assert at_30_hz[0::2][:20] == at_30_hz[1::2][:20]
    assert len(set(at_30_hz)) > 20


def test_the_page_has_the_miss_and_the_ellipse_of_each_time(followed):
    flight = shown_throw(followed, CONFIG, METRIC)
    values = shown.document(flight, METRIC)
    miss, length = (np.array(c, float) for c in values['curves'][6:])
    for k in (10, 40):
        p = followed.predictions[k]
        i = np.searchsorted(values['t'], followed.watched[k] + 0.005)
        assert miss[i] == pytest.approx(followed.misses[k], abs=1e-4)
        # 1 of 10 landings is outside: exp(-d^2 / 2) = 0.1 at a distance of d standard deviations.
        longest = np.sqrt(np.linalg.eigvalsh(p.covariance[:2, :2])[-1] * 2.0 * np.log(10.0))
        assert length[i] == pytest.approx(longest, rel=1e-3)
    assert np.isnan(miss[0])  # the first measurements make no prediction
    us = shown.document(shown_throw(followed, CONFIG, US), US)['curves'][6]
    assert us[600] == pytest.approx(miss[600] / 0.3048, abs=1e-3)


def test_many_measurements_are_thinned(followed):
    whole = shown_throw(followed, CONFIG, METRIC).predictions
    values = predicted.document(whole, 300)
    assert len(values['measuredTime']) == 75
    assert len(values['t']) == len(values['paths']) == 20
    assert values['t'][-1] == pytest.approx(followed.watched[-1], abs=1e-4)


def test_predict_writes_a_page_after_its_document(csv, tmp_path, capsys):
    path = tmp_path / 'x.html'
    assert predict.main([str(csv), '--json', '--html', str(path)]) == 0
    captured = capsys.readouterr()
    assert not json.loads(captured.out)['throws'][0]['to_the_landing']
    assert captured.err.startswith(f'predict: wrote {path}, ')
    values = data_of(path.read_bytes())
    assert values['title'] == 'Landings predicted from throw.csv'
    assert [label[0] for label in values['labels']][6:] == ['miss of the landing']
    (track,) = values['tracks']
    assert track['result'].startswith('measured in part, would land after ')
    assert len(track['predictions']['measuredTime']) == 22


def test_the_numbers_come_even_if_the_disk_is_full(csv, capsys):
    with pytest.raises(SystemExit) as ended:
        predict.main([str(csv), '--html', '/dev/full'])
    assert ended.value.code == 2
    captured = capsys.readouterr()
    assert '\nthrow 1: measured from' in captured.out
    assert captured.err.endswith('cannot write it (No space left on device)\n')
    assert captured.err.count('\n') == 1


# ---- in a browser ----


@in_browser
def test_landing_and_ellipse_are_those_known_at_the_time(opened, followed):
    assert not at(opened, 0.05)['visible']  # six measurements are needed
    for time in (1.0, 2.5):
        drawn = at(opened, time)
        p = followed.at(time)
        assert drawn['visible']
        assert drawn['landing'] == pytest.approx(p.landing, abs=1e-3)
        variances = np.linalg.eigvalsh(p.covariance[:2, :2])[::-1]
        expected = np.sqrt(variances * 2.0 * np.log(10.0))
        assert drawn['axes'] == pytest.approx(expected, rel=1e-3)
        begin = p.reference_time
        assert drawn['dots'] == sum(m.time - begin <= time for m in followed.measurements)


@in_browser
def test_the_picture_shows_the_ellipse_shrink(opened):
    """Pixels of the orange of the prediction, which nothing else in the picture has."""

    def orange(time: float) -> int:
        red, green, blue = np.moveaxis(picture(opened, time, 'top'), 2, 0)
        return int(np.sum((red > green + 20) & (green > blue + 10)))

    early, late = orange(1.0), orange(4.0)
    assert early > 5 * late
    assert late > 10


@in_browser
def test_the_curve_of_the_miss_follows_the_clock(opened, followed):
    at(opened, 2.0)
    text = opened.value('document.querySelector("figure.first output").textContent')
    p = followed.at(2.0)
    miss = np.hypot(*(p.landing - followed.landing[:2]))
    assert float(text) == pytest.approx(miss, abs=0.006)
    x = 'document.querySelector("figure.first .now").getAttribute("x1")'
    before = float(opened.value(x))
    at(opened, 4.0)
    assert float(opened.value(x)) > before + 20.0
    wide, window = opened.value('[document.documentElement.scrollWidth, innerWidth]')
    assert wide <= window


@in_browser
def test_zz_the_console_is_empty_and_no_host_was_asked(opened):
    """Last in this file: the other tests have used the page."""
    assert opened.problems == []
    assert [r for r in opened.requests if not r.startswith(('file:', 'data:'))] == []
