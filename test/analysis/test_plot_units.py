"""Plots with `--units us` show the same data as in metric units, numbered in feet, mph and rpm."""

from dataclasses import replace
from functools import cache
from pathlib import Path
import re

from matplotlib.text import Text
import numpy as np
from numpy.testing import assert_array_equal
import pytest

from disc_sim_ros.analysis import bag_analysis, flights, plots, recording
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.estimation.identification import plots as estimation_plots
from disc_sim_ros.estimation.identification import report
from disc_sim_ros.estimation.identification.coefficients import base_of
from disc_sim_ros.estimation.identification.identify import identify
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.studies import optimise, optimise_plots
from disc_sim_ros.studies import plots as study_plots
from disc_sim_ros.studies.runner import collect
from disc_sim_ros.studies.scatter import Normal
from disc_sim_ros.studies.study import Study
from disc_sim_ros.studies.summary import summarise
from disc_sim_ros.units import SYSTEMS
from estimation import synthetic_sessions

SAMPLE = Path(__file__).parents[2] / 'samples' / 'fig5'
FACTORS = {'ft': ('m', 0.3048), 'mph': ('m/s', 0.44704), 'rpm': ('rad/s', 3.14159265359 / 30.0)}
METRIC = re.compile(r'(?<![\w/])(m|m/s|m²|rad/s)(?![\w/])')
SETUP = Setup(disc=load_disc('frisbee'))


def flight(system):
    return plots.flight_figure(fly(Launch(speed=15.0), SETUP, sample_rate=50.0), system)


def comparison(system):
    thrown = [fly(Launch(speed=speed), SETUP, sample_rate=50.0) for speed in (12.0, 15.0)]
    return plots.comparison_figure(thrown, ['slow', 'fast'], system)


def bag(system):
    disc = recording.discs(open_bag(SAMPLE))[0]
    analyses = [bag_analysis.analyse(f) for f in flights.flights(disc)]
    return plots.bag_figure(analyses, 'fig5', system)


def study(system, *, scatter=None, **vary):
    setup = Setup(disc=load_disc('frisbee'), wind=Wind(mean=(1.0, 0.0, 0.0), turbulence=0.5))
    asked = Study(setup=setup, count=20 if scatter else 1, scatter=scatter or {}, vary=vary)
    flown = collect(asked)
    return study_plots.figure(flown, summarise(flown, asked), system)


def landings(system):
    return study(system, scatter={'speed': Normal(1.0), 'spin': Normal(5.0)})


def curves(system):
    return study(system, speed=[10.0, 12.0, 14.0], scatter={'speed': Normal(1.0)})


def maps(system):
    return study(system, speed=[10.0, 12.0, 14.0], spin=[40.0, 60.0, 80.0])


def best_curves(system):
    return study(system, speed=[10.0, 14.0], height=[1.0, 2.0], pitch=[0.0, 10.0])


@cache
def optimised():
    asked = Study(setup=SETUP, count=10, scatter={'speed': Normal(0.5)})
    problem = optimise.Problem(
        goal='accuracy', study=asked, limits={'speed': (14.0, 20.0)}, target=(20.0, 3.0)
    )
    return optimise.optimise(problem, seed=1)


def optimum(system):
    return optimise_plots.figure(optimised(), system)


@cache
def identified():
    generator = np.random.default_rng(4)
    setup = Setup(disc=load_disc('ultrastar'))
    values = base_of(setup).values
    throws = synthetic_sessions.session(
        values, replace(setup, step=1e-3), ('position', 'gyro'), generator, count=1
    )
    return identify(throws, setup, free=['C_D0'], starts=1)


def fitted_paths(system):
    return estimation_plots.paths(identified(), system)


def residuals(system):
    return estimation_plots.residuals(identified(), system)


def test_the_report_of_an_identification_has_the_same_numbers_in_both_systems():
    metric, us = (report.text(identified(), [], SYSTEMS[name]) for name in ('metric', 'us'))
    assert METRIC.search(metric)
    assert not METRIC.search(us)
    values = {}
    for text in (metric, us):
        match = re.search(
            r'residuals of gyro: (\S+) \S+ rms.*residuals of position: (\S+)', text, re.S
        )
        wind = re.search(r'wind_x +(\S+) +(\S+)', text)
        values[text] = [float(x) for x in (*match.groups(), *wind.groups())]
    factors = [FACTORS[unit][1] for unit in ('rpm', 'ft', 'mph', 'mph')]
    for si, number, factor in zip(values[metric], values[us], factors, strict=True):
        assert number * factor == pytest.approx(si, rel=0.05)  # of two digits


@pytest.mark.parametrize(
    'drawn',
    [
        flight,
        comparison,
        bag,
        landings,
        curves,
        maps,
        best_curves,
        optimum,
        fitted_paths,
        residuals,
    ],
)
def test_a_plot_has_the_same_data_in_both_systems(drawn):
    metric, us = (drawn(SYSTEMS[name]) for name in ('metric', 'us'))
    assert any(METRIC.search(text.get_text()) for text in metric.findobj(Text))
    for text in us.findobj(Text):
        assert not METRIC.search(text.get_text()), text.get_text()
    converted = 0
    us.canvas.draw()
    for before, after in zip(metric.axes, us.axes, strict=True):
        for first, second in zip(before.lines, after.lines, strict=True):
            assert_array_equal(first.get_xydata(), second.get_xydata())
        for old, new in ((before.xaxis, after.xaxis), (before.yaxis, after.yaxis)):
            name, _, unit = new.get_label_text().rpartition(', ')
            si, factor = FACTORS.get(unit, (unit, 1.0))
            assert old.get_label_text() == new.get_label_text().removesuffix(unit) + si
            if unit not in FACTORS or after.get_label() == '<colorbar>':
                continue
            converted += 1
            ticks = [(float(t.get_text().replace('\N{MINUS SIGN}', '-')), place)
                     for t, place in zip(new.get_ticklabels(), new.get_ticklocs(), strict=True)
                     if t.get_text()]  # fmt: skip
            assert len(ticks) > 1, name
            for number, place in ticks:
                assert number * factor == pytest.approx(place, rel=1e-6, abs=1e-9)
                assert len(f'{number:g}') < 7  # round numbers
    assert converted
