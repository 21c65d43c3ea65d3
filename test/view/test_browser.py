"""A page in a real browser: the disc flies and spins, at the size of a desktop and of a phone."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
import tempfile
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image
import pytest
from scipy.spatial.transform import Rotation

import browser
from disc_sim_ros import Launch, Setup, Wind, fly, load_disc
from disc_sim_ros.physics import frames
from disc_sim_ros.units import SYSTEMS
from disc_sim_ros.view import shown
from disc_sim_ros.view.page import page

pytest.importorskip('trimesh')
pytestmark = [
    pytest.mark.skipif(browser.program() is None, reason=browser.MISSING),
    pytest.mark.xdist_group('browser'),
]
METRIC = SYSTEMS['metric']
RATE = 200.0
SIZES = {'desktop': (900, 500, False), 'phone': (390, 844, True)}
TWO_FRAMES = 'new Promise(r => requestAnimationFrame(() => requestAnimationFrame(() => r())))'


@pytest.fixture(scope='module')
def flights():
    windy = Setup(disc=load_disc('frisbee'), wind=Wind(mean=(0.0, 2.0, 0.0)))
    fast = Launch(speed=25.0, pitch=8.0, spin=120.0, roll_rate=4.0, height=1.0)
    return [
        fly(Launch(), windy, sample_rate=RATE),
        fly(fast, Setup(disc=load_disc('wraith')), sample_rate=RATE),
    ]


@pytest.fixture(scope='module')
def file(flights, tmp_path_factory):
    shown_flights = [shown.of_flight(f, f.setup.disc.name, METRIC) for f in flights]
    path = tmp_path_factory.mktemp('page') / 'two throws.html'
    path.write_bytes(page(shown_flights, 'Two throws', METRIC))
    return path


@contextmanager
def shown_at(
    tab: browser.Browser, size: str, file: Path, *, still: bool = True
) -> Iterator[browser.Browser]:
    """Open a page of flights in a window of one of the SIZES; a phone is dark.

    Each picture that the page draws takes half a second of a core. If `still`, the page does not
    play by itself.
    """
    width, height, phone = SIZES[size]
    tab.show_as(width, height, phone=phone, dark=phone, still=still)
    tab.open(file)
    tab.wait('discView.ready')
    yield tab
    tab.open('data:text/html,')  # the page would take half of a core until the last test


@pytest.fixture(scope='module', params=SIZES)
def opened(request, file, chromium):
    with shown_at(chromium, request.param, file, still=False) as tab:
        yield tab


def poses(tab, which: int, times: Sequence[float]) -> list[dict]:
    """Return where a page has a disc at some times, of which it draws the last."""
    each = f'(time => (discView.play(false), discView.seek(time), discView.pose({which})))'
    return tab.value(f'{[float(time) for time in times]}.map{each}')


def picture(tab, time: float, camera: str) -> np.ndarray:
    """Return the pixels of the 3D picture at a time, shape (height, width, 3)."""
    tab.value(f'discView.play(false), discView.setCamera("{camera}"), discView.seek({time})')
    tab.value(TWO_FRAMES)
    x, y, width, height = tab.value(
        '(b => [b.x, b.y, b.width, b.height])(document.querySelector("#view canvas")'
        '.getBoundingClientRect())'
    )
    png = tab.picture(x=x, y=y, width=width, height=height)
    return np.asarray(Image.open(BytesIO(png)).convert('RGB')).astype(int)


def test_the_page_plays_by_itself_and_stops_at_the_end(opened):
    """First in this file: the page has just been opened."""
    opened.wait('discView.time > 0.2')
    opened.value('discView.seek(discView.duration() - 0.1), discView.play(true)')
    opened.wait('!discView.playing')
    assert opened.value('discView.time') == opened.value('discView.duration()')


def test_the_picture_shows_the_disc_fly(opened, flights):
    first, second = (picture(opened, t, 'top') for t in (0.6, 2.0))
    changed = np.argwhere(np.abs(first - second).max(axis=2) > 40)
    assert len(changed) > 100
    # The page says where it draws a disc; there, only the second picture has the wraith.
    x, y = opened.value('discView.pixel(1)')
    left, top = opened.value(
        '(b => [b.x, b.y])(document.querySelector("#view canvas").getBoundingClientRect())'
    )
    ratio = first.shape[1] / opened.value('document.querySelector("#view canvas").clientWidth')
    row, column = round((y - top) * ratio), round((x - left) * ratio)
    patch = (slice(row - 3, row + 4), slice(column - 3, column + 4))
    assert np.abs(second[patch] - first[patch]).max() > 60


def test_the_picture_shows_the_disc_spin(opened):
    """Between two times that are half a turn apart the disc is in the same place, but turned."""
    half = np.pi / 31.4
    first, turned = (picture(opened, t, 'follow') for t in (1.0, 1.0 + half))
    middle = np.array(first.shape[:2]) // 2
    near = tuple(slice(m - 12, m + 13) for m in middle)
    assert np.abs(first[near] - turned[near]).max() > 60


@pytest.mark.parametrize('which', [0, 1])
def test_the_pose_between_two_samples_is_that_of_a_finer_flight(opened, flights, which):
    flown = flights[which]
    fine = fly(flown.launch, flown.setup, sample_rate=10.0 * RATE).trajectory
    places = [17, 4321, 5555]
    for k, pose in zip(places, poses(opened, which, fine.t[places]), strict=True):
        assert pose['position'] == pytest.approx(frames.map_from_paper(fine.position[k]), abs=1e-3)
        despun = Rotation.from_quat(frames.message_quaternion(fine.attitude[k]))
        expected = despun * Rotation.from_euler('z', -fine.spin_angle[k])
        error = (Rotation.from_quat(pose['attitude']) * expected.inv()).magnitude()
        # Chords of the wobble of the wraith, 39 Hz with 7 degrees, in steps of 5 ms.
        assert error < (0.002, 0.02)[which]


def test_the_curves_follow_the_time(opened, flights):
    opened.value('discView.choose(0), discView.seek(1.5)')
    opened.value(TWO_FRAMES)
    heights = frames.map_from_paper(flights[0].trajectory.position)[:, 2]
    shown = opened.value('document.querySelector("figcaption output").textContent')
    assert float(shown) == pytest.approx(
        np.interp(1.5, flights[0].trajectory.t, heights), abs=6e-3
    )
    x = 'document.querySelector("figure svg .now").getAttribute("x1")'
    before = float(opened.value(x))
    opened.value('discView.seek(3)')
    opened.value(TWO_FRAMES)
    assert float(opened.value(x)) > before + 20.0


def test_nothing_is_wider_than_the_window(opened):
    wide, window = opened.value('[document.documentElement.scrollWidth, innerWidth]')
    assert wide <= window


def test_the_theme_follows_the_system_and_the_button(opened):
    theme = 'document.documentElement.dataset.theme'
    first = opened.value(theme)
    opened.value('document.getElementById("theme").click()')
    assert {first, opened.value(theme)} == {'light', 'dark'}
    light = picture(opened, 1.0, 'field')[5, -5]
    opened.value('document.getElementById("theme").click()')
    dark = picture(opened, 1.0, 'field')[5, -5]
    assert abs(int(light.sum()) - int(dark.sum())) > 200


def test_zz_the_console_is_empty_and_no_host_was_asked(opened):
    """Last in this file: the other tests have used the page."""
    assert opened.problems == []
    assert [r for r in opened.requests if not r.startswith(('file:', 'data:'))] == []


def test_without_webgl_the_curves_stay(file, chromium):
    chromium.show_as(800, 600)
    with chromium.before('HTMLCanvasElement.prototype.getContext = () => null;'):
        chromium.open(file)
        chromium.wait('document.querySelector("#view p") !== null')
        assert 'no WebGL' in chromium.value('document.querySelector("#view").textContent')
        assert chromium.value('document.querySelectorAll("figure svg path").length') == 12
    chromium.open('data:text/html,')


def test_the_browser_of_the_tests_reports_problems_and_leaves_nothing(tmp_path, monkeypatch):
    path = tmp_path / 'bad.html'
    path.write_text(
        '<script>console.error("planted"); setTimeout(() => { throw Error("thrown"); });</script>'
    )
    with TemporaryDirectory() as folder:  # the path of the browser's socket has to be short
        monkeypatch.setenv('TMPDIR', folder)
        monkeypatch.setattr(tempfile, 'tempdir', folder)
        with browser.Browser(300, 300) as tab:
            tab.open(path)
            tab.value(TWO_FRAMES)
            text = '\n'.join(tab.problems)
        assert list(Path(folder).iterdir()) == []
    assert 'planted' in text
    assert 'thrown' in text
