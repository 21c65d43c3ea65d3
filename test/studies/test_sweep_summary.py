"""Summaries against numpy, normal laws against their own ellipses, indices against known ones."""

import math

import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.analysis import plots
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.environment import Air
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.studies.plots import figure
from disc_sim_ros.studies.report import summary_document, summary_text
from disc_sim_ros.studies.runner import collect, sweep
from disc_sim_ros.studies.scatter import Normal
from disc_sim_ros.studies.statistics import GroupMeans, Moments, Percentiles, between_share
from disc_sim_ros.studies.study import Study
from disc_sim_ros.studies.summary import Ellipse, radius2, summarise

FRISBEE = disc_file.load_disc('frisbee')
SETUP = Setup(disc=FRISBEE, step=0.02)
VACUUM = Setup(disc=FRISBEE, step=0.02, air=Air(density=0.0))
SCATTER = Study(
    setup=SETUP, count=1000, sampling='sobol',
    scatter={'speed': Normal(1.0, 15.0), 'pitch': Normal(2.0), 'roll': Normal(3.0)},
)  # fmt: skip


def test_moments_of_chunks_are_those_of_all_rows():
    rows = np.random.default_rng(1).normal([1e6, 2.0, -3.0], [1.0, 5.0, 1e-3], (5000, 3))
    moments = Moments(3)
    for piece in np.array_split(rows, 7):
        moments.add(piece)
    moments.add(rows[:0])
    assert_allclose(moments.mean, rows.mean(axis=0), rtol=1e-12)
    # 1e6 with a spread of 1 costs six of the sixteen digits of a covariance.
    assert_allclose(moments.covariance, np.cov(rows.T), rtol=1e-6, atol=1e-9)
    assert_allclose(moments.least, rows.min(axis=0))


def test_percentiles_are_within_a_bin_of_the_exact_ones():
    values = np.random.default_rng(2).exponential(3.0, 100_000)
    percentiles = Percentiles(values.min(), values.max())
    for piece in np.array_split(values, 9):
        percentiles.add(piece)
    width = (values.max() - values.min()) / 2**16
    for percent in (0.1, 5.0, 50.0, 99.0):
        # One bin, and the gap between neighbours, which at 99 % is 3 / (100000 * 0.01) m.
        assert abs(percentiles.at(percent) - np.percentile(values, percent)) < 2 * width + 0.01


def test_group_means_are_those_of_the_groups():
    rng = np.random.default_rng(3)
    group, rows = rng.integers(0, 5, 3000), rng.normal(1e4, 2.0, (3000, 2))
    means = GroupMeans(6, 2)
    for place in np.array_split(np.arange(3000), 4):
        means.add(group[place], rows[place])
    for g in range(5):
        assert_allclose(means.mean[g], rows[group == g].mean(axis=0), rtol=1e-12)
        assert_allclose(means.variance[g], rows[group == g].var(axis=0, ddof=1), rtol=1e-8)
    assert means.n[5] == 0
    assert np.isnan(means.mean[5]).all()


def test_first_order_indices_of_the_ishigami_function():
    """Exact: 0.3139, 0.4424 and 0 with a = 7, b = 0.1 (Ishigami & Homma 1990)."""
    n, bins = 2**16, 64
    x = np.random.default_rng(4).uniform(-math.pi, math.pi, (n, 3))
    y = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    for j, exact in enumerate((0.3139, 0.4424, 0.0)):
        groups = GroupMeans(bins, 1)
        groups.add(((x[:, j] / math.pi + 1) / 2 * bins).astype(int), y[:, None])
        # Bins of a sine lose less than its share (pi / bins)^2 / 3; the sample adds 1 / sqrt(n).
        assert between_share(groups)[0] == pytest.approx(exact, abs=0.01)


def test_ellipses_of_a_normal_law_hold_their_share():
    rng = np.random.default_rng(5)
    covariance = np.array([[9.0, 4.0], [4.0, 4.0]])
    xy = rng.multivariate_normal([0.0, 0.0], covariance, 200_000)
    r2 = np.einsum('ni,ij,nj->n', xy, np.linalg.inv(covariance), xy)
    for percent in (50, 90, 95):
        assert np.mean(r2 <= radius2(percent)) == pytest.approx(percent / 100, abs=0.004)
    long, short, angle = Ellipse((0.0, 0.0), covariance, {}).semi_axes(50)
    assert long * short == pytest.approx(radius2(50) * math.sqrt(np.linalg.det(covariance)))
    assert math.tan(math.radians(2 * angle)) == pytest.approx(2 * 4.0 / (9.0 - 4.0))


def test_a_summary_agrees_with_numpy(tmp_path):
    flights = collect(SCATTER)
    for source in (flights, sweep(SCATTER, tmp_path / 'a.parquet', batch=300)):
        summary = summarise(source, SCATTER)
        assert summary.counts == {'flying': 0, 'landed': 1000, 'lost': 0}
        for name, spread in summary.spreads.items():
            assert spread.mean == pytest.approx(flights[name].mean(), rel=1e-9)
            assert spread.sd == pytest.approx(flights[name].std(ddof=1), rel=1e-9)
            median = np.median(flights[name])
            span = flights[name].max() - flights[name].min()
            assert abs(spread.percentiles[50.0] - median) < 0.01 * span
        x = np.column_stack([flights[n] for n in ('speed_m_s', 'pitch_deg', 'roll_deg')])
        slopes = np.linalg.lstsq(np.column_stack([np.ones(1000), x]), flights['range_m'])[0][1:]
        of_range = [s for s in summary.sensitivities if s.result == 'range_m']
        assert [s.quantity for s in of_range] == ['speed', 'pitch', 'roll']
        assert_allclose([s.slope for s in of_range], slopes, rtol=1e-9)


