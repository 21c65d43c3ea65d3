"""`fly`: the effect of each flag on the flight."""

from collections.abc import Callable
import json
import math
import re

import numpy as np
from numpy.testing import assert_allclose
import pytest

from cli.fly_command import DIAMETER, ROUNDING
from disc_sim_ros.physics import flight

pytestmark = pytest.mark.usefixtures('compiled')


def test_without_air_the_flight_is_a_parabola(document):
    flown = document('--air-density', 0, '--gravity', 5, '--speed', 12, '--pitch', 30)
    sine, cosine = 0.5, math.sqrt(0.75)
    assert flown['flight_time_s'] == pytest.approx(2 * 12 * sine / 5, abs=ROUNDING)
    assert flown['range_m'] == pytest.approx(12 * cosine * 2 * 12 * sine / 5, abs=ROUNDING)
    assert flown['apex_m'] == pytest.approx((12 * sine) ** 2 / (2 * 5), abs=ROUNDING)
    assert flown['end_spin_rad_s'] == 31.416


def test_yaw_turns_the_whole_flight_to_the_right(document):
    # In given steps: those of error control follow the last bits of their errors, which a turn
    # changes.
    straight, turned = (document('--yaw', yaw, '--step', 0.001) for yaw in (0, 90))
    x, y, _ = straight['landing_position_m']
    assert_allclose(turned['landing_position_m'], [y, -x, 0.0], rtol=0.0, atol=ROUNDING)
    assert turned['drift_m'] == pytest.approx(straight['drift_m'], abs=ROUNDING)


def test_the_mirrored_throw_flies_the_mirrored_flight(document):
    """In a mirror, roll, yaw, sideslip, spin, y and the roll rate change sign."""
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
    """Return a function that reads a quantity at a time; there are 10 samples a second."""
    return lambda flight: flight[key][round(10 * t)]


def side(t: float) -> Callable[[dict], float]:
    """Return a function that reads how far left the disc is at a time."""
    return lambda flight: flight['position_m'][round(10 * t)][1]


def key(name: str) -> Callable[[dict], float]:
    return lambda flight: flight[name]


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
def test_each_flag_changes_the_flight_in_the_right_direction(document, arguments, quantity, sign):
    changed, default = document('--samples', 10, *arguments), document('--samples', 10)
    assert np.sign(round(quantity(changed) - quantity(default), 9)) == sign


def test_a_moment_that_lifts_the_nose_rolls_an_anticlockwise_disc_right(document):
    backwards = ('--spin', -31.416, '--samples', 10)
    rolled = at('roll_deg', 1)
    lifted = document('--control', 0, 0.002, 0, *backwards)
    assert rolled(lifted) > rolled(document(*backwards))


def test_rates_at_release_start_the_disc_turning(document):
    """In the first millisecond p changes the roll and q the pitch; later the spin mixes them."""
    for flag, key_, other in (
        ('--roll-rate', 'roll_deg', 'pitch_deg'),
        ('--pitch-rate', 'pitch_deg', 'roll_deg'),
    ):
        flown = document(flag, 2, '--samples', 1000)
        turned = {key: flown[key][1] - flown[key][0] for key in (key_, other)}
        # 2 rad/s for 1 ms, of which the damping of 24 1/s takes 1.2 %, and of the other the
        # nutation of 63 rad/s: 2 * 63 * t^2 / 2.
        assert turned[key_] == pytest.approx(math.degrees(2e-3), rel=0.02)
        assert abs(turned[other]) < 2 * math.degrees(63e-6)


def test_the_spin_decays_except_in_the_models_that_keep_it(document):
    ends = {m: document('--model', m)['end_spin_rad_s'] for m in flight.MODELS}
    assert 0.95 * 31.416 < ends['exact'] < 31.416
    assert ends['constant_spin'] == ends['precession'] == 31.416


def test_the_models_agree_roughly_and_differ(document):
    ranges = {document('--model', model)['range_m'] for model in flight.MODELS}
    assert len(ranges) == 3
    assert max(ranges) - min(ranges) < 0.5  # m; the paper's Fig. 9: they are hard to tell apart


