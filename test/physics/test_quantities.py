"""The table of quantities: complete, consistent, and the source of checks and names."""

import dataclasses
import math

import pytest

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.disc import Disc, LinearAero
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.kernels.rows import NAMES
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.quantities import (
    ADVANCE_RATIO,
    AIR,
    DAMPING,
    DISC,
    DURATION,
    LAUNCH,
    LINEAR_AERO,
    QUANTITIES,
    VARIED,
    WIND,
)
from disc_sim_ros.validation import Quantity

ALL = {**QUANTITIES, **{f'varied {name}': quantity for name, quantity in VARIED.items()}}


@pytest.mark.parametrize('quantity', ALL.values(), ids=ALL)
def test_every_quantity_has_a_range_a_sentence_and_a_default_within(quantity):
    assert quantity.lowest < quantity.highest
    assert quantity.sentence[0].isupper()
    assert quantity.meaning.endswith('.')
    assert not quantity.sentence.endswith('.')
    if quantity.default is not None:
        values = quantity.default if isinstance(quantity.default, tuple) else (quantity.default,)
        assert tuple(quantity.check(value) for value in values) == values
        assert {type(value) for value in values} == {int if quantity.whole else float}


def test_a_name_stands_for_one_quantity():
    assert all(name == quantity.name for name, quantity in QUANTITIES.items())
    for name, quantity in VARIED.items():  # the same quantity, at most in a narrower range
        whole = QUANTITIES[name]
        assert quantity == dataclasses.replace(
            whole, lowest=quantity.lowest, highest=quantity.highest, open=quantity.open
        )
        assert whole.lowest <= quantity.lowest < quantity.highest <= whole.highest


def test_the_compiled_loop_has_a_column_for_each_varied_quantity_in_this_order():
    """The kernel repeats the names, so that a changed sentence does not recompile it."""
    assert tuple(name for name in VARIED if name != ADVANCE_RATIO.name) == NAMES


@pytest.mark.parametrize(
    ('kind', 'group', 'others'),
    [
        (Launch, LAUNCH, set()),
        (Air, AIR, set()),
        (Wind, WIND, {'mean'}),
        (LinearAero, LINEAR_AERO, set()),
        (
            Disc,
            DISC | DAMPING,
            {'name', 'description', 'aero', 'table', 'linear', 'spin_roll_moment',
             'spin_side_force', 'uncertainty', 'ground_contact'},
        ),
    ],
)  # fmt: skip
def test_the_fields_of_a_dataclass_are_quantities_with_their_defaults(kind, group, others):
    """Wind.mean is wind_x, wind_y and wind_z; Air.density is air_density, Wind.seed gust_seed."""
    of_class = {n.removeprefix('air_').removeprefix('gust_'): q for n, q in group.items()}
    fields = {field.name: field for field in dataclasses.fields(kind)}
    assert fields.keys() - others == of_class.keys() - {'wind_x', 'wind_y', 'wind_z'}
    for name, quantity in of_class.items():
        if name in fields and quantity.default is not None:
            assert fields[name].default == quantity.default
    if kind is Wind:
        assert Wind().mean == tuple(WIND[f'wind_{axis}'].default for axis in 'xyz')


@pytest.mark.parametrize('quantity', QUANTITIES.values(), ids=QUANTITIES)
def test_a_refusal_names_thing_value_range_and_quantity_in_one_line(quantity):
    value = quantity.highest + 1  # inf where there is no highest
    with pytest.raises(ConfigError) as refused:
        quantity.check(value, '--flag')
    error = refused.value
    assert (error.thing, error.value, error.quantity) == ('--flag', value, quantity.name)
    assert error.allowed == quantity.allowed
    assert str(error).startswith('--flag: ')
    assert '\n' not in str(error)
    if quantity.unit and math.isfinite(quantity.highest):
        assert error.allowed.endswith(quantity.unit)
    assert str(error.named('launch.flag')) == str(error).replace('--flag', 'launch.flag')
    assert error.named('launch.flag').quantity == quantity.name


def test_names_for_files_columns_and_plots():
    keys = {name: QUANTITIES[name].key for name in ('pitch', 'inertia_axial', 'CD_alpha', 'C_Lp')}
    assert keys == {
        'pitch': 'pitch_deg',
        'inertia_axial': 'inertia_axial_kg_m2',
        'CD_alpha': 'CD_alpha_per_rad2',
        'C_Lp': 'C_Lp',
    }
    assert QUANTITIES['pitch_rate'].label == 'pitch rate, rad/s'
    assert QUANTITIES['pitch'].label == 'pitch, °'
    assert QUANTITIES['lift_factor'].label == 'lift factor'


def test_a_narrower_range_is_within_the_range_and_includes_its_ends():
    longest = DURATION.within(1.0)
    assert (longest.check(1.0), longest.check(DURATION.highest)) == (1.0, DURATION.highest)
    with pytest.raises(ConfigError, match='from 1 to 3600 s'):
        longest.check(0.5)
    with pytest.raises(ConfigError, match='> 0 and <= 3600 s'):
        DURATION.check(0.0)
    with pytest.raises(ValueError, match='not within'):
        DURATION.within(highest=DURATION.highest + 1.0)


def test_a_whole_quantity_takes_no_fraction():
    seed = Quantity('seed', '', 0, 7, 0, 'Seed', whole=True)
    assert (seed.check(7), type(seed.check(7))) == (7, int)
    for value in (7.0, 8, -1, True, '1'):
        with pytest.raises(ConfigError, match=r'whole number from 0 to 7$'):
            seed.check(value)
