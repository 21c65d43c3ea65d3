"""`fly` refuses bad input in one line that names the flag and what is allowed."""

import json
import re

import pytest

from cli.fly_command import refused
from disc_sim_ros.physics.kernels import jit

pytestmark = pytest.mark.usefixtures('compiled')


NUMBERS = {
    '--speed': (-1, 201, '0 to 200 m/s'),
    '--pitch': (-181, 180.5, '-180 to 180 degrees'),
    '--roll': (-181, 181, '-180 to 180 degrees'),
    '--yaw': (-361, 361, '-360 to 360 degrees'),
    '--alpha': (-181, 181, '-180 to 180 degrees'),
    '--sideslip': (-181, 181, '-180 to 180 degrees'),
    '--spin': (-1301, 1301, '-1300 to 1300 rad/s'),
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
# The given text, and how the message shows it.
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
    '15furlongs': "'15furlongs'",
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
def test_text_that_is_not_a_number_is_refused(fly, flag, text):
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
def test_each_of_three_numbers_is_checked(fly, flag, allowed, text, place):
    values = ['0', '-1e-3', '0.5']
    values[place] = text
    refused(fly(flag, *values), f'{flag}: {NO_NUMBERS.get(text, text)} ', allowed)


@pytest.mark.parametrize(
    ('flag', 'allowed'), [('--control', '-10 to 10'), ('--wind', '-100 to 100 m/s')]
)
@pytest.mark.parametrize('values', [(), ('1',), ('1', '-1e-3')])
def test_fewer_than_three_numbers_are_refused(fly, flag, allowed, values):
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
        (('--advance-ratio', 50), ('--advance-ratio', '1300 rad/s')),
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


def test_bad_input_is_refused_before_the_note_about_compilation(fly, monkeypatch):
    monkeypatch.setattr(jit, 'is_compiled', lambda _: False)
    refused(fly('--height', -1), '--height')
    refused(fly('--step', 0.1, '--spin', 500), '--step')
    refused(fly('--aero', 'linear', '--disc', 'wraith'), '--aero')
    refused(fly('--model', 'precession', '--roll-rate', 1, '--height', -1), '--height')


def test_the_note_about_compilation_goes_to_stderr(fly, monkeypatch):
    monkeypatch.setattr(jit, 'is_compiled', lambda _: False)
    result = fly('--json')
    assert json.loads(result.out)['landed']
    assert re.fullmatch(r'fly: note: compiling [^\n]+\n', result.err)


def test_a_flight_that_the_step_cannot_follow_ends_with_code_1(fly):
    result = fly('--speed', 200, '--control', 10, 10, 10, '--air-density', 2)
    assert (result.code, result.out) == (1, '')
    assert re.fullmatch(r'fly: error: [^\n]*shorter step[^\n]*\n', result.err)
