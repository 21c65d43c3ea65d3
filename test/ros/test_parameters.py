"""The parameters of sim_node: their table, their meaning and their refusals, without ROS."""

import dataclasses
import math
import os

import pytest
import yaml

import parameter_pages

pytest.importorskip('rclpy')


from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.quantities import QUANTITIES
from disc_sim_ros.ros.parameter_spec import ParameterSpec
from disc_sim_ros.ros.sim.config import configuration
from disc_sim_ros.ros.sim.parameters import TABLE
from ros.parameter_files import (
    DEFAULTS,
    DISC_FILE,
    LENIENT,
    NUMBERS,
    ROOT,
    as_lists,
    flat,
)

# ---- the table ----


def test_names_are_unique():
    assert len(DEFAULTS) == len(TABLE)


@pytest.mark.parametrize('spec', TABLE, ids=lambda spec: spec.name)
def test_every_parameter_has_a_meaning_an_effect_and_a_range(spec):
    assert spec.meaning.endswith('.')
    assert spec.effect in {'next throw', 'at once', 'fixed'}
    number = isinstance(spec.default, int | float | tuple) and not isinstance(spec.default, bool)
    assert number == math.isfinite(spec.lowest) == math.isfinite(spec.highest)


def test_the_parameters_of_the_launch_are_its_fields_with_their_defaults():
    prefix = 'launch.'
    launch = {n.removeprefix(prefix): x for n, x in DEFAULTS.items() if n.startswith(prefix)}
    assert launch == dataclasses.asdict(Launch())


def test_every_number_is_a_quantity_of_the_table():
    for spec in TABLE:
        number = isinstance(spec.default, int | float | tuple)
        assert (spec.quantity is not None) == (number and not isinstance(spec.default, bool))
    assert {spec.quantity for spec in TABLE if spec.quantity} <= set(QUANTITIES.values())


def test_the_effects_are_those_that_the_node_can_keep():
    by_effect = {
        effect: {spec.name for spec in TABLE if spec.effect == effect}
        for effect in ('at once', 'fixed')
    }
    assert by_effect == {
        'at once': {
            'wind.x', 'wind.y', 'wind.z', 'wind.roughness_length', 'wind.reference_height',
            'real_time_factor', 'command_timeout', 'throw_period', 'path_rate',
        },
        'fixed': {
            'auto_throw', 'publish_clock', 'start_time', 'frame_prefix', 'realtime_priority',
        },
    }  # fmt: skip


def test_page_is_up_to_date():
    page = (ROOT / 'docs/parameters.md').read_text(encoding='utf-8')
    assert page == parameter_pages.markdown(), (
        'run: python tools/parameter_pages.py > docs/parameters.md'
    )


def test_file_is_up_to_date():
    text = (ROOT / 'config/sim.yaml').read_text(encoding='utf-8')
    assert text == parameter_pages.yaml_file(), (
        'run: python tools/parameter_pages.py yaml > config/sim.yaml'
    )


def test_file_holds_every_parameter_with_its_default():
    document = yaml.safe_load((ROOT / 'config/sim.yaml').read_text(encoding='utf-8'))
    values = flat(document['/**']['ros__parameters'])
    assert values == as_lists(DEFAULTS)
    assert [type(x) for x in values.values()] == [type(x) for x in as_lists(DEFAULTS).values()]


def test_main_prints_the_pages(capsys):
    parameter_pages.main([])
    assert capsys.readouterr().out == parameter_pages.markdown()
    parameter_pages.main(['yaml'])
    assert capsys.readouterr().out == parameter_pages.yaml_file()


# ---- configuration ----


def test_defaults_are_the_throw_of_fig_5():
    config = configuration({})
    assert config == configuration(DEFAULTS)
    assert config.launch == Launch()
    assert config.setup.disc.name == 'frisbee'
    assert config.setup.aero is None
    assert (config.setup.air, config.setup.wind) == (Air(), Wind())
    assert config.setup.step == 1e-3
    assert config.steps_per_publish == 5


