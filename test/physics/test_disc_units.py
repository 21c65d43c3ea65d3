"""A number in a wrong unit is refused, and the message names the unit that it looks like."""

import pytest

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import disc_file
from measurements import beside

CASES = beside('cases/discs')  # files of mistakes that people make
IN_GRAMS = ['mass_kg', '170', '0.001 to 100 kg', 'kg expected, this looks like grams']
PER_MASS = [
    'inertia_axial_kg_m2',
    '0.007465',
    'm (d/2)^2 = 0.001948 kg m^2',
    'kg m^2 expected, this looks like I_z / m in m^2',
]
MISTAKES = {
    'mass_kg: 170': IN_GRAMS,
    'inertia_axial_kg_m2: 7.465e-3\ninertia_diametral_kg_m2: 3.755e-3': PER_MASS,
    'mass_kg: 0.00018': ['mass_kg', '0.00018', '0.001 to 100 kg'],
    'diameter_m: 21.1': ['diameter_m', '21.1', '0.01 to 5 m', 'm expected, this looks like cm'],
    'diameter_m: 8.3': ['diameter_m', '8.3', 'm expected, this looks like inches'],
    'diameter_m: 211': ['diameter_m', '211', 'm expected, this looks like mm'],
    'area_m2: 350': ['area_m2', '350', 'diameter^2, 0.04452 m^2', 'this looks like cm^2'],
    'inertia_axial_kg_m2: 1.3': ['inertia_axial_kg_m2', '1.3', 'this looks like g m^2'],
    'inertia_axial_kg_m2: 13': ['inertia_axial_kg_m2', '13', 'this looks like kg cm^2'],
    'inertia_diametral_kg_m2: 6571': ['inertia_diametral_kg_m2', '6571', 'looks like g cm^2'],
    'inertia_diametral_kg_m2: 3.755e-3': ['inertia_diametral', 'this looks like I_x / m in m^2'],
}


def refusal(path: str) -> str:
    with pytest.raises(ConfigError) as refused:
        disc_file.load_disc(path)
    text = str(refused.value)
    assert path in text
    assert '\n' not in text
    return text


@pytest.mark.parametrize(('keys', 'words'), MISTAKES.items(), ids=MISTAKES)
def test_a_wrong_unit_is_refused_with_file_key_value_bound_and_guess(user_file, keys, words):
    text = refusal(user_file(f'based_on: wraith\n{keys}\n', 'd.yaml'))
    for word in words:
        assert word in text


@pytest.mark.parametrize('name', disc_file.disc_names())
def test_the_inertia_bound_is_m_r_squared(user_file, name):
    """Just below m (d/2)^2 a disc is accepted, just above it is not."""
    disc = disc_file.load_disc(name)
    most = disc.mass * (disc.diameter / 2) ** 2
    text = f'based_on: {name}\ninertia_diametral_kg_m2: {most / 2 * 1.001}\ninertia_axial_kg_m2: '
    assert disc_file.load_disc(user_file(f'{text}{most * 0.999}\n')).inertia_axial < most
    refusal(user_file(f'{text}{most * 1.001}\n', 'd.yaml'))


def test_no_guess_where_no_unit_explains_the_number(user_file):
    assert 'looks like' not in refusal(user_file('based_on: frisbee\nmass_kg: 1e9\n', 'd.yaml'))
    assert 'looks like' not in refusal(user_file('based_on: frisbee\nmass_kg: -170\n', 'd.yaml'))


@pytest.mark.skipif(not CASES.is_dir(), reason='the files of mistakes are not on this machine')
@pytest.mark.parametrize(
    ('file', 'words'),
    [('mass_in_grams.yaml', IN_GRAMS), ('inertia_per_mass.yaml', PER_MASS)],
)
def test_mistakes_of_others_are_refused(file, words):
    text = refusal(str(CASES / file))
    for word in words:
        assert word in text