def test_sensitivities_in_vacuum_are_those_of_the_parabola():
    """Range V^2 sin(2 theta) / g: its slopes at 15 m/s and 30 degrees are 2.65 and 0.40 m."""
    study = Study(
        setup=VACUUM, launch=Launch(pitch=30.0), count=4096, sampling='sobol',
        scatter={'speed': Normal(0.05), 'pitch': Normal(0.05)},
    )  # fmt: skip
    of_range = [s for s in summarise(collect(study), study).sensitivities
             if s.result == 'range_m']  # fmt: skip
    speed, angle = 15.0, math.radians(60.0)
    per_speed = 2 * speed * math.sin(angle) / 9.81
    per_degree = 2 * speed**2 * math.cos(angle) / 9.81 * math.pi / 180
    assert of_range[0].slope == pytest.approx(per_speed, rel=1e-3)  # curvature over the scatter
    assert of_range[1].slope == pytest.approx(per_degree, rel=1e-3)
    share = per_speed**2 / (per_speed**2 + per_degree**2)
    assert of_range[0].first_order == pytest.approx(share, abs=0.01)  # 64 bins
    assert of_range[0].correlation == pytest.approx(math.sqrt(share), abs=1e-3)


def test_the_best_grid_point_has_the_greatest_mean():
    study = Study(
        setup=SETUP, vary={'pitch': [5.0, 10.0, 15.0], 'roll': [-5.0, 0.0]},
        scatter={'speed': Normal(1.0)}, count=10,
    )  # fmt: skip
    flights = collect(study)
    summary = summarise(flights, study)
    means = flights['range_m'].reshape(6, 10).mean(axis=1)
    best = summary.best[0]
    assert best.mean == pytest.approx(means.max(), rel=1e-12)
    assert best.point == means.argmax()
    pitch, roll = (flights[n].reshape(6, 10)[best.point, 0] for n in ('pitch_deg', 'roll_deg'))
    assert best.values == {'pitch': pitch, 'roll': roll}


def test_flights_that_do_not_land_are_counted_separately():
    study = Study(setup=SETUP, vary={'pitch': [10.0, 80.0]}, duration=3.0)
    summary = summarise(collect(study), study)
    assert summary.counts == {'flying': 1, 'landed': 1, 'lost': 0}
    assert summary.spreads['time_s'].greatest < 3.0
    none = Study(setup=SETUP, vary={'pitch': [10.0, 20.0]}, duration=0.1)
    assert 'no flight ended' in summary_text(summarise(collect(none), none))
    assert summary_document(summarise(collect(none), none))['results'] == {}


@pytest.mark.parametrize(
    ('study', 'panels', 'words'),
    [
        (SCATTER, 2, ['forward x, m', 'sd of the result']),
        (Study(setup=SETUP, vary={'pitch': [5.0, 10.0, 15.0]}), 3, ['', 'range, m']),
        (Study(setup=SETUP, vary={'pitch': [5.0, 9.0, 15.0], 'roll': [-9.0, 0.0, 5.0]}), 4,
         ['pitch, °', 'roll, °', 'range, m']),
        (Study(setup=SETUP, vary={'pitch': [5.0, 9.0], 'roll': [0.0, 5.0],
                                     'speed': [12.0, 15.0]}), 6, ['speed, m/s']),
    ],
    ids=['scatter', 'curve', 'map', 'more'],
)  # fmt: skip
def test_each_kind_of_study_has_its_plot(study, panels, words):
    flights = collect(study)
    page = figure(flights, summarise(flights, study))
    assert len(page.axes) == panels
    labels = [text for axis in page.axes for text in (axis.get_xlabel(), axis.get_ylabel())]
    assert all(any(word in label for label in labels) for word in words)
    if study is SCATTER:
        assert page.axes[0].get_aspect() == 1.0
        lines = page.axes[0].get_legend_handles_labels()[1]
        assert [line.split()[0] for line in lines] == ['release', '50', '90', '95']
        dots = next(line for line in page.axes[0].lines if len(line.get_xdata()) == 1000)
        assert_allclose(dots.get_xdata(), flights['x_m'])
    assert plots.image(page, 'png').startswith(b'\x89PNG')


def test_a_density_holds_every_landing():
    study = Study(setup=SETUP, scatter={'pitch': Normal(2.0)}, count=6000)
    flights = collect(study)
    page = figure(flights, summarise(flights, study))
    mesh = page.axes[0].collections[0]
    x_edges = mesh.get_coordinates()[0, :, 0]
    cell = (x_edges[1] - x_edges[0]) ** 2
    assert mesh.get_array().sum() * cell == pytest.approx(6000)
