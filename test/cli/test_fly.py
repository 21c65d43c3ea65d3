"""`fly`: the document and the summary that it prints."""

import math
import re

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
import pytest
from scipy.spatial.transform import Rotation

from cli.fly_command import ARRAYS, DIAMETER, ROUNDING, Result, paper_velocity
from disc_sim_ros import __version__
from disc_sim_ros.physics import disc_file, flight
from disc_sim_ros.physics.launch import Launch

pytestmark = pytest.mark.usefixtures('compiled')


LAUNCHES = {
    'default': (),
    'tilted': ('--pitch', 8, '--roll', -25, '--yaw', 130, '--height', 1.5),
    'air from below': ('--alpha', 12, '--roll', 10, '--height', 2),
    'sideways': ('--sideslip', -35, '--alpha', -4, '--yaw', -70, '--height', 2),
    'wobbling': ('--roll-rate', 4, '--pitch-rate', -3, '--spin', -50, '--speed', 22),
    'upside down': ('--roll', 180, '--pitch', -10, '--height', 3),
    'in wind': ('--wind', 4, -3, 1, '--height', 2),
}


@pytest.mark.parametrize('arguments', LAUNCHES.values(), ids=LAUNCHES)
def test_the_document_is_complete_and_typed(document, arguments):
    flown = document('--samples', 20, *arguments)
    assert isinstance(flown['launch'], dict)
    assert flown['landed'] is True
    for key in ('flight_time_s', 'range_m', 'drift_m', 'apex_m'):
        assert isinstance(flown[key], float), key
    assert np.shape(flown['landing_position_m']) == (3,)
    assert flown['landing_position_m'][2] == 0.0
    n = len(flown['t_s'])
    assert n == math.floor(flown['flight_time_s'] * 20) + 1
    for key, shape in ARRAYS.items():
        assert np.shape(flown[key]) == (n, *shape), key
        assert np.isfinite(flown[key]).all(), key


def test_without_samples_the_document_holds_no_arrays(document):
    assert not ARRAYS.keys() & document().keys()


def test_the_document_repeats_the_launch(document):
    arguments = {
        '--disc': ('disc', 'frisbee_as_printed'),
        '--model': ('model', 'constant_spin'),
        '--aero': ('aero', 'linear'),
        '--moment-axes': ('moment_axes', 'wind'),
        '--speed': ('speed_m_s', 14.5),
        '--pitch': ('pitch_deg', 7.5),
        '--roll': ('roll_deg', -3.5),
        '--yaw': ('yaw_deg', 20.5),
        '--alpha': ('angle_of_attack_deg', 2.5),
        '--sideslip': ('sideslip_deg', 1.5),
        '--spin': ('spin_rad_s', 40.5),
        '--roll-rate': ('roll_rate_rad_s', 0.5),
        '--pitch-rate': ('pitch_rate_rad_s', -0.5),
        '--height': ('height_m', 1.25),
        '--air-density': ('air_density_kg_m3', 1.1),
        '--gravity': ('gravity_m_s2', 9.7),
        '--step': ('step_s', 0.002),
    }
    flags = [x for flag, (_, value) in arguments.items() for x in (flag, value)]
    launch = document(*flags, '--control', 1e-3, 2e-3, -3e-3, '--wind', 1, -2, 0.5)['launch']
    for key, value in arguments.values():
        assert launch[key] == value
    assert launch['control'] == [1e-3, 2e-3, -3e-3]
    assert launch['wind_m_s'] == [1.0, -2.0, 0.5]


def test_the_defaults_are_the_throw_of_fig_5(document):
    launch = document()['launch']
    assert (launch['disc'], launch['model'], launch['aero']) == ('frisbee', 'exact', 'table')
    assert (launch['speed_m_s'], launch['pitch_deg'], launch['spin_rad_s']) == (15, 15, 31.416)
    assert launch['moment_axes'] == 'body'
    others = ('roll', 'yaw', 'angle_of_attack', 'sideslip')
    assert {launch[f'{angle}_deg'] for angle in others} == {0.0}
    assert (launch['height_m'], launch['control']) == (0.0, [0.0, 0.0, 0.0])


