"""The page of `identify --report` with the fitted flights, in a browser."""

import csv

import numpy as np
import pytest

import browser
from disc_sim_ros.cli import identify
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.frames import map_from_paper
from disc_sim_ros.physics.launch import Launch
from view.test_browser import SIZES, poses, shown_at

pytest.importorskip('trimesh')
pytestmark = [
    pytest.mark.skipif(browser.program() is None, reason=browser.MISSING),
    pytest.mark.xdist_group('browser'),  # identified once
]
NOISE = 2e-3  # m
LAUNCH = Launch(speed=18.0, pitch=10.0, spin=60.0, height=1.3)


@pytest.fixture(scope='module')
def trajectory():
    return fly(LAUNCH, Setup(disc=load_disc('ultrastar')), sample_rate=30.0).trajectory


@pytest.fixture(scope='module')
def file(trajectory, tmp_path_factory):
    folder = tmp_path_factory.mktemp('identified')
    measured = folder / 'one.csv'
    noise = np.random.default_rng(1).normal(0.0, NOISE, trajectory.position.shape)
    rows = np.column_stack([trajectory.t, map_from_paper(trajectory.position) + noise])
    with measured.open('w', newline='') as text:
        csv.writer(text).writerows([['t_s', 'x_m', 'y_m', 'z_m'], *rows.tolist()])
    report = folder / 'report'
    words = [str(measured), '--disc', 'ultrastar', '--free', 'C_D0', '--spin', '60']
    assert identify.main([*words, '--starts', '1', '--report', str(report)]) == 0
    return report / 'throws.html'


@pytest.mark.parametrize('size', SIZES)
def test_the_fitted_flight_flies_past_the_measured_points(file, trajectory, size, chromium):
    """The noise is far below a centimetre, so the fit is within one of the true positions."""
    places = map_from_paper(trajectory.position)
    with shown_at(chromium, size, file) as tab:
        for k, pose in zip((10, 60), poses(tab, 0, trajectory.t[[10, 60]]), strict=True):
            assert pose['position'] == pytest.approx(places[k], abs=0.01)
        assert tab.problems == []
