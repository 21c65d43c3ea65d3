"""Disc files: the catalogue holds the published numbers, and users can write their own."""

import math
from pathlib import Path

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
import pytest

from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.disc import SpinTable
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from physics.disc_files import COLUMNS, NAMES, assert_same_disc, end_of, published, yaml_of

DAMPINGS = ('C_Lp', 'C_Mq', 'C_Nr')

# --- the discs of the package


def test_the_catalogue_holds_these_discs():
    assert disc_file.disc_names() == NAMES


@pytest.mark.parametrize('name', NAMES)
def test_every_disc_flies(name):
    flight = fly(Launch(), Setup(disc=disc_file.load_disc(name)))
    assert flight.landed
    # Thrown at 15 m/s and 15 degrees a stone flies 11.5 m; a plate of 15 g without damping less.
    assert 3.0 < flight.range < 60.0


@pytest.mark.parametrize('name', NAMES)
def test_every_disc_has_a_description(name):
    disc = disc_file.load_disc(name)
    assert disc.name == name
    assert len(disc.description) > 10


@pytest.mark.parametrize(
    ('name', 'numbers'),
    [
        (
            'frisbee',
            {
                'mass': 0.175,
                'diameter': 0.275,
                'area': math.pi * 0.275**2 / 4,
                'inertia_axial': 2.4e-3,
                'inertia_diametral': 1.2e-3,
                'C_Lp': -0.130,
                'C_Mq': -0.140,
                'C_Nr': -1.83e-3,
                'aero': 'table',
            },
        ),
        ('frisbee_linear', {'mass': 0.175, 'aero': 'linear'}),
        (
            'ultrastar',
            {
                'mass': 0.175,
                'diameter': 0.269,
                'area': 0.057,
                'inertia_axial': 2.352e-3,
                'inertia_diametral': 1.219e-3,
            },
        ),
        (
            'flat_plate',
            {
                'mass': 0.015,
                'diameter': 0.12,
                'area': math.pi * 0.06**2,
                'inertia_axial': 0.015 * 0.12**2 / 8,  # eqn 60
                'inertia_diametral': 0.015 * 0.12**2 / 16,
                'C_Lp': 0.0,
                'C_Mq': 0.0,
                'C_Nr': 0.0,
                'table': None,
            },
        ),
        (
            'wraith',
            {
                'mass': 0.175,
                'diameter': 0.211,
                'inertia_axial': 7.465e-3 * 0.175,
                'inertia_diametral': 3.755e-3 * 0.175,
                'linear': None,
            },
        ),
    ],
)
def test_the_published_numbers(name, numbers):
    disc = disc_file.load_disc(name)
    for key, number in numbers.items():
        value = getattr(disc, key)
        if isinstance(number, float):
            assert value == pytest.approx(number, rel=1e-15), key  # products are rounded
        else:
            assert value == number, key


def test_the_straight_lines_of_fig_3():
    line = disc_file.load_disc('frisbee').linear
    assert line is not None
    assert (line.CL_0, line.CL_alpha, line.CD_0, line.CD_alpha) == (0.13, 3.09, 0.085, 3.30)
    assert (line.alpha_0, line.CM_0, line.CM_alpha) == (-0.052, -0.01, 0.057)


def test_the_frisbee_table_holds_the_measured_coefficients():
    head, rows = published('wind_tunnel_crowther_potts.csv')
    table = disc_file.load_disc('frisbee').table
    assert table is not None
    assert head == ['alpha_deg', *COLUMNS]
    assert_allclose(np.degrees(table.alpha), rows[:, 0], rtol=1e-15, atol=0.0)  # to radians
    assert_array_equal(table.coefficients, rows[:, 1:])


def test_the_spin_roll_moment_is_measured_except_where_its_file_states_otherwise():
    head, rows = published('spin_roll_moment_hummel2003.csv')
    table = disc_file.load_disc('frisbee_roll_moment').spin_roll_moment
    assert table is not None
    rows = rows[np.argsort(rows[:, 0])]
    degrees = [-90, *(int(name.removeprefix('a')) for name in head[1:]), 90]
    assert_allclose(np.degrees(table.alpha), degrees, rtol=1e-15, atol=0.0)
    assert_array_equal(table.advance_ratio, rows[:, 0])
    assert_array_equal(table.coefficient[1:, 1:-1], rows[1:, 1:])
    # The differences: no moment without spin, where up to 0.0020 were read except in the padded
    # column, and no moment at +-90 degrees.
    assert_array_equal(table.coefficient[0], 0.0)
    assert np.abs(rows[0, 1:-1]).max() == 0.0020
    assert_array_equal(table.coefficient[:, [0, -1]], 0.0)