@pytest.mark.parametrize('arguments', LAUNCHES.values(), ids=LAUNCHES)
def test_the_first_sample_is_the_launch(document, arguments):
    flown = document('--samples', 20, *arguments)
    launch = flown['launch']
    first = {key: np.array(flown[key][0]) for key in ARRAYS}
    velocity = paper_velocity(launch) * (1, -1, -1)  # to map: y left, z up
    through_air = velocity - launch['wind_m_s']
    assert_array_equal(first['position_m'], [0.0, 0.0, launch['height_m']])
    assert_allclose(first['velocity_m_s'], velocity, rtol=0.0, atol=ROUNDING)
    assert first['airspeed_m_s'] == pytest.approx(np.linalg.norm(through_air), abs=ROUNDING)
    assert first['spin_rad_s'] == launch['spin_rad_s']
    # Beyond a quarter turn of pitch other angles mean the same attitude; none is here.
    turned = (first['roll_deg'] - launch['roll_deg'] + 180.0) % 360.0 - 180.0
    assert turned == pytest.approx(0.0, abs=ROUNDING)
    assert first['pitch_deg'] == pytest.approx(launch['pitch_deg'], abs=ROUNDING)
    if not any(launch['wind_m_s']):
        assert first['alpha_deg'] == pytest.approx(launch['angle_of_attack_deg'], abs=ROUNDING)


@pytest.mark.parametrize('arguments', LAUNCHES.values(), ids=LAUNCHES)
def test_the_arrays_agree_with_each_other(document, arguments):
    rate = 500
    flown = document('--samples', rate, *arguments)
    arrays = {key: np.array(flown[key]) for key in ARRAYS}
    through_air = arrays['velocity_m_s'] - flown['launch']['wind_m_s']
    airspeed = np.linalg.norm(through_air, axis=1)
    assert_allclose(arrays['airspeed_m_s'], airspeed, rtol=0.0, atol=ROUNDING)
    # eqn 50; the arc cosine near 1 makes 1e-16 to 1e-8 rad.
    cosine = np.cos(np.radians(arrays['roll_deg'])) * np.cos(np.radians(arrays['pitch_deg']))
    tilt = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert_allclose(arrays['absolute_attitude_deg'], tilt, rtol=0.0, atol=3e-6)
    ratio = arrays['spin_rad_s'] * DIAMETER / (2 * airspeed)  # eqn 63
    assert_allclose(arrays['advance_ratio'], ratio, rtol=0.0, atol=ROUNDING)
    # Central differences: h^2 / 6 of the second derivative of the velocity, below 2e3 m/s^3: a
    # wobble of 5 rad/s lasts.
    slope = (arrays['position_m'][2:] - arrays['position_m'][:-2]) * rate / 2
    assert_allclose(slope, arrays['velocity_m_s'][1:-1], rtol=0.0, atol=2e3 / rate**2 / 6)


@pytest.mark.parametrize('arguments', LAUNCHES.values(), ids=LAUNCHES)
def test_the_angle_of_attack_is_that_of_the_attitude(document, arguments):
    """The paper's eqn 17 through scipy's rotations; the yaw comes from the flight itself."""
    printed = document('--samples', 50, *arguments)
    launch = printed['launch']
    names = ('speed', 'pitch', 'roll', 'yaw', 'angle_of_attack', 'sideslip', 'spin', 'height')
    units = ('m_s', 'deg', 'deg', 'deg', 'deg', 'deg', 'rad_s', 'm')
    given = {name: launch[f'{name}_{unit}'] for name, unit in zip(names, units, strict=True)}
    rates = {name: launch[f'{name}_rad_s'] for name in ('roll_rate', 'pitch_rate')}
    wind = tuple(launch['wind_m_s'] * np.array([1.0, -1.0, -1.0]))
    setup = flight.Setup(disc=disc_file.load_disc('frisbee'), wind=flight.Wind(mean=wind))
    flown = flight.fly(Launch(**given, **rates), setup, sample_rate=50.0)
    attitude = Rotation.from_quat(np.roll(flown.trajectory.attitude, -1, axis=1))
    through_air = (np.array(printed['velocity_m_s']) - launch['wind_m_s']) * (1, -1, -1)
    u, v, w = attitude.inv().apply(through_air).T
    alpha = np.degrees(np.arctan2(w, np.hypot(u, v)))
    assert_allclose(printed['alpha_deg'], alpha, rtol=0.0, atol=1e-7)  # scipy normalises again