def test_every_parameter_reaches_the_configuration():
    """A changed value must change the configuration: no parameter may be dropped."""
    words = {'disc': 'ultrastar', 'model': 'precession', 'moment_axes': 'wind', 'aero': 'linear'}
    words |= {
        'frame_prefix': 'red/',
        'ground_contact': 'rim',
        'publish_rate': 100.0,
        'physics_rate': 2000.0,
    }
    for spec in TABLE:
        value = words.get(spec.name)
        if value is None:
            value = changed(spec)
        assert configuration({spec.name: value}) != configuration({}), spec.name


def changed(spec: ParameterSpec) -> object:
    if isinstance(spec.default, bool):
        return not spec.default
    if isinstance(spec.default, tuple):
        return [1.0, 2.0, 3.0]
    return spec.default + 1


def test_wind_turns_from_map_to_the_axes_of_the_paper():
    wind = configuration({'wind.x': 1.0, 'wind.y': 2.0, 'wind.z': 3.0}).setup.wind
    assert wind.mean == (1.0, -2.0, -3.0)


def test_zero_wind_has_no_minus_zeros():
    assert [math.copysign(1.0, x) for x in configuration({}).setup.wind.mean] == [1.0, 1.0, 1.0]


def test_a_whole_number_is_converted_where_the_parameter_is_a_double():
    config = configuration({'physics_rate': 500, 'publish_rate': 100, 'imu.offset': [0, 0, 1]})
    assert (config.physics_rate, type(config.physics_rate)) == (500.0, float)
    assert config.imu.offset == (0.0, 0.0, 1.0)
    assert {type(x) for x in config.imu.offset} == {float}


@pytest.mark.parametrize('end', ['lowest', 'highest'])
@pytest.mark.parametrize('spec', NUMBERS, ids=lambda spec: spec.name)
def test_the_ends_of_a_range_are_allowed(spec, end):
    """No check of the physics may be narrower than the range of the parameter."""
    value = getattr(spec, end)
    others = dict(LENIENT)
    if spec.name in {'physics_rate', 'publish_rate'} and value >= 10.0:
        others |= {'physics_rate': value, 'publish_rate': value}
    elif spec.name == 'wind.reference_height':
        others['wind.roughness_length'] = 0.0
    configuration({**others, spec.name: value})


@pytest.mark.parametrize('spec', NUMBERS, ids=lambda spec: spec.name)
@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf, '1', None, True, [1.0], 10**400])
def test_a_number_that_is_not_finite_or_of_another_type_is_refused(spec, value):
    with pytest.raises(ConfigError) as refused:
        configuration({spec.name: value})
    assert refused.value.thing == spec.name


@pytest.mark.parametrize('spec', NUMBERS, ids=lambda spec: spec.name)
def test_a_number_out_of_its_range_is_refused(spec):
    step = 1 if isinstance(spec.default, int) else 1e-9 * max(1.0, spec.highest)
    for value in (spec.lowest - step, spec.highest + step):
        with pytest.raises(ConfigError, match='number from') as refused:
            configuration({spec.name: value})
        assert refused.value.thing == spec.name


