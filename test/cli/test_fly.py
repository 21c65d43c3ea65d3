"""`fly` as its users meet it: what it prints, what it writes, what it refuses and how it ends."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import errno
import json
import math
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import threading
import xml.etree.ElementTree as ET

from matplotlib import image
import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
import pytest
from scipy.spatial.transform import Rotation

from disc_sim_ros import __version__
from disc_sim_ros.cli import fly as program
from disc_sim_ros.cli import output
from disc_sim_ros.core import catalogue, flight
from disc_sim_ros.core.errors import DiscSimError
from disc_sim_ros.core.launch import Launch

EXECUTABLE = Path(sys.executable).with_name('fly')
ARRAYS = {
    't_s': (),
    'position_m': (3,),
    'velocity_m_s': (3,),
    'airspeed_m_s': (),
    'alpha_deg': (),
    'roll_deg': (),
    'pitch_deg': (),
    'yaw_deg': (),
    'absolute_attitude_deg': (),
    'spin_rad_s': (),
    'advance_ratio': (),
}
DIAMETER = 0.275  # m, of the default disc
# Differences of sums and products of doubles of the size of these flights (1e2): 1e-14 each.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Result:
    """What a run of `fly` left behind."""

    code: int
    out: str
    err: str


@pytest.fixture(scope='module', autouse=True)
def compiled():
    """Compile first, so that no test sees the note about it."""
    flight.fly(Launch(), flight.Setup(disc=catalogue.load('frisbee')))


@pytest.fixture
def fly(capsys) -> Callable[..., Result]:
    """Run `fly` in this process."""

    def run(*arguments: object) -> Result:
        try:
            code = program.main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = end.code
        return Result(code, *capsys.readouterr())

    return run


@pytest.fixture
def document(fly) -> Callable[..., dict]:
    """Run `fly --json` and return what it printed."""

    def run(*arguments: object) -> dict:
        result = fly('--json', *arguments)
        assert (result.code, result.err) == (0, '')
        assert result.out.count('\n') == 1
        return json.loads(result.out, parse_constant=pytest.fail)  # no NaN, no Infinity

    return run


def start(*arguments: object, **options) -> subprocess.CompletedProcess:
    """Run the installed program."""
    command = [EXECUTABLE, *map(str, arguments)]
    options = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE} | options
    return subprocess.run(command, text=True, timeout=120, check=False, **options)


def environment(**changes: str | None) -> dict[str, str]:
    """The environment with changes; None takes a variable away."""
    merged = {**os.environ, **changes}
    return {name: value for name, value in merged.items() if value is not None}


def refused(result: Result, *fragments: str) -> None:
    """The run ended with code 2 and one line that holds the fragments."""
    assert result.code == 2
    assert result.out == ''
    assert re.fullmatch(r'fly: error: [^\n]+\n', result.err)
    for fragment in fragments:
        assert fragment in result.err


def paper_velocity(launch: dict) -> np.ndarray:
    """The velocity at release in the paper's earth axes, from scipy's rotations."""
    alpha = math.radians(launch['angle_of_attack_deg'])
    beta = math.radians(launch['sideslip_deg'])
    uvw = [math.cos(alpha) * math.cos(beta), math.cos(alpha) * math.sin(beta), math.sin(alpha)]
    angles = [launch['yaw_deg'], launch['pitch_deg'], launch['roll_deg']]
    return launch['speed_m_s'] * Rotation.from_euler('ZYX', angles, degrees=True).apply(uvw)


# --- the document

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
    found = document('--samples', 20, *arguments)
    assert isinstance(found['launch'], dict)
    assert found['landed'] is True
    for key in ('flight_time_s', 'range_m', 'drift_m', 'apex_m'):
        assert isinstance(found[key], float), key
    assert np.shape(found['landing_position_m']) == (3,)
    assert found['landing_position_m'][2] == 0.0
    n = len(found['t_s'])
    assert n == math.floor(found['flight_time_s'] * 20) + 1
    for key, shape in ARRAYS.items():
        assert np.shape(found[key]) == (n, *shape), key
        assert np.isfinite(found[key]).all(), key


def test_without_samples_the_document_holds_no_arrays(document):
    assert not ARRAYS.keys() & document().keys()


def test_the_document_repeats_the_launch(document):
    arguments = {
        '--disc': ('disc', 'frisbee_low_damping'),
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
    found = document('--samples', 20, *arguments)
    launch = found['launch']
    first = {key: np.array(found[key][0]) for key in ARRAYS}
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
    found = document('--samples', rate, *arguments)
    arrays = {key: np.array(found[key]) for key in ARRAYS}
    through_air = arrays['velocity_m_s'] - found['launch']['wind_m_s']
    airspeed = np.linalg.norm(through_air, axis=1)
    assert_allclose(arrays['airspeed_m_s'], airspeed, rtol=0.0, atol=ROUNDING)
    # eqn 50; the arc cosine near 1 makes 1e-16 to 1e-8 rad.
    cosine = np.cos(np.radians(arrays['roll_deg'])) * np.cos(np.radians(arrays['pitch_deg']))
    tilt = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert_allclose(arrays['absolute_attitude_deg'], tilt, rtol=0.0, atol=3e-6)
    ratio = arrays['spin_rad_s'] * DIAMETER / (2 * airspeed)  # eqn 63
    assert_allclose(arrays['advance_ratio'], ratio, rtol=0.0, atol=ROUNDING)
    # Central differences: h^2 / 6 of the second derivative of the velocity, below 1e3 m/s^3.
    slope = (arrays['position_m'][2:] - arrays['position_m'][:-2]) * rate / 2
    assert_allclose(slope, arrays['velocity_m_s'][1:-1], rtol=0.0, atol=1e3 / rate**2 / 6)


@pytest.mark.parametrize('arguments', LAUNCHES.values(), ids=LAUNCHES)
def test_the_angle_of_attack_is_that_of_the_attitude(document, arguments):
    """The paper's eqn 17 through scipy's rotations; the yaw comes from the flight itself."""
    found = document('--samples', 50, *arguments)
    launch = found['launch']
    names = ('speed', 'pitch', 'roll', 'yaw', 'angle_of_attack', 'sideslip', 'spin', 'height')
    units = ('m_s', 'deg', 'deg', 'deg', 'deg', 'deg', 'rad_s', 'm')
    given = {name: launch[f'{name}_{unit}'] for name, unit in zip(names, units, strict=True)}
    rates = {name: launch[f'{name}_rad_s'] for name in ('roll_rate', 'pitch_rate')}
    wind = tuple(launch['wind_m_s'] * np.array([1.0, -1.0, -1.0]))
    setup = flight.Setup(disc=catalogue.load('frisbee'), wind=flight.Wind(mean=wind))
    flown = flight.fly(Launch(**given, **rates), setup, sample_rate=50.0)
    attitude = Rotation.from_quat(np.roll(flown.trajectory.attitude, -1, axis=1))
    through_air = (np.array(found['velocity_m_s']) - launch['wind_m_s']) * (1, -1, -1)
    u, v, w = attitude.inv().apply(through_air).T
    alpha = np.degrees(np.arctan2(w, np.hypot(u, v)))
    assert_allclose(found['alpha_deg'], alpha, rtol=0.0, atol=1e-7)  # scipy normalises again


@pytest.mark.parametrize('rate', [1, 7, 30, 333.3, 1000, 0.001, 3000])
def test_samples_are_timed_exactly(document, rate):
    found = document('--samples', rate)
    t = found['t_s']
    assert t == [k / rate for k in range(len(t))]
    # The landing is known to 1e-12 s, and a sample may fall on it.
    assert t[-1] <= found['flight_time_s'] + 1e-12
    assert len(t) / rate > found['flight_time_s'] - 1e-12


@pytest.mark.parametrize('rate', [0.001, 7, 100, 333.3, 3000])
@pytest.mark.parametrize('more', [(), ('--turbulence', 10)], ids=['still air', 'gusts'])
def test_samples_do_not_change_the_flight_by_a_bit(document, rate, more):
    found = document('--samples', rate, *more)
    assert {key: value for key, value in found.items() if key not in ARRAYS} == document(*more)


def test_samples_of_two_rates_agree_where_they_meet(document):
    slow, fast = document('--samples', 10), document('--samples', 70)
    for key in ARRAYS:
        # Seven times 1/70 is not 1/10 to the bit, and a shorter last step is other rounding.
        assert_allclose(slow[key], fast[key][::7], rtol=0.0, atol=ROUNDING, err_msg=key)


def test_a_flight_without_ground_goes_on_for_its_duration(document):
    found = document('--no-ground', '--duration', 5, '--samples', 10)
    assert (found['landed'], found['landing_position_m']) == (False, None)
    assert found['flight_time_s'] == 5.0
    assert found['t_s'][-1] == 5.0
    assert found['end_position_m'] == found['position_m'][-1]
    assert found['end_position_m'][2] < 0.0


def test_a_flight_that_is_cut_short_has_not_landed(document):
    found = document('--duration', 1)
    assert (found['landed'], found['landing_position_m']) == (False, None)
    assert found['flight_time_s'] == 1.0
    assert found['end_position_m'][2] > 0.0


def test_range_and_drift_are_those_of_the_landing(document):
    found = document('--yaw', 40)
    x, y, _ = found['landing_position_m']
    assert found['range_m'] == pytest.approx(math.hypot(x, y), abs=ROUNDING)
    yaw = math.radians(40)  # to the right, so towards -y
    left = x * math.sin(yaw) + y * math.cos(yaw)
    assert found['drift_m'] == pytest.approx(left, abs=ROUNDING)


def test_the_apex_is_not_below_any_sample(document):
    found = document('--samples', 2000)
    heights = np.array(found['position_m'])[:, 2]
    # Between two samples 0.5 ms apart the top rises by g t^2 / 2 at most.
    assert 0.0 <= found['apex_m'] - heights.max() < 9.81 * 0.0005**2 / 2


def test_without_airspeed_there_is_no_advance_ratio(document):
    found = document('--speed', 0, '--height', 5, '--samples', 10)
    assert found['advance_ratio'][0] is None
    assert found['advance_ratio'][1] > 0.0


# --- what the flags do


def test_air_that_is_not_there_leaves_a_parabola(document):
    found = document('--air-density', 0, '--gravity', 5, '--speed', 12, '--pitch', 30)
    sine, cosine = 0.5, math.sqrt(0.75)
    assert found['flight_time_s'] == pytest.approx(2 * 12 * sine / 5, abs=ROUNDING)
    assert found['range_m'] == pytest.approx(12 * cosine * 2 * 12 * sine / 5, abs=ROUNDING)
    assert found['apex_m'] == pytest.approx((12 * sine) ** 2 / (2 * 5), abs=ROUNDING)
    assert found['end_spin_rad_s'] == 31.416


def test_yaw_turns_the_whole_flight_to_the_right(document):
    straight, turned = document('--yaw', 0), document('--yaw', 90)
    x, y, _ = straight['landing_position_m']
    assert_allclose(turned['landing_position_m'], [y, -x, 0.0], rtol=0.0, atol=ROUNDING)
    assert turned['drift_m'] == pytest.approx(straight['drift_m'], abs=ROUNDING)


def test_the_other_spin_and_roll_fly_the_mirrored_flight(document):
    """Roll, yaw, sideslip and spin change sign in a mirror, and so do y and the roll rate."""
    sides = [
        document(
            '--roll', 10 * s, '--yaw', 5 * s, '--sideslip', 3 * s, '--spin', 40 * s,
            '--roll-rate', s, '--pitch-rate', 2, '--wind', 1, 2 * s, 0,
            '--control', 1e-3 * s, 2e-3, 1e-4 * s, '--disc', 'frisbee_roll_moment',
        )
        for s in (1, -1)
    ]  # fmt: skip
    x, y, _ = sides[0]['landing_position_m']
    assert abs(y) > 1.0
    assert_allclose(sides[1]['landing_position_m'], [x, -y, 0.0], rtol=0.0, atol=ROUNDING)
    assert sides[1]['end_spin_rad_s'] == pytest.approx(-sides[0]['end_spin_rad_s'], abs=ROUNDING)


def at(key: str, t: float) -> Callable[[dict], float]:
    """The sample of a quantity at a time; samples are 10 a second."""
    return lambda found: found[key][round(10 * t)]


def side(t: float) -> Callable[[dict], float]:
    """How far left the disc is at a time."""
    return lambda found: found['position_m'][round(10 * t)][1]


def key(name: str) -> Callable[[dict], float]:
    return lambda found: found[name]


@pytest.mark.parametrize(
    ('arguments', 'quantity', 'sign'),
    [
        pytest.param(('--speed', 20), key('range_m'), 1, id='a faster disc flies farther'),
        pytest.param(('--pitch', 25), key('apex_m'), 1, id='a steeper disc flies higher'),
        # Lift has a part to the side to which the disc leans.
        pytest.param(('--roll', 20), side(1), -1, id='right edge down goes right'),
        pytest.param(('--roll', -20), side(1), 1, id='left edge down goes left'),
        pytest.param(('--sideslip', 10), side(1), -1, id='velocity turned right goes right'),
        # The attitude stays, the velocity is lower.
        pytest.param(('--alpha', 10), at('pitch_deg', 0), 0, id='alpha keeps the attitude'),
        pytest.param(
            ('--alpha', 10), lambda f: f['velocity_m_s'][0][2], -1, id='alpha lowers the velocity'
        ),
        pytest.param(('--height', 5), key('flight_time_s'), 1, id='from higher it takes longer'),
        pytest.param(('--wind', 0, 3, 0), side(1), 1, id='wind to the left carries left'),
        # The airspeed falls, and with it the lift that holds the disc up.
        pytest.param(('--wind', 3, 0, 0), key('apex_m'), -1, id='a tailwind takes lift'),
        pytest.param(('--wind', 0, 0, -2), key('flight_time_s'), -1, id='a downdraught presses'),
        # eqns 53 and 54, clockwise from above: a moment to the right lifts the nose, a moment
        # that lifts the nose rolls to the left.
        pytest.param(('--control', 0.002, 0, 0), at('pitch_deg', 1), 1, id='C_L lifts the nose'),
        pytest.param(('--control', 0, 0.002, 0), at('roll_deg', 1), -1, id='C_M rolls left'),
        pytest.param(('--control', 0, 0, 0.002), key('end_spin_rad_s'), 1, id='C_N spins up'),
        pytest.param(('--gravity', 5), key('flight_time_s'), 1, id='half the gravity is longer'),
        pytest.param(('--air-density', 0.6), key('apex_m'), -1, id='thin air lifts less'),
        pytest.param(('--spin', 62.832), lambda f: abs(f['roll_deg'][20]), -1, id='spin steadies'),
        pytest.param(('--spin', 31.416), key('range_m'), 0, id='the default spin is the default'),
    ],
)
def test_flags_change_the_flight_as_they_should(document, arguments, quantity, sign):
    changed, default = document('--samples', 10, *arguments), document('--samples', 10)
    assert np.sign(round(quantity(changed) - quantity(default), 9)) == sign


def test_a_moment_that_lifts_the_nose_rolls_an_anticlockwise_disc_right(document):
    backwards = ('--spin', -31.416, '--samples', 10)
    rolled = at('roll_deg', 1)
    lifted = document('--control', 0, 0.002, 0, *backwards)
    assert rolled(lifted) > rolled(document(*backwards))


def test_rates_at_release_start_the_disc_turning(document):
    """p turns the roll, q the pitch, in the first millisecond before the spin mixes them."""
    for flag, key_, other in (
        ('--roll-rate', 'roll_deg', 'pitch_deg'),
        ('--pitch-rate', 'pitch_deg', 'roll_deg'),
    ):
        found = document(flag, 2, '--samples', 1000)
        turned = {key: found[key][1] - found[key][0] for key in (key_, other)}
        # 2 rad/s for 1 ms, of which the damping of 24 1/s takes 1.2 %, and of the other the
        # nutation of 63 rad/s: 2 * 63 * t^2 / 2.
        assert turned[key_] == pytest.approx(math.degrees(2e-3), rel=0.02)
        assert abs(turned[other]) < 2 * math.degrees(63e-6)


def test_the_spin_decays_but_where_the_model_keeps_it(document):
    ends = {m: document('--model', m)['end_spin_rad_s'] for m in flight.MODELS}
    assert 0.95 * 31.416 < ends['exact'] < 31.416
    assert ends['constant_spin'] == ends['precession'] == 31.416


def test_the_models_agree_roughly_and_differ(document):
    ranges = {document('--model', model)['range_m'] for model in flight.MODELS}
    assert len(ranges) == 3
    assert max(ranges) - min(ranges) < 0.5  # m; the paper's Fig. 9: they are hard to tell apart


def test_straight_lines_are_those_of_the_disc_with_straight_lines(document):
    lines, disc = document('--aero', 'linear'), document('--disc', 'frisbee_linear')
    assert lines['landing_position_m'] == disc['landing_position_m']
    assert lines['landing_position_m'] != document()['landing_position_m']


@pytest.mark.parametrize(
    'arguments',
    [
        ('--moment-axes', 'wind'),
        ('--disc', 'ultrastar'),
        ('--disc', 'frisbee_low_damping'),
        ('--disc', 'frisbee_roll_moment'),
        ('--turbulence', 5),
    ],
)
def test_what_flies_matters(document, arguments):
    moved = np.subtract(
        document(*arguments)['landing_position_m'], document()['landing_position_m']
    )
    assert np.linalg.norm(moved) > 1e-3  # m; a flag that is ignored moves nothing


def test_a_longer_step_is_another_flight_but_not_by_much(document):
    moved = np.subtract(
        document('--step', 4e-3)['landing_position_m'], document()['landing_position_m']
    )
    # The table has kinks, so that the order is lower than four; measured is 1e-5 m.
    assert 0.0 < np.linalg.norm(moved) < 1e-3


def test_gusts_depend_on_their_seed_alone(document):
    gusty = document('--turbulence', 10, '--seed', 1)
    assert gusty == document('--turbulence', 10, '--seed', 1)
    assert gusty['range_m'] != document('--turbulence', 10, '--seed', 2)['range_m']
    assert document('--seed', 1)['range_m'] == document('--seed', 2)['range_m']


def test_the_largest_seed_is_taken(document):
    assert document('--turbulence', 1, '--seed', 2**63 - 1)['landed']


@pytest.mark.parametrize('ratio', [0.5, -0.25, 0.0])
def test_the_advance_ratio_is_a_spin(document, ratio):
    found = document('--advance-ratio', ratio, '--speed', 12)
    spin = 2 * 12 * ratio / DIAMETER  # eqn 63
    assert found['launch']['spin_rad_s'] == pytest.approx(spin, rel=1e-15)
    same = document('--spin', repr(found['launch']['spin_rad_s']), '--speed', 12)
    assert found == same


def test_the_advance_ratio_takes_the_diameter_of_the_disc(document):
    found = document('--advance-ratio', 0.5, '--disc', 'wraith')
    assert found['launch']['spin_rad_s'] == pytest.approx(2 * 15 * 0.5 / 0.211, rel=1e-15)


def test_no_speed_takes_no_advance_ratio_but_zero(document):
    assert document('--speed', 0, '--advance-ratio', 0)['launch']['spin_rad_s'] == 0.0


def test_a_users_disc_flies(document, tmp_path):
    path = tmp_path / 'my disc.yaml'
    path.write_text('based_on: frisbee\nmass_kg: 1.75e-1\n', encoding='utf-8')
    found = document('--disc', path)
    assert found['launch'].pop('disc') == str(path)  # which finds it again
    default = document()
    default['launch'].pop('disc')
    assert found == default


@pytest.mark.parametrize(
    ('text', 'value'),
    [('-1e-3', -1e-3), ('-.5', -0.5), ('-1.', -1.0), ('-2E+0', -2.0), ('-0', 0.0), ('+1', 1.0)],
)
def test_negative_numbers_are_no_flags(document, text, value):
    launch = document('--control', text, text, text, '--wind', text, text, text)['launch']
    assert launch['control'] == [value] * 3
    assert launch['wind_m_s'] == [value] * 3
    assert document('--roll', text)['launch']['roll_deg'] == value
    assert document(f'--roll={text}')['launch']['roll_deg'] == value


def test_rates_that_the_precession_model_sets_itself_are_noted(fly):
    result = fly('--model', 'precession', '--roll-rate', 1, '--json')
    assert result.code == 0
    assert re.fullmatch(r'fly: note: --roll-rate [^\n]+\n', result.err)
    assert json.loads(result.out)['landed']


# --- the summary


def test_the_summary_tells_the_flight(fly, document):
    result, found = fly(), document()
    assert (result.code, result.err) == (0, '')
    lines = result.out.splitlines()
    assert 5 <= len(lines) <= 20
    assert max(map(len, lines)) < 100
    x, y, _ = found['landing_position_m']
    assert lines[0].startswith('frisbee: ')
    for part in (
        'exact',
        'table',
        '15 m/s',
        '31.416 rad/s, clockwise',
        f'landed  after {found["flight_time_s"]:.3f} s at x {x:.2f} m, y {y:.2f} m',
        f'range   {found["range_m"]:.2f} m, drift {-found["drift_m"]:.2f} m to the right',
        f'apex {found["apex_m"]:.2f} m',
        f'{found["end_spin_rad_s"] / 31.416:.1%} of the spin left',
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
def test_the_summary_tells_what_is_special(fly, arguments, part):
    assert part in fly(*arguments).out


def test_the_summary_holds_a_table_of_samples(fly, document):
    rows = fly('--samples', 2).out.splitlines()[-8:]
    found = document('--samples', 2)
    assert len(found['t_s']) == 8
    for row, t, (x, y, z) in zip(rows, found['t_s'], found['position_m'], strict=True):
        assert [float(cell) for cell in row.split()[:4]] == [
            pytest.approx(value, abs=0.6e-3) for value in (t, x, y, z)
        ]


def test_help_names_every_flag_its_unit_and_its_range(fly):
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
        ('--spin', 'RAD/S', 'from -1000 to 1000 rad/s'),
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


# --- what is refused

NUMBERS = {
    '--speed': (-1, 201, '0 to 200 m/s'),
    '--pitch': (-181, 180.5, '-180 to 180 degrees'),
    '--roll': (-181, 181, '-180 to 180 degrees'),
    '--yaw': (-361, 361, '-360 to 360 degrees'),
    '--alpha': (-181, 181, '-180 to 180 degrees'),
    '--sideslip': (-181, 181, '-180 to 180 degrees'),
    '--spin': (-1001, 1001, '-1000 to 1000 rad/s'),
    '--advance-ratio': (-101, 101, '-100 to 100'),
    '--roll-rate': (-1001, 1001, '-1000 to 1000 rad/s'),
    '--pitch-rate': (-1001, 1001, '-1000 to 1000 rad/s'),
    '--height': (-1001, 10001, '-1000 to 10000 m'),
    '--duration': (0, 3601, '3600 s'),
    '--step': (0, 0.11, '1e-06 to 0.1 s'),
    '--samples': (0, 10001, '0.001 to 10000'),
    '--turbulence': (-1, 51, '0 to 50 m/s'),
    '--air-density': (-1, 101, '0 to 100 kg/m^3'),
    '--gravity': (-1, 101, '0 to 100 m/s^2'),
}
# What is given and how it is shown.
NO_NUMBERS = {
    'nan': 'nan',
    '-nan': 'nan',
    'inf': 'inf',
    '-inf': '-inf',
    '-Infinity': '-inf',
    '1e400': 'inf',
    '-1e400': '-inf',
    'fast': "'fast'",
    '': "''",
    '1,5': "'1,5'",
    '15m/s': "'15m/s'",
    '1_5': "'1_5'",
    '0x10': "'0x10'",
    '[1]': "'[1]'",
    'fa\nst': r"'fa\nst'",
}


@pytest.mark.parametrize('flag', NUMBERS)
def test_numbers_out_of_range_are_refused(fly, flag):
    low, high, allowed = NUMBERS[flag]
    for value in (low, high):
        refused(fly(flag, value), f'{flag}: {value} ', allowed)
        refused(fly(f'{flag}={value}'), f'{flag}: {value} ', allowed)


@pytest.mark.parametrize('text', NO_NUMBERS)
@pytest.mark.parametrize('flag', NUMBERS)
def test_what_is_no_number_is_refused(fly, flag, text):
    refused(fly(flag, text), f'{flag}: {NO_NUMBERS[text]} ', NUMBERS[flag][2])


@pytest.mark.parametrize('flag', NUMBERS)
def test_a_missing_number_is_refused(fly, flag):
    allowed = NUMBERS[flag][2]
    refused(fly(flag), f'{flag}: expected one argument', allowed)
    refused(fly(flag, '--no-ground'), f'{flag}: expected one argument', allowed)


@pytest.mark.parametrize(
    ('flag', 'allowed'), [('--control', '-10 to 10'), ('--wind', '-100 to 100 m/s')]
)
@pytest.mark.parametrize('text', [*NO_NUMBERS, '101', '-101'])
@pytest.mark.parametrize('place', [0, 1, 2])
def test_three_numbers_are_each_checked(fly, flag, allowed, text, place):
    values = ['0', '-1e-3', '0.5']
    values[place] = text
    refused(fly(flag, *values), f'{flag}: {NO_NUMBERS.get(text, text)} ', allowed)


@pytest.mark.parametrize(
    ('flag', 'allowed'), [('--control', '-10 to 10'), ('--wind', '-100 to 100 m/s')]
)
@pytest.mark.parametrize('values', [(), ('1',), ('1', '-1e-3')])
def test_three_numbers_must_be_three(fly, flag, allowed, values):
    refused(fly(flag, *values), f'{flag}: expected 3 arguments', allowed)


@pytest.mark.parametrize('seed', ['-1', '1.5', '1e3', 'x', '', '²', 'nan', str(2**63)])
def test_a_seed_is_a_whole_number(fly, seed):
    refused(fly('--seed', seed), f'--seed: {seed!r} ', f'0 to {2**63 - 1}')


@pytest.mark.parametrize(
    ('flag', 'allowed'),
    [
        ('--model', ('exact', 'constant_spin', 'precession')),
        ('--aero', ('table', 'linear')),
        ('--moment-axes', ('body', 'wind')),
    ],
)
@pytest.mark.parametrize('word', ['', 'Exact', 'tabel', '1'])
def test_words_are_checked(fly, flag, allowed, word):
    refused(fly(flag, word), f'{flag}: ', repr(word), *allowed)


@pytest.mark.parametrize(
    ('arguments', 'fragments'),
    [
        (('--spe', '15'), ('--spe',)),
        (('--sped', '15'), ('--sped',)),
        (('--Speed', '15'), ('--Speed',)),
        (('-s', '15'), ('-s',)),
        (('15',), ('15',)),
        (('-1e-3',), ('-1e-3',)),
        (('--control', '1', '2', '3', '4'), ('4',)),
        (('--json=yes',), ('--json',)),
    ],
)
def test_unknown_flags_and_abbreviations_are_refused(fly, arguments, fragments):
    refused(fly(*arguments), *fragments)


@pytest.mark.parametrize(
    ('arguments', 'fragments'),
    [
        (('--spin', 1, '--advance-ratio', 1), ('--advance-ratio', '--spin')),
        (('--json', '--csv', 'x.csv'), ('--csv', '--json')),
        (('--json', '--plot', 'x.png'), ('--plot', '--json')),
        (('--csv', 'x.csv', '--plot', 'x.png'), ('--plot', '--csv')),
        (('--height', -1), ('--height: -1 ', '0 m', '--no-ground')),
        (('--aero', 'linear', '--disc', 'wraith'), ('--aero: ', "'linear'", 'wraith')),
        (('--aero', 'table', '--disc', 'flat_plate'), ('--aero: ', "'table'", 'flat_plate')),
        # RK4 is stable up to 2.78 on the imaginary axis; the nutation is twice the spin.
        (('--step', 0.1, '--spin', 500), ('--step: 0.1 ', '500 rad/s', '0.00278 s')),
        (('--step', 0.1, '--spin', -500), ('--step: 0.1 ', '-500 rad/s', '0.00278 s')),
        (('--step', 0.1, '--advance-ratio', 4), ('--step: 0.1 ', 'rad/s')),
        (('--speed', 0, '--advance-ratio', 1), ('--advance-ratio: 1 ', '--speed 0', '--spin')),
        (('--advance-ratio', 50), ('--advance-ratio', '1000 rad/s')),
        (('--samples', 1e4, '--duration', 3600), ('--samples: 10000 ', '5000000')),
        (('--disc', 'frisbe'), ('--disc: ', "'frisbe'", 'did you mean frisbee?', 'wraith')),
        (('--disc', ''), ('--disc: ', "''", 'frisbee')),
        (('--disc', 'nowhere.yaml'), ('--disc: ', "'nowhere.yaml'", 'No such file')),
        (('--plot', 'x.jpg'), ('--plot: ', "'x.jpg'", '.png, .svg or .pdf')),
        (('--plot', 'png'), ('--plot: ', "'png'", '.png, .svg or .pdf')),
        (('--plot', '.png'), ('--plot: ', "'.png'", '.png, .svg or .pdf')),
        (('--plot', ''), ('--plot: ', "''", '.png, .svg or .pdf')),
        (('--csv', ''), ('--csv: ', "''", 'name of a file')),
        (('--csv',), ('--csv: ', 'expected one argument')),
    ],
)
def test_contradictions_are_refused(fly, monkeypatch, tmp_path, arguments, fragments):
    monkeypatch.chdir(tmp_path)
    refused(fly(*arguments), *fragments)
    assert list(tmp_path.iterdir()) == []


def test_a_bad_disc_file_is_refused_in_one_line(fly, tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text('based_on: frisbee\nmas_kg: 1\n', encoding='utf-8')
    refused(fly('--disc', path), 'mine.yaml', "'mas_kg'", 'did you mean mass_kg?')


def test_what_is_refused_is_refused_before_the_compiler_speaks(fly, monkeypatch):
    monkeypatch.setattr(flight, 'is_ready', lambda: False)
    refused(fly('--height', -1), '--height')
    refused(fly('--step', 0.1, '--spin', 500), '--step')
    refused(fly('--aero', 'linear', '--disc', 'wraith'), '--aero')
    refused(fly('--model', 'precession', '--roll-rate', 1, '--height', -1), '--height')


def test_the_compiler_speaks_on_stderr(fly, monkeypatch):
    monkeypatch.setattr(flight, 'is_ready', lambda: False)
    result = fly('--json')
    assert json.loads(result.out)['landed']
    assert re.fullmatch(r'fly: note: compiling [^\n]+\n', result.err)


def test_a_flight_that_leaves_the_numbers_ends_with_code_1(fly):
    result = fly('--speed', 200, '--control', 10, 10, 10, '--air-density', 2)
    assert (result.code, result.out) == (1, '')
    assert re.fullmatch(r'fly: error: [^\n]*shorter step[^\n]*\n', result.err)


# --- files


def table_of(path: Path) -> tuple[list[str], list[list[float | None]]]:
    head, *rows = path.read_text(encoding='utf-8').splitlines()
    parsed = [[float(cell) if cell else None for cell in row.split(',')] for row in rows]
    return head.split(','), parsed


@pytest.mark.parametrize(
    'arguments',
    [('--samples', 50), ('--samples', 7.7, '--speed', 0, '--height', 3)],
    ids=['numbers', 'no advance ratio at first'],
)
def test_the_csv_holds_the_numbers_of_the_document(fly, document, tmp_path, arguments):
    path = tmp_path / 'flight.csv'
    result = fly('--csv', path, *arguments)
    assert (result.code, result.err) == (0, '')
    head, rows = table_of(path)
    found = document(*arguments)
    columns = {}
    for name, shape in ARRAYS.items():
        if shape:
            quantity, unit = name.split('_', 1)
            for i, axis in enumerate('xyz'):
                columns[f'{quantity}_{axis}_{unit}'] = [row[i] for row in found[name]]
        else:
            columns[name] = found[name]
    assert head == list(columns)
    assert rows == [list(row) for row in zip(*columns.values(), strict=True)]
    assert f'{path}, {len(rows)} rows' in result.out


def test_files_are_sampled_without_being_asked(fly, tmp_path):
    fly('--csv', tmp_path / 'x.csv')
    _, rows = table_of(tmp_path / 'x.csv')
    assert [row[0] for row in rows] == [k / 100 for k in range(len(rows))]


@pytest.mark.parametrize('name', ['plot.png', 'PLOT.PNG', 'a.b c.png'])
def test_a_png_opens(fly, tmp_path, name):
    result = fly('--plot', tmp_path / name)
    assert (result.code, result.err) == (0, '')
    assert str(tmp_path / name) in result.out
    with (tmp_path / name).open('rb') as file:
        pixels = image.imread(file, format='png')
    assert pixels.shape[:2] == (9 * 120, 11 * 120)
    assert pixels[..., :3].std() > 0.05  # something is drawn


def test_an_svg_is_xml(fly, tmp_path):
    fly('--plot', tmp_path / 'x.svg')
    assert ET.parse(tmp_path / 'x.svg').getroot().tag == '{http://www.w3.org/2000/svg}svg'


def test_a_pdf_is_one(fly, tmp_path):
    fly('--plot', tmp_path / 'x.pdf')
    content = (tmp_path / 'x.pdf').read_bytes()
    assert content.startswith(b'%PDF-')
    assert content.rstrip().endswith(b'%%EOF')


@pytest.mark.parametrize(
    'arguments',
    [
        ('--speed', 0),
        ('--speed', 0, '--spin', 0, '--gravity', 0, '--duration', 1),
        ('--samples', 0.001),
        ('--no-ground', '--duration', 10),
        ('--pitch', 90, '--roll', 180),
    ],
    ids=['lands at once', 'stays where it is', 'one sample', 'underground', 'straight up'],
)
def test_odd_flights_can_be_drawn(fly, tmp_path, arguments):
    result = fly('--plot', tmp_path / 'x.png', *arguments)
    assert (result.code, result.err) == (0, '')
    assert (tmp_path / 'x.png').stat().st_size > 10_000


@pytest.mark.parametrize('name', ['$\\frac$', '飛盤', os.fsdecode(b'x\xff'), '100 % & <b>_^{'])
def test_discs_of_odd_names_can_be_drawn(fly, tmp_path, name):
    """A dollar is mathematics for matplotlib, and not every script is in its font."""
    path = tmp_path / f'{name}.yaml'
    path.write_text('based_on: frisbee\n', encoding='utf-8')
    assert fly('--disc', path, '--plot', tmp_path / 'x.png').code == 0
    assert fly('--disc', path, '--plot', tmp_path / 'x.svg').code == 0


@pytest.fixture(params=['--csv', '--plot'])
def write(request) -> Callable[..., tuple[object, ...]]:
    """The arguments that write a file, in both ways."""
    return lambda path, *more: (request.param, path, '--samples', 10, *more)


@pytest.fixture
def old(tmp_path) -> Path:
    """A file that is there already; .png, so that both ways may write it."""
    path = tmp_path / 'flight.png'
    path.write_bytes(b'precious')
    return path


def test_an_older_file_is_replaced_and_keeps_its_permissions(fly, write, old):
    old.chmod(0o640)
    assert fly(*write(old)).code == 0
    assert old.read_bytes() != b'precious'
    assert old.stat().st_mode & 0o777 == 0o640
    assert list(old.parent.iterdir()) == [old]


def test_a_new_file_has_the_permissions_of_any_new_file(fly, write, tmp_path):
    (tmp_path / 'other').touch()
    assert fly(*write(tmp_path / 'new.png')).code == 0
    assert (tmp_path / 'new.png').stat().st_mode == (tmp_path / 'other').stat().st_mode


def test_a_linked_file_is_replaced_and_the_link_stays(fly, write, old, tmp_path):
    folder = tmp_path / 'links'
    folder.mkdir()
    (folder / 'link.png').symlink_to('../flight.png')
    assert fly(*write(folder / 'link.png')).code == 0
    assert (folder / 'link.png').is_symlink()
    assert old.read_bytes() != b'precious'
    assert len(list(folder.iterdir())) == 1


def test_a_link_to_a_file_to_come_makes_the_file(fly, write, tmp_path):
    (tmp_path / 'link.png').symlink_to('real.png')
    assert fly(*write(tmp_path / 'link.png')).code == 0
    assert (tmp_path / 'link.png').is_symlink()
    assert (tmp_path / 'real.png').stat().st_size > 100


def test_a_relative_name_in_a_folder_with_spaces(fly, write, tmp_path, monkeypatch):
    folder = tmp_path / 'a folder'
    folder.mkdir()
    monkeypatch.chdir(folder)
    assert fly(*write('a flight.png')).code == 0
    assert [path.name for path in folder.iterdir()] == ['a flight.png']


def test_what_cannot_be_written_is_refused_before_the_flight(fly, write, tmp_path, monkeypatch):
    monkeypatch.setattr(flight, 'fly', lambda *_, **__: pytest.fail('it flew'))
    (tmp_path / 'file').touch()
    (tmp_path / 'folder.png').mkdir()
    (tmp_path / 'circle.png').symlink_to('circle.png')
    for path, reason in (
        ('missing/x.png', 'missing does not exist'),
        ('file/x.png', 'file does not exist'),
        ('folder.png', 'this is a folder'),
        ('circle.png', 'circle'),
        ('x' * 300 + '.png', 'too long'),
    ):
        result = fly(*write(tmp_path / path))
        refused(result, f'{write("")[0]}: ', reason)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {'file', 'folder.png', 'circle.png'}


def test_a_closed_folder_and_a_closed_file_are_refused(fly, write, old, tmp_path):
    closed = tmp_path / 'closed'
    closed.mkdir()
    closed.chmod(0o555)
    old.chmod(0o444)
    if os.access(closed, os.W_OK):
        pytest.skip('this user may write everything')
    refused(fly(*write(closed / 'x.png')), 'no permission', str(closed))
    refused(fly(*write(old)), 'no permission', str(old))
    assert old.read_bytes() == b'precious'


def test_a_full_device_is_refused(fly):
    refused(fly('--csv', '/dev/full'), '--csv', "'/dev/full'", 'No space left')


@pytest.fixture
def full_disk(tmp_path) -> Iterator[Path]:
    """A folder on a file system that takes 16 kB."""
    folder = tmp_path / 'disk'
    folder.mkdir()
    command = ['mount', '-t', 'tmpfs', '-o', 'size=16k', 'none', str(folder)]
    if os.geteuid() != 0 or subprocess.run(command, check=False, capture_output=True).returncode:
        pytest.skip('mounting is not allowed')
    yield folder
    subprocess.run(['umount', str(folder)], check=True)


def test_a_full_disk_leaves_the_older_file_and_nothing_else(fly, write, full_disk):
    old = full_disk / 'flight.png'
    old.write_bytes(b'precious')
    refused(fly(*write(old), '--samples', 500), 'No space left', 'flight.png')
    assert old.read_bytes() == b'precious'
    assert list(full_disk.iterdir()) == [old]


@pytest.mark.parametrize(
    'failure', [OSError(errno.ENOSPC, 'No space left on device'), KeyboardInterrupt()]
)
def test_a_write_that_fails_half_way_leaves_the_older_file(fly, write, old, monkeypatch, failure):
    def fail(_: int) -> None:
        assert len(list(old.parent.iterdir())) == 2  # the older and the half-written new one
        raise failure

    monkeypatch.setattr(os, 'fsync', fail)
    result = fly(*write(old))
    if isinstance(failure, OSError):
        refused(result, 'No space left', 'flight.png')
    else:
        assert result == Result(130, '', '')
    assert old.read_bytes() == b'precious'
    assert list(old.parent.iterdir()) == [old]


def test_a_killed_program_leaves_the_older_file(old):
    script = (
        'import os, sys\n'
        'from disc_sim_ros.cli import output\n'
        'os.fsync = lambda _: os.kill(os.getpid(), 9)\n'
        'output.write_whole("--csv", sys.argv[1], b"new" * 10_000)\n'
    )
    ended = subprocess.run([sys.executable, '-c', script, str(old)], check=False)
    assert ended.returncode == -signal.SIGKILL
    assert old.read_bytes() == b'precious'


def test_what_a_killed_program_left_is_in_nobodys_way(old, monkeypatch):
    """In a container every run may have the same process id."""
    monkeypatch.setattr(os, 'fsync', lambda _: (_ for _ in ()).throw(OSError(5, 'broken')))
    monkeypatch.setattr(Path, 'unlink', lambda *_, **__: None)
    for _ in range(2):
        with pytest.raises(DiscSimError, match='broken'):
            output.write_whole('--csv', str(old), b'new')
    monkeypatch.undo()
    assert len(list(old.parent.iterdir())) == 3
    output.write_whole('--csv', str(old), b'new')
    assert old.read_bytes() == b'new'


def test_the_longest_name_that_a_file_may_have_can_be_written(tmp_path):
    path = tmp_path / ('x' * 251 + '.csv')
    output.write_whole('--csv', str(path), b'new')
    assert path.read_bytes() == b'new'


@pytest.mark.timeout(60)  # a pipe that is opened in the wrong order waits for ever
def test_a_named_pipe_takes_a_csv(fly, tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    received = []
    reader = threading.Thread(target=lambda: received.append((tmp_path / 'pipe').read_bytes()))
    reader.start()
    assert fly('--csv', tmp_path / 'pipe').code == 0
    reader.join()
    fly('--csv', tmp_path / 'x.csv')
    assert received == [(tmp_path / 'x.csv').read_bytes()]
    assert (tmp_path / 'pipe').is_fifo()


# --- how it ends


def test_ctrl_c_ends_a_flight_at_once(fly, monkeypatch):
    """Compiled code looks for no signals, so that the system must end the program."""
    seen = []
    real = flight.fly

    def watched(*arguments: object, **options: object) -> flight.Flight:
        seen.append(signal.getsignal(signal.SIGINT))
        return real(*arguments, **options)

    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr(flight, 'fly', watched)
    assert fly().code == 0
    assert seen == [signal.SIG_DFL]
    assert signal.getsignal(signal.SIGINT) is before


def test_ctrl_c_elsewhere_leaves_no_traceback(fly, monkeypatch):
    def interrupted(_: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(catalogue, 'load', interrupted)
    assert fly() == Result(130, '', '')


def test_it_runs_in_any_thread(fly):
    codes = []
    thread = threading.Thread(target=lambda: codes.append(program.main(['--json'])))
    thread.start()
    thread.join()
    assert codes == [0]


def test_a_reader_who_has_enough_is_no_error():
    with subprocess.Popen(
        [EXECUTABLE, '--json', '--samples', '2000'],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as running:
        assert running.stdout.read(1) == b'{'
        running.stdout.close()  # as `head -c 1` does; more is written than a pipe holds
        err = running.stderr.read()
    assert b'Traceback' not in err
    assert b'rror' not in err
    assert running.returncode == 141  # as a shell says of SIGPIPE


def test_a_full_stdout_is_an_error_of_one_line():
    with Path('/dev/full').open('w', encoding='utf-8') as full:
        ended = start('--json', stdout=full, env=environment(NUMBA_DISABLE_JIT='1'))
    assert ended.returncode == 1
    assert re.fullmatch(r'fly: error: [^\n]*stdout[^\n]*No space left[^\n]*\n', ended.stderr)


def test_it_runs_with_nothing_open_and_a_poor_environment(tmp_path):
    """No stdin, stdout or stderr; no HOME, ASCII only; spaces and umlauts in every name."""
    folder = tmp_path / 'a folder'
    folder.mkdir()
    (folder / 'Schüssel 1.yaml').write_text(
        'based_on: frisbee\ndescription: Schüssel\n', encoding='utf-8'
    )
    bare = {
        'PATH': os.environ['PATH'],
        'LANG': 'C',
        'LC_ALL': 'C',
        'PYTHONIOENCODING': 'ascii',
        'NUMBA_DISABLE_JIT': '1',
    }
    arguments = ('--step', '0.01', '--disc', 'Schüssel 1.yaml', '--csv', 'wür fe.csv')
    closed = ['sh', '-c', 'exec "$0" "$@" <&- >&- 2>&-', str(EXECUTABLE), *arguments]
    ended = subprocess.run(closed, cwd=folder, env=bare, check=False, timeout=120)
    assert ended.returncode == 0
    head, rows = table_of(folder / 'wür fe.csv')
    assert head[0] == 't_s'
    assert len(rows) > 300
    # And with stdout open, what it cannot print in ASCII it escapes.
    shown = start(*arguments, cwd=folder, env=bare, stdin=subprocess.DEVNULL)
    assert (shown.returncode, shown.stderr) == (0, '')
    assert 'Sch\\xfcssel 1: Sch\\xfcssel' in shown.stdout


def test_plain_python_flies_the_compiled_flight(document):
    arguments = ('--step', '0.01', '--turbulence', '5', '--disc', 'frisbee_roll_moment')
    ended = start('--json', *arguments, env=environment(NUMBA_DISABLE_JIT='1'))
    assert (ended.returncode, ended.stderr) == (0, '')
    plain, compiled = json.loads(ended.stdout), document(*arguments)
    assert plain['launch'] == compiled['launch']
    # The compiler may fuse and reorder; 400 steps of 1e-16 each.
    for name in ('landing_position_m', 'flight_time_s', 'apex_m', 'end_spin_rad_s'):
        assert_allclose(plain[name], compiled[name], rtol=0.0, atol=1e-9)