@pytest.mark.parametrize('rate', [1, 7, 30, 333.3, 1000, 0.001, 3000])
def test_samples_are_timed_exactly(document, rate):
    flown = document('--samples', rate)
    t = flown['t_s']
    assert t == [k / rate for k in range(len(t))]
    # The landing is known to 1e-12 s, and a sample may fall on it.
    assert t[-1] <= flown['flight_time_s'] + 1e-12
    assert len(t) / rate > flown['flight_time_s'] - 1e-12


@pytest.mark.parametrize('rate', [0.001, 7, 100, 333.3, 3000])
@pytest.mark.parametrize('more', [(), ('--turbulence', 10)], ids=['still air', 'gusts'])
def test_samples_do_not_change_the_flight_by_a_bit(document, rate, more):
    flown = document('--samples', rate, *more)
    assert {key: value for key, value in flown.items() if key not in ARRAYS} == document(*more)


def test_samples_of_two_rates_agree_where_they_meet(document):
    slow, fast = document('--samples', 10), document('--samples', 70)
    for key in ARRAYS:
        # Seven times 1/70 is not 1/10 to the bit, and a shorter last step is other rounding.
        assert_allclose(slow[key], fast[key][::7], rtol=0.0, atol=ROUNDING, err_msg=key)


def test_a_flight_without_ground_lasts_for_its_duration(document):
    flown = document('--no-ground', '--duration', 5, '--samples', 10)
    assert (flown['landed'], flown['landing_position_m']) == (False, None)
    assert flown['flight_time_s'] == 5.0
    assert flown['t_s'][-1] == 5.0
    assert flown['end_position_m'] == flown['position_m'][-1]
    assert flown['end_position_m'][2] < 0.0


def test_a_flight_shorter_than_its_landing_has_not_landed(document):
    flown = document('--duration', 1)
    assert (flown['landed'], flown['landing_position_m']) == (False, None)
    assert flown['flight_time_s'] == 1.0
    assert flown['end_position_m'][2] > 0.0


def test_range_and_drift_are_those_of_the_landing(document):
    flown = document('--yaw', 40)
    x, y, _ = flown['landing_position_m']
    assert flown['range_m'] == pytest.approx(math.hypot(x, y), abs=ROUNDING)
    yaw = math.radians(40)  # to the right, so towards -y
    left = x * math.sin(yaw) + y * math.cos(yaw)
    assert flown['drift_m'] == pytest.approx(left, abs=ROUNDING)


def test_the_apex_is_not_below_any_sample(document):
    flown = document('--samples', 2000)
    heights = np.array(flown['position_m'])[:, 2]
    # Between two samples 0.5 ms apart the top rises by g t^2 / 2 at most.
    assert 0.0 <= flown['apex_m'] - heights.max() < 9.81 * 0.0005**2 / 2


def test_without_airspeed_there_is_no_advance_ratio(document):
    flown = document('--speed', 0, '--height', 5, '--samples', 10)
    assert flown['advance_ratio'][0] is None
    assert flown['advance_ratio'][1] > 0.0


