"""`fly` in a thrower's words: units, kinds of throws, several discs, throws of a TechDisc."""

import json
import math

from matplotlib import image
import pytest

from disc_sim_ros.cli import fly as fly_command
from disc_sim_ros.units import UNITS, split

TECHDISC = """throwTime,speedMph,spinRpm,launchAngle,noseAngle,hyzerAngle,wobbleAngle,throwType
1,60,1080,9.5,-0.5,12.0,0,backhand
2,55.0,900,8,1.5,-3,4,FOREHAND
"""


@pytest.fixture
def fly(capsys):
    """Run `fly` in this process: exit code, stdout, stderr."""

    def run(*arguments):
        try:
            code = fly_command.main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = end.code
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def document(fly):
    def run(*arguments):
        code, out, err = fly(*arguments, '--json')
        assert (code, err) == (0, '')
        return json.loads(out)

    return run


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / 'throws.csv'
        path.write_text(text, encoding='utf-8')
        return path

    return write


# ---- units ----


@pytest.mark.parametrize(
    ('flag', 'text', 'key', 'value'),
    [
        ('--speed', '60mph', 'speed_m_s', 26.8224),
        ('--speed', '90 km/h', 'speed_m_s', 25.0),
        ('--speed', '40kn', 'speed_m_s', 20.577777777777776),
        ('--spin', '1200rpm', 'spin_rad_s', 40 * math.pi),
        ('--spin', '-20rev/s', 'spin_rad_s', -40 * math.pi),
        ('--height', '5ft', 'height_m', 1.524),
        ('--height', '1e2cm', 'height_m', 1.0),
        ('--pitch', '10deg', 'pitch_deg', 10.0),
        ('--speed', '15', 'speed_m_s', 15.0),
    ],
)
def test_a_number_takes_a_unit(document, flag, text, key, value):
    assert document(flag, text)['launch'][key] == pytest.approx(value, rel=1e-15)


def test_each_component_of_a_vector_takes_a_unit(document):
    wind = document('--wind', '10mph', '-5mph', '1')['launch']['wind_m_s']
    assert wind == pytest.approx([4.4704, -2.2352, 1.0], rel=1e-15)


@pytest.mark.parametrize(
    ('arguments', 'fragments'),
    [
        (('--speed', '60mpg'), ["--speed: '60mpg'", 'from 0 to 200 m/s', 'mph']),
        (('--speed', '600mph'), ['--speed: 268.224', 'from 0 to 200 m/s']),
        (('--pitch', '5mph'), ["--pitch: '5mph'", 'deg']),
        (('--turbulence', 'mph'), ["--turbulence: 'mph'"]),
        (('--advance-ratio', '1rpm'), ["--advance-ratio: '1rpm'", '-100 to 100']),
    ],
)
def test_a_unit_that_does_not_fit_is_refused(fly, arguments, fragments):
    code, out, err = fly(*arguments)
    assert (code, out, err.count('\n')) == (2, '', 1)
    assert all(fragment in err for fragment in fragments), err


def test_numbers_are_split_from_units():
    assert split('-1.5e-3 m') == ('-1.5e-3', 'm')
    assert split('inf') == ('inf', '')
    assert split('') == ('', '')
    for unit, others in UNITS.items():
        assert 1.0 in others.values(), unit


# ---- a release ----


def test_the_kind_of_throw_gives_the_sense_of_the_spin(document):
    for throw, sign in (('rhbh', 1), ('lhfh', 1), ('rhfh', -1), ('lhbh', -1)):
        assert document('--throw', throw)['launch']['spin_rad_s'] == sign * 31.416
        ratio = document('--throw', throw, '--advance-ratio', 0.5)['launch']['spin_rad_s']
        assert math.copysign(1.0, ratio) == sign


def test_hyzer_flies_to_the_other_side_for_the_other_hand(document):
    words = ('--launch-angle', 10, '--nose', 1, '--hyzer', 15, '--speed', '50mph')
    right, left = (document(*words, '--throw', throw) for throw in ('rhbh', 'lhbh'))
    assert right['range_m'] == pytest.approx(left['range_m'], abs=1e-9)
    assert right['drift_m'] == pytest.approx(-left['drift_m'], abs=1e-9)
    assert right['launch']['roll_deg'] < 0.0 < left['launch']['roll_deg']


def test_nose_alone_keeps_the_attitude(document):
    """The pitch is that of the disc, so the velocity is lower by the nose angle."""
    assert document('--pitch', 12, '--nose', 3) == document('--pitch', 12, '--alpha', 3)
    flat = document('--launch-angle', 9, '--nose', 3)['launch']
    assert (flat['pitch_deg'], flat['angle_of_attack_deg']) == (12.0, 3.0)


def test_altitude_and_temperature_give_the_density(document):
    sea = document('--altitude', 0)['launch']['air_density_kg_m3']
    assert sea == pytest.approx(1.225, abs=5e-5)
    denver = document('--altitude', '5280ft', '--temperature', 25)['launch']
    assert denver['air_density_kg_m3'] == pytest.approx(0.976, abs=0.002)  # the gas law