@pytest.mark.parametrize(
    ('values', 'thing', 'reason'),
    [
        # together
        ({'launch.height': -1.0}, 'launch.height', 'with ground, release at 0 m or above'),
        ({'physics_rate': 50.0, 'publish_rate': 50.0, 'launch.spin': -100.0}, 'physics_rate',
         '50 is not allowed; its step is 0.02 s, and at spin -100 rad/s .* at most 0.0139'),
        ({'disc': 'wraith', 'aero': 'linear'}, 'aero', 'disc wraith has no such coefficients'),
        ({'publish_rate': 300.0}, 'publish_rate', 'near are 250 and 333.333333333'),
        ({'publish_rate': 2000.0}, 'publish_rate', 'near are 1000$'),
        ({'physics_rate': 500.0}, 'publish_rate', 'physics_rate 500 Hz must be a whole multiple'),
        ({'publish_rate': 200.000001}, 'publish_rate', 'whole multiple'),
        ({'wind.roughness_length': 8.0}, 'wind.reference_height', 'from 16 to 1000 m, at least t'),
        ({'throw_period': 1e-4}, 'throw_period', '0 or at least one step, 0.001 s'),
        # words
        ({'disc': 'frisby'}, 'disc', 'did you mean frisbee'),
        ({'disc': 'none.yaml'}, 'disc', 'cannot read it'),
        ({'disc': ''}, 'disc', 'choose from'),
        ({'disc': 3}, 'disc', 'give a text'),
        ({'model': 'exakt'}, 'model', 'choose from exact, constant_spin, precession'),
        ({'aero': 'tables'}, 'aero', "choose from '', table, linear"),
        ({'moment_axes': ''}, 'moment_axes', 'choose from body, wind'),
        ({'ground': 1}, 'ground', 'give true or false'),
        ({'ground': 'true'}, 'ground', 'give true or false'),
        # lists
        ({'imu.offset': []}, 'imu.offset', 'give 3 numbers from -10 to 10 m'),
        ({'imu.offset': [0.0, 0.0]}, 'imu.offset', 'give 3 numbers'),
        ({'imu.offset': [0.0, 0.0, 11.0]}, 'imu.offset', 'give 3 numbers'),
        ({'imu.gyroscope_bias': [0.0, math.nan, 0.0]}, 'imu.gyroscope_bias', 'give 3 numbers'),
        ({'imu.gyroscope_bias': [0.0, True, 0.0]}, 'imu.gyroscope_bias', 'give 3 numbers'),
        ({'imu.gyroscope_bias': 'abc'}, 'imu.gyroscope_bias', 'give 3 numbers'),
        # names
        ({'launch.sped': 3.0}, 'launch.sped', 'did you mean launch.speed?'),
        ({'speed': 3.0}, 'speed', 'did you mean launch.speed?'),
        ({'seed': 3}, 'seed', 'did you mean wind.seed or imu.seed?'),
        ({'qqq': 3}, 'qqq', 'there is no such parameter$'),
    ],
)  # fmt: skip
def test_a_refusal_has_the_name_of_the_parameter_and_the_reason(values, thing, reason):
    with pytest.raises(ConfigError, match=reason) as refused:
        configuration(values)
    assert refused.value.thing == thing
    assert refused.value.value == values.get(thing, DEFAULTS.get(thing))
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize('steps', [1, 3, 7, 1000, 9999])
def test_steps_per_publish_is_a_whole_number(steps):
    for rate in (1000.0, 12345.6, 99999.9):
        config = configuration({'physics_rate': rate, 'publish_rate': rate / steps})
        assert config.steps_per_publish == steps


def test_the_rates_that_a_refusal_proposes_are_allowed():
    for rate in ('250', '333.333333333'):
        configuration({'publish_rate': float(rate)})


@pytest.mark.parametrize('prefix', ['', 'red', 'red/', 'red_', 'a1/b_2/', 'a/b'])
def test_frame_prefix(prefix):
    assert configuration({'frame_prefix': prefix}).frame_prefix == prefix


@pytest.mark.parametrize(
    'prefix', ['/', '/a', 'a//', '1a', 'a b', 'a-b', 'aä', '_a', 'a\n', 'a/1']
)
def test_a_bad_frame_prefix_is_refused(prefix):
    with pytest.raises(ConfigError, match='frame_prefix'):
        configuration({'frame_prefix': prefix})


def test_a_changed_disc_file_is_read_again(tmp_path):
    path = tmp_path / 'my disc.yaml'
    path.write_text(DISC_FILE.format(mass=0.2))
    assert configuration({'disc': str(path)}).setup.disc.mass == 0.2
    path.write_text(DISC_FILE.format(mass=0.175))
    os.utime(path, ns=(1, 1))
    assert configuration({'disc': str(path)}).setup.disc.mass == 0.175


def test_a_bad_disc_file_is_refused_with_file_and_key(tmp_path):
    path = tmp_path / 'bad.yaml'
    path.write_text(DISC_FILE.format(mass=-1))
    with pytest.raises(ConfigError, match=r'bad\.yaml: mass_kg: -1 is not allowed') as refused:
        configuration({'disc': str(path)})
    assert refused.value.thing == 'disc'
