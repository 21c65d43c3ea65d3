"""Flags made of quantities: their help, their check, and their names in errors."""

import argparse

import pytest

from disc_sim_ros.cli import demo, flags, fly, optimise, sweep
from disc_sim_ros.cli.arguments import FromText, Parser, add_components, add_quantity, whole
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.quantities import DURATION, MEAN_WIND, QUANTITIES
from disc_sim_ros.validation import Quantity

HEIGHT = Quantity('height', 'm', -1.0, 2.5, 0.5, 'Height of `map`', 'up positive')
SEED = Quantity('gust_seed', '', 0, 2**63 - 1, 3, 'Seed', whole=True)


@pytest.fixture
def parser() -> Parser:
    p = Parser(prog='thrower')
    add_quantity(p, '--from-height', HEIGHT)
    add_quantity(p, '--seed', SEED, dest='seed')
    add_components(p, '--wind', list(MEAN_WIND.values()), ('X', 'Y', 'Z'), 'wind')
    p.add_argument('--vary', action='append')
    return p


def test_a_flag_takes_default_unit_range_and_meaning_from_its_quantity(parser):
    chosen = parser.parse_args([])
    assert (chosen.height, chosen.seed, chosen.wind) == (0.5, 3, (0.0, 0.0, 0.0))
    text = ' '.join(parser.format_help().split())
    assert '--from-height M height of map, up positive; from -1 to 2.5 m (default: 0.5)' in text
    assert f'--seed N seed; a whole number from 0 to {2**63 - 1} (default: 3)' in text
    assert '--wind X Y Z wind; from -100 to 100 m/s each' in text


def test_numbers_are_converted(parser):
    line = '--from-height -1e-1 --seed 9223372036854775807 --wind 1 -2 3e1'
    chosen = parser.parse_args(line.split())
    assert (chosen.height, chosen.seed, chosen.wind) == (-0.1, 2**63 - 1, [1.0, -2.0, 30.0])
    assert (type(chosen.height), type(chosen.seed)) == (float, int)


@pytest.mark.parametrize(
    ('line', 'message'),
    [
        ('--from-height 3', '--from-height: 3 is not allowed; give a number from -1 to 2.5 m'),
        ('--from-height nan', '--from-height: nan is not allowed; give a number from -1 to 2.5 m'),
        ('--from-height 1_0', "--from-height: '1_0' is not allowed; give a number"),
        ('--seed -1', f"--seed: '-1' is not allowed; give a whole number from 0 to {2**63 - 1}"),
        (f'--seed {2**63}', f"--seed: '{2**63}' is not allowed; give a whole number from 0 to "),
        ('--seed 1.0', "--seed: '1.0' is not allowed; give a whole number from 0 to "),
        (f'--seed {"9" * 5000}', "--seed: '99999"),
        ('--wind 1 2 101', '--wind: 101 is not allowed; give a number from -100 to 100 m/s'),
        ('--seed', '--seed: expected one argument; seed; a whole number from 0 to '),
    ],
)
def test_a_refusal_names_flag_value_and_range_in_one_line(parser, capsys, line, message):
    with pytest.raises(SystemExit) as ended:
        parser.parse_args(line.split())
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith(f'thrower: error: {message}')
    assert error.count('\n') == 1


@pytest.mark.parametrize(
    ('error', 'thing'),
    [
        (ConfigError('height of flight 3', 1.0, 'less', 'height'), '--from-height'),
        (ConfigError('wind Y', 1.0, 'less', 'wind_y'), '--wind'),
        (ConfigError('seed', 1, 'less', 'gust_seed'), '--seed'),
        (ConfigError('seed', 1, 'less'), '--seed'),
        (ConfigError('vary speed', 1.0, 'less'), '--vary speed'),
        (ConfigError('mass', 1.0, 'less', 'mass'), 'mass'),
        (ConfigError('--wind', 1.0, 'less'), '--wind'),
    ],
)
def test_an_error_of_a_quantity_or_an_argument_gets_the_name_of_its_flag(parser, error, thing):
    named = parser.in_flags(error)
    assert (named.thing, named.value, named.allowed) == (thing, error.value, error.allowed)


@pytest.mark.parametrize(
    ('line', 'error', 'thing'),
    [
        ([], ConfigError('spin', 2e3, 'less', 'spin'), '--spin'),
        (
            ['--advance-ratio', '9'],
            ConfigError('spin', 2e3, 'less', 'spin'),
            '--advance-ratio, which means a spin',
        ),
        (
            [],
            ConfigError('physics_rate', 1e6, 'less', 'physics_rate'),
            '--step, which means a physics_rate',
        ),
        ([], ConfigError('publish_rate', 3.0, 'less', 'publish_rate'), '--samples'),
        ([], ConfigError('sample_rate', 3.0, 'less', 'sample_rate'), '--samples'),
        ([], ConfigError('angle_of_attack', 1.0, 'less', 'angle_of_attack'), '--alpha'),
    ],
)
def test_an_error_of_what_a_flag_means_names_the_flag_and_the_meaning(line, error, thing):
    parser = fly.parser()
    assert flags.in_flags(error, parser.parse_args(line), parser).thing == thing


def test_demo_gives_the_duration_with_another_flag():
    parser = demo.parser()
    error = ConfigError(DURATION.name, 9e9, 'less', DURATION.name)
    assert flags.in_flags(error, parser.parse_args([]), parser).thing == '--seconds'


@pytest.mark.parametrize('program', [fly, demo, sweep, optimise])
def test_numbers_of_the_programs_are_quantities_of_the_table(program):
    """All but the batch of `sweep`, which is no quantity of a flight or a study."""
    actions = [a for a in program.parser()._actions if isinstance(a.type, FromText)]
    assert len(actions) > 15
    for action in actions:
        for quantity in action.type.quantities:
            assert quantity.name in QUANTITIES or action.dest == 'batch'
    others = [a for a in program.parser()._actions if a.type in {int, float}]
    assert others == []


def test_a_whole_number_without_quantity():
    assert whole(1, 5)('5') == 5
    with pytest.raises(argparse.ArgumentTypeError, match="'6' is not allowed; give a whole"):
        whole(1, 5)('6')