def test_the_spin_roll_moment_changes_nothing_else():
    disc, frisbee = disc_file.load_disc('frisbee_roll_moment'), disc_file.load_disc('frisbee')
    assert_same_disc(disc, frisbee, but=('spin_roll_moment', 'spin_terms'))
    assert frisbee.spin_roll_moment is None


def test_the_frisbee_has_a_tenth_of_the_printed_roll_and_pitch_damping():
    printed, frisbee = disc_file.load_disc('frisbee_as_printed'), disc_file.load_disc('frisbee')
    assert (printed.C_Lp, printed.C_Mq) == (-1.30, -1.40)  # below eqn 25
    assert frisbee.C_Lp == pytest.approx(0.1 * printed.C_Lp, rel=1e-15)
    assert frisbee.C_Mq == pytest.approx(0.1 * printed.C_Mq, rel=1e-15)
    assert_same_disc(printed, frisbee, but=('C_Lp', 'C_Mq'))


def test_the_ultrastar_has_the_steady_coefficients_and_the_roll_moment_of_the_frisbee():
    own = (
        'mass',
        'diameter',
        'area',
        'inertia_axial',
        'inertia_diametral',
        'ground_contact',
        *DAMPINGS,
    )
    base = disc_file.load_disc('frisbee_roll_moment')
    assert_same_disc(disc_file.load_disc('ultrastar'), base, but=own)


# --- a user's own files


@pytest.mark.parametrize('name', NAMES)
def test_a_copy_of_a_disc_of_the_package_flies_the_same(user_file, name):
    own = disc_file.load_disc(user_file(yaml_of(name)))
    assert own.name == 'mine'
    assert_same_disc(own, disc_file.load_disc(name))
    assert end_of(own) == end_of(disc_file.load_disc(name))  # bit for bit


@pytest.mark.parametrize(
    'content',
    [
        pytest.param(yaml_of('frisbee').replace('\n', '\r\n').encode(), id='Windows line ends'),
        pytest.param(yaml_of('frisbee').encode('utf-8-sig'), id='byte order mark'),
        pytest.param(b'---\n' + yaml_of('frisbee').encode() + b'...\n', id='document marks'),
    ],
)
def test_files_of_any_editor_are_read(user_file, content):
    assert_same_disc(disc_file.load_disc(user_file(content)), disc_file.load_disc('frisbee'))


@pytest.mark.parametrize('file_name', ['mine.yml', 'my disc.yaml', 'Schüssel.yaml', 'a.b.yaml'])
def test_any_file_name_is_accepted(user_file, file_name):
    disc = disc_file.load_disc(user_file(yaml_of('frisbee'), file_name))
    assert disc.name == Path(file_name).stem


def test_a_file_with_the_name_of_a_disc_of_the_package_takes_precedence(
    user_file, monkeypatch, tmp_path
):
    user_file('based_on: frisbee\nmass_kg: 0.2\n', 'frisbee.yaml')
    monkeypatch.chdir(tmp_path)
    assert disc_file.load_disc('frisbee.yaml').mass == 0.2
    assert disc_file.load_disc('frisbee').mass == 0.175


def test_based_on_changes_only_the_given_keys(user_file):
    disc = disc_file.load_disc(user_file('based_on: wraith\nmass_kg: 0.15\n'))
    assert disc.mass == 0.15
    inertia = ('inertia_axial', 'inertia_diametral')
    wraith = disc_file.load_disc('wraith')
    assert_same_disc(disc, wraith, but=('mass', *inertia))
    for name in inertia:
        assert getattr(disc, name) == pytest.approx(
            getattr(wraith, name) * 0.15 / 0.175, rel=1e-12
        )
    assert disc.description.endswith('(inertia of wraith scaled by 0.8571 to the mass_kg)')


def test_a_given_inertia_is_not_scaled(user_file):
    text = 'based_on: wraith\nmass_kg: 0.15\ninertia_axial_kg_m2: 1.2e-3\n'
    disc, wraith = disc_file.load_disc(user_file(text)), disc_file.load_disc('wraith')
    assert (disc.inertia_axial, disc.inertia_diametral) == (1.2e-3, wraith.inertia_diametral)
    assert disc.description == wraith.description