@pytest.mark.parametrize(
    ('arguments', 'fragments'),
    [
        (('--hyzer', 5, '--roll', 5), ['--hyzer: 5', '--roll']),
        (('--nose', 1, '--alpha', 2), ['--nose: 1', '--alpha']),
        (('--launch-angle', 5, '--pitch', 5), ['--launch-angle: 5', '--pitch']),
        (('--throw', 'rhbh', '--spin', -30), ['--throw', 'no minus']),
        (('--throw', 'hammer'), ['--throw', 'rhbh']),
        (('--altitude', 1000, '--air-density', 1.1), ['--air-density', '--altitude']),
        (('--altitude', 12_000), ['--altitude: 12000', '11000 m']),
    ],
)
def test_words_that_contradict_each_other_are_refused(fly, arguments, fragments):
    code, out, err = fly(*arguments)
    assert (code, out, err.count('\n')) == (2, '', 1)
    assert all(fragment in err for fragment in fragments), err


# ---- several flights ----


def test_several_discs_are_compared(fly, document, tmp_path):
    throw = ('--speed', '50mph', '--spin', '900rpm', '--pitch', 8, '--height', 1.2)
    names = ('wraith', 'firebird', 'frisbee')
    discs = [word for name in names for word in ('--disc', name)]
    flights = document(*discs, *throw)['flights']
    assert [f['name'] for f in flights] == list(names)
    for name, flight in zip(names, flights, strict=True):
        alone = document('--disc', name, *throw)
        assert flight == {'name': name, **alone}
    plot = tmp_path / 'compared.png'
    code, out, _ = fly(*discs, *throw, '--plot', plot)
    assert code == 0
    rows = [line.split() for line in out.splitlines()[1:4]]
    assert [row[0] for row in rows] == list(names)
    assert [float(row[1]) for row in rows] == [round(f['range_m'], 1) for f in flights]
    assert image.imread(plot).shape[2] >= 3
    _, out, _ = fly(*discs, *throw, '--units', 'us')
    feet = [float(line.split()[1]) for line in out.splitlines()[1:4]]
    assert feet == [round(f['range_m'] / 0.3048, 1) for f in flights]
    assert 'range ft' in out
    code, _, err = fly(*discs, '--csv', tmp_path / 'a.csv')
    assert code == 2
    assert '--csv' in err


# ---- TechDisc ----


def test_rows_of_a_techdisc_are_launches(document, file):
    first, second = document('--techdisc', file(TECHDISC), '--disc', 'wraith', '--height', 1)[
        'flights'
    ]
    assert (first['name'], second['name']) == ('1 backhand', '2 forehand')
    words = ('--launch-angle', 9.5, '--nose', -0.5, '--hyzer', 12, '--throw', 'rhbh')
    same = document(
        '--disc', 'wraith', '--height', 1, '--speed', '60mph', '--spin', '1080rpm', *words
    )
    assert first == {'name': '1 backhand', **same}
    launch = second['launch']
    assert launch['spin_rad_s'] == pytest.approx(-30 * math.pi)
    # The half angle of a wobble of a free symmetric body.
    ratio = 1.306e-3 / 6.571e-4
    wobble = ratio * launch['spin_rad_s'] * math.tan(math.radians(4))
    assert launch['roll_rate_rad_s'] == pytest.approx(wobble, rel=1e-3)


@pytest.mark.parametrize(
    ('old', 'new', 'fragments'),
    [
        ('60,1080', '600,1080', ['line 2: speedMph: 600', '0 to 447.387 mph']),
        ('60,1080', 'fast,1080', ["line 2: speedMph: 'fast'", '0 to 447.387 mph']),
        ('60,1080', '60,', ["line 2: spinRpm: ''"]),
        ('FOREHAND', 'hammer', ["line 3: throwType: 'hammer'", 'rhbh', 'forehand']),
        (',4,FORE', ',90,FORE', ['line 3: wobbleAngle: 90', '0 to 60']),
        ('spinRpm', 'spin', ['throws.csv: columns', 'a column spinRpm']),
        ('speedMph', 'speed', ['throws.csv: columns', 'speedKmh']),
        ('speedMph', 'speedmph', ['throws.csv: columns', 'did you mean speedMph for speedmph?']),
        (TECHDISC[TECHDISC.index('\n') :], '\n', ['--techdisc', 'at least one throw']),
    ],
)
def test_a_bad_file_of_a_techdisc_is_refused_in_one_line(fly, file, old, new, fragments):
    path = file(TECHDISC.replace(old, new))
    code, out, err = fly('--techdisc', path)
    assert (code, out, err.count('\n')) == (2, '', 1)
    assert path.name in err
    assert all(fragment in err for fragment in fragments), err


@pytest.mark.parametrize(
    ('flag', 'value'),
    [('--speed', '60mph'), ('--throw', 'rhbh'), ('--hyzer', '5'), ('--advance-ratio', '0.3')],
)
def test_a_release_beside_those_of_a_techdisc_is_refused(fly, file, flag, value):
    """It had no effect, and the table did not say so."""
    code, out, err = fly('--techdisc', file(TECHDISC), flag, value)
    assert (code, out, err.count('\n')) == (2, '', 1)
    assert err.startswith(f'fly: error: {flag}: ')
    assert '--techdisc gives the releases' in err


def test_a_missing_file_of_a_techdisc_is_refused(fly, tmp_path):
    code, _, err = fly('--techdisc', tmp_path / 'no.csv')
    assert code == 2
    assert 'cannot read it (No such file or directory)' in err