def test_aero_linear_flies_as_the_linear_disc(document):
    lines, disc = document('--aero', 'linear'), document('--disc', 'frisbee_linear')
    assert lines['landing_position_m'] == disc['landing_position_m']
    assert lines['landing_position_m'] != document()['landing_position_m']


@pytest.mark.parametrize(
    'arguments',
    [
        ('--moment-axes', 'wind'),
        ('--disc', 'ultrastar'),
        ('--disc', 'frisbee_as_printed'),
        ('--disc', 'frisbee_roll_moment'),
        ('--turbulence', 5),
    ],
)
def test_each_choice_of_disc_axes_and_gusts_moves_the_landing(document, arguments):
    moved = np.subtract(
        document(*arguments)['landing_position_m'], document()['landing_position_m']
    )
    assert np.linalg.norm(moved) > 1e-3  # m; an ignored flag would not move it


def test_a_longer_step_moves_the_landing_slightly(document):
    moved = np.subtract(
        document('--step', 4e-3)['landing_position_m'], document()['landing_position_m']
    )
    # The table has kinks, so that the order is lower than four; measured is 1e-5 m.
    assert 0.0 < np.linalg.norm(moved) < 1e-3


def test_gusts_depend_only_on_their_seed(document):
    gusty = document('--turbulence', 10, '--seed', 1)
    assert gusty == document('--turbulence', 10, '--seed', 1)
    assert gusty['range_m'] != document('--turbulence', 10, '--seed', 2)['range_m']
    assert document('--seed', 1)['range_m'] == document('--seed', 2)['range_m']


def test_the_largest_seed_is_accepted(document):
    assert document('--turbulence', 1, '--seed', 2**63 - 1)['landed']


@pytest.mark.parametrize('ratio', [0.5, -0.25, 0.0])
def test_the_advance_ratio_gives_the_spin(document, ratio):
    flown = document('--advance-ratio', ratio, '--speed', 12)
    spin = 2 * 12 * ratio / DIAMETER  # eqn 63
    assert flown['launch']['spin_rad_s'] == pytest.approx(spin, rel=1e-15)
    same = document('--spin', repr(flown['launch']['spin_rad_s']), '--speed', 12)
    assert flown == same


def test_the_advance_ratio_uses_the_diameter_of_the_disc(document):
    flown = document('--advance-ratio', 0.5, '--disc', 'wraith')
    assert flown['launch']['spin_rad_s'] == pytest.approx(2 * 15 * 0.5 / 0.211, rel=1e-15)


def test_at_speed_0_only_the_advance_ratio_0_is_accepted(document):
    assert document('--speed', 0, '--advance-ratio', 0)['launch']['spin_rad_s'] == 0.0


def test_a_disc_file_of_the_user_flies(document, tmp_path):
    path = tmp_path / 'my disc.yaml'
    path.write_text('based_on: frisbee\nmass_kg: 1.75e-1\n', encoding='utf-8')
    answer = document('--disc', path)
    assert answer['launch'].pop('disc') == str(path)  # so that it can be flown again
    default = document()
    default['launch'].pop('disc')
    assert answer == default


@pytest.mark.parametrize(
    ('text', 'value'),
    [('-1e-3', -1e-3), ('-.5', -0.5), ('-1.', -1.0), ('-2E+0', -2.0), ('-0', 0.0), ('+1', 1.0)],
)
def test_negative_numbers_are_not_read_as_flags(document, text, value):
    launch = document('--control', text, text, text, '--wind', text, text, text)['launch']
    assert launch['control'] == [value] * 3
    assert launch['wind_m_s'] == [value] * 3
    assert document('--roll', text)['launch']['roll_deg'] == value
    assert document(f'--roll={text}')['launch']['roll_deg'] == value


def test_a_note_says_that_the_precession_model_ignores_the_rates_at_release(fly):
    result = fly('--model', 'precession', '--roll-rate', 1, '--json')
    assert result.code == 0
    assert re.fullmatch(r'fly: note: --roll-rate [^\n]+\n', result.err)
    assert json.loads(result.out)['landed']
