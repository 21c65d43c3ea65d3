"""Discs from flight numbers: the way of each number, the fit, the uncertainty, files and bags."""

import numpy as np
from numpy.testing import assert_allclose
import pytest

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file, flight_numbers
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch

# Nose and path a little up, and a speed and a spin usual for a driver.
THROW = Launch(speed=24.0, pitch=8.0, spin=110.0, height=1.2)
NUMBERS = (11, 5, -1, 3)


@pytest.fixture(scope='module')
def fit():
    return flight_numbers.calibration(disc_file._entry)


def flown(numbers):
    disc = load_disc('/'.join(f'{n:g}' for n in numbers))
    flight = fly(THROW, Setup(disc=disc), sample_rate=50.0)
    return flight, -flight.trajectory.position[:, 1]  # how far left [m]


def varied(place, values):
    return [flown([*NUMBERS[:place], value, *NUMBERS[place + 1 :]]) for value in values]


def test_less_turn_turns_farther_right():
    """In 2 s, before the disc fades back, or comes down because it has turned over."""
    right = [-left[100] for _, left in varied(2, np.arange(-5, 1.5, 0.5))]
    assert all(np.diff(right) < 0.0), right


def test_more_fade_fades_farther_left():
    """From the place farthest right to the landing."""
    back = [flight.position[1] - left.min() for flight, left in varied(3, np.arange(0, 6))]
    assert all(np.diff(back) > 0.0), back


def test_more_speed_and_glide_fly_faster_and_longer():
    drags = [load_disc(f'{speed}/5/-1/3').table.coefficients[:, 1].min() for speed in range(1, 16)]
    assert all(np.diff(drags) < 0.0)
    lifts = [load_disc(f'11/{glide}/-1/3').table.coefficients[14, 0] for glide in range(1, 8)]
    assert all(np.diff(lifts) > 0.0)


def test_the_lines_are_least_squares_of_the_catalogue(fit):
    tables = {n: load_disc(n).table for n in flight_numbers.TABLES}
    at_0, at_10 = (
        {n: np.interp(a, t.alpha_deg, t.coefficients[:, 2]) for n, t in tables.items()}
        for a in (0.0, 10.0)
    )
    for line, number, moments in ((fit.turn, 2, at_0), (fit.fade, 3, at_10)):
        A = np.array([[1.0, flight_numbers.TABLES[n][number]] for n in tables])
        b = np.array([moments[n] for n in tables])
        (start, slope), (square,), *_ = np.linalg.lstsq(A, b)
        assert_allclose([line.start, line.slope], [start, slope], rtol=1e-9)
        assert line.residual == pytest.approx(np.sqrt(square / 2), rel=1e-9)


@pytest.mark.parametrize('name', flight_numbers.TABLES)
def test_a_disc_of_the_catalogue_is_met_to_three_residuals(fit, name):
    """With four discs and a line of two numbers, none can be farther than 1.5 residuals."""
    numbers = '/'.join(map(str, flight_numbers.TABLES[name]))
    made, measured = load_disc(numbers).table, load_disc(name).table
    for alpha, column, line in ((0.0, 2, fit.turn), (10.0, 2, fit.fade), (0.0, 0, fit.lift)):
        values = [
            np.interp(alpha, t.alpha_deg, t.coefficients[:, column]) for t in (made, measured)
        ]
        assert abs(values[0] - values[1]) <= 1.5 * line.residual + 1e-9


def test_the_uncertainty_is_told_and_written(fit, tmp_path):
    disc = load_disc('11/5/-1/3')
    assert disc.uncertainty == {
        'lift_offset': fit.lift.residual,
        'drag_offset': fit.drag.residual,
        'pitching_offset': max(fit.turn.residual, fit.fade.residual),
    }
    assert f'C_Drag by {fit.drag.residual:.2g}' in disc.description
    again = disc_file.disc_from_document('again', disc_file.disc_document(disc))
    assert again.uncertainty == disc.uncertainty
    assert_allclose(again.table.coefficients, disc.table.coefficients, rtol=0.0)
    assert 'uncertainty' not in disc_file.disc_document(load_disc('frisbee'))


@pytest.mark.parametrize('text', ['11/5/-1/3', '[11, 5, -1, 3]', '"11/5/-1/3"'])
def test_a_file_gives_numbers_and_what_it_knows_better(tmp_path, text):
    path = tmp_path / 'mine.yaml'
    path.write_text(f'flight_numbers: {text}\nmass_kg: 0.165\ndamping: {{C_Nr: -5e-3}}\n')
    disc, plain = load_disc(str(path)), load_disc('11/5/-1/3')
    assert (disc.mass, disc.C_Nr, disc.C_Lp) == (0.165, -5e-3, plain.C_Lp)
    assert disc.inertia_axial == pytest.approx(plain.inertia_axial * 0.165 / 0.175, rel=1e-12)
    assert_allclose(disc.table.coefficients, plain.table.coefficients, rtol=0.0)


@pytest.mark.parametrize(
    ('text', 'fragments'),
    [
        ('11/5/-1', ['speed/glide/turn/fade']),
        ('11/5/-1/3/2', ['speed/glide/turn/fade']),
        ('20/5/-1/3', ['speed in 20/5/-1/3: 20', '1 to 15']),
        ('11/5/-9/3', ['turn in', '-6 to 2']),
        ('11/5/-1/x', ["'11/5/-1/x'", 'choose from']),
    ],
)
def test_bad_numbers_are_refused(text, fragments):
    with pytest.raises(ConfigError) as error:
        load_disc(text)
    assert all(fragment in str(error.value) for fragment in fragments), error.value


@pytest.mark.parametrize(
    ('content', 'fragments'),
    [
        ('flight_numbers: driver\n', ['flight_numbers', 'driver', '11/5/-1/3']),
        ('flight_numbers: 11/5/-9/3\n', ['mine.yaml: turn in', '-6 to 2']),
        ('flight_numbers: 11/5/-1/3\nbased_on: frisbee\n', ['one of based_on']),
        (
            'flight_numbers: 11/5/-1/3\nuncertainty: {lift_offset: -1}\n',
            ['uncertainty.lift_offset', '-1'],
        ),
    ],
)
def test_a_bad_file_is_refused(tmp_path, content, fragments):
    path = tmp_path / 'mine.yaml'
    path.write_text(content)
    with pytest.raises(ConfigError) as error:
        load_disc(str(path))
    assert all(fragment in str(error.value) for fragment in fragments), error.value