def test_the_same_mass_scales_nothing(user_file):
    disc = disc_file.load_disc(user_file('based_on: frisbee\nmass_kg: 0.175\n'))
    assert disc.description == disc_file.load_disc('frisbee').description


def test_a_new_mass_and_diameter_scale_the_inertia_by_both(user_file):
    text = 'based_on: frisbee\ndescription: small\nmass_kg: 0.1\ndiameter_m: 0.22\n'
    disc = disc_file.load_disc(user_file(text))
    factor = 0.1 / 0.175 * (0.22 / 0.275) ** 2
    assert disc.inertia_axial == pytest.approx(2.4e-3 * factor, rel=1e-12)
    assert disc.inertia_diametral == pytest.approx(1.2e-3 * factor, rel=1e-12)
    note = '(inertia of frisbee scaled by 0.3657 to the mass_kg and diameter_m)'
    assert disc.description == f'small {note}'


def test_based_on_computes_the_area_of_a_new_diameter(user_file):
    disc = disc_file.load_disc(user_file('based_on: frisbee\ndiameter_m: 0.2\n'))
    assert disc.area == pytest.approx(math.pi * 0.01, rel=1e-15)


def test_based_on_merges_damping_and_lines_key_by_key(user_file):
    text = 'based_on: frisbee\ndamping: {C_Mq: -2}\nlinear: {CL_0: 0.2}\n'
    disc, frisbee = disc_file.load_disc(user_file(text)), disc_file.load_disc('frisbee')
    assert (disc.C_Lp, disc.C_Mq, disc.C_Nr) == (frisbee.C_Lp, -2.0, frisbee.C_Nr)
    assert disc.linear is not None
    assert frisbee.linear is not None
    assert disc.linear.CL_0 == 0.2
    assert disc.linear.CL_alpha == frisbee.linear.CL_alpha


def test_based_on_goes_through_several_files(user_file):
    disc = disc_file.load_disc(user_file('based_on: frisbee_as_printed\naero: linear\n'))
    assert (disc.C_Lp, disc.mass, disc.aero) == (-1.30, 0.175, 'linear')


def test_loading_twice_gives_two_discs_that_do_not_share(user_file):
    """A change in a file must not affect the disc that it is based on."""
    disc_file.load_disc(user_file('based_on: frisbee\ndamping: {C_Mq: -2}\n'))
    assert disc_file.load_disc('frisbee').C_Mq == -0.140


@pytest.mark.parametrize(
    ('text', 'value'),
    [
        ('175e-3', 0.175),
        ('175E-3', 0.175),
        ('1.5e+1', 15.0),
        ('+.5', 0.5),
        ('2.', 2.0),
        ('2', 2.0),
        ('017', 17.0),  # octal 15 in YAML 1.1
    ],
)
def test_numbers_are_read_as_decimal(user_file, text, value):
    assert disc_file.load_disc(user_file(f'based_on: frisbee\nmass_kg: {text}\n')).mass == value


def test_angles_with_leading_zeros_are_decimal(user_file):
    """-045 is -37 in YAML 1.1."""
    text = 'based_on: frisbee\ntable: {alpha_deg: [-090, -045, 000, 090], CL: [0, 0, 0, 0], '
    disc = disc_file.load_disc(user_file(text + 'CD: [1, 1, 1, 1], CM: [0, 0, 0, 0]}\n'))
    assert disc.table is not None
    assert_allclose(np.degrees(disc.table.alpha), [-90, -45, 0, 90], rtol=1e-15, atol=0.0)


def test_a_description_is_one_line(user_file):
    disc = disc_file.load_disc(user_file('based_on: frisbee\ndescription: >\n  two\n  lines\n'))
    assert disc.description == 'two lines'


def test_anchors_save_writing(user_file):
    text = (
        'based_on: frisbee\n'
        'spin_roll_moment:\n  advance_ratio: &r [0, 1]\n  alpha_deg: &a [-90, 90]\n'
        '  coefficient: [[0, 0], [1, 2]]\n'
        'spin_side_force:\n  advance_ratio: *r\n  alpha_deg: *a\n'
        '  coefficient: [[0, 0], [3, 4]]\n'
    )
    disc = disc_file.load_disc(user_file(text))
    assert isinstance(disc.spin_roll_moment, SpinTable)
    assert isinstance(disc.spin_side_force, SpinTable)
    assert_array_equal(disc.spin_side_force.advance_ratio, [0.0, 1.0])