def test_the_summary_describes_the_flight(fly, document):
    result, flown = fly(), document()
    assert (result.code, result.err) == (0, '')
    lines = result.out.splitlines()
    assert 5 <= len(lines) <= 20
    assert max(map(len, lines)) < 100
    x, y, _ = flown['landing_position_m']
    assert lines[0].startswith('frisbee: ')
    for part in (
        'exact',
        'table',
        '15 m/s',
        '31.416 rad/s, clockwise',
        f'landed  after {flown["flight_time_s"]:.3f} s at x {x:.2f} m, y {y:.2f} m',
        f'range   {flown["range_m"]:.2f} m, drift {-flown["drift_m"]:.2f} m to the right',
        f'apex {flown["apex_m"]:.2f} m',
        f'{flown["end_spin_rad_s"] / 31.416:.1%} of the spin left',
    ):
        assert part in result.out


@pytest.mark.parametrize(
    ('arguments', 'part'),
    [
        (('--spin', -31.416), 'anticlockwise'),
        (('--spin', -31.416), 'to the left'),
        (('--duration', 1), 'in the air after 1.000 s'),
        (('--wind', 1, -2, 0), 'wind    1 -2 0 m/s'),
        (('--control', 0.01, 0, 0), 'C_L 0.01'),
        (('--turbulence', 5, '--seed', 3), '5 m/s at 6 m, seed 3'),
        (('--sideslip', 4), 'sideslip 4 degrees'),
        (('--roll-rate', 2), 'roll rate 2'),
        (('--speed', 0, '--spin', 0), 'landed  after 0.000 s'),
        (('--disc', 'wraith'), 'wraith: Innova Wraith'),
    ],
)
def test_the_summary_names_each_special_condition(fly, arguments, part):
    assert part in fly(*arguments).out


def test_the_summary_holds_a_table_of_samples(fly, document):
    rows = fly('--samples', 2).out.splitlines()[-8:]
    flown = document('--samples', 2)
    assert len(flown['t_s']) == 8
    for row, t, (x, y, z) in zip(rows, flown['t_s'], flown['position_m'], strict=True):
        assert [float(cell) for cell in row.split()[:4]] == [
            pytest.approx(value, abs=0.6e-3) for value in (t, x, y, z)
        ]


def test_help_states_the_unit_and_the_range_of_every_flag(fly):
    result = fly('--help')
    text = ' '.join(result.out.split())
    assert (result.code, result.err) == (0, '')
    for flag, metavar, limits in (
        ('--speed', 'M/S', 'from 0 to 200 m/s'),
        ('--pitch', 'DEG', 'from -180 to 180 degrees'),
        ('--roll', 'DEG', 'from -180 to 180 degrees'),
        ('--yaw', 'DEG', 'from -360 to 360 degrees'),
        ('--alpha', 'DEG', 'from -180 to 180 degrees'),
        ('--sideslip', 'DEG', 'from -180 to 180 degrees'),
        ('--spin', 'RAD/S', 'from -1300 to 1300 rad/s'),
        ('--advance-ratio', 'R', 'from -100 to 100'),
        ('--roll-rate', 'RAD/S', 'from -1000 to 1000 rad/s'),
        ('--pitch-rate', 'RAD/S', 'from -1000 to 1000 rad/s'),
        ('--height', 'M', 'from -1000 to 10000 m'),
        ('--control', 'CL CM CN', 'from -10 to 10'),
        ('--wind', 'X Y Z', 'from -100 to 100 m/s'),
        ('--duration', 'S', 'to 3600 s'),
        ('--step', 'S', 'from 1e-06 to 0.1 s'),
        ('--samples', 'HZ', 'from 0.001 to 10000'),
    ):
        described = re.search(rf'{flag} {metavar} (?!\|)([^-]|-(?!-))*?{limits}', text)
        assert described, flag
    for flag in ('--json', '--csv FILE', '--plot FILE.png', '--no-ground', '--disc', '--model'):
        assert flag in text


def test_version(fly):
    assert fly('--version') == Result(0, f'fly {__version__}\n', '')
