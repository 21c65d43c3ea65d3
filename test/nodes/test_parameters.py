"""The parameters of sim_node: what ROS shows of them, takes and refuses, and what they mean."""

import dataclasses
import math
import os
from pathlib import Path
import re

import pytest
import yaml

pytest.importorskip('rclpy')

from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_msgs.msg import Empty

from disc_sim_ros.core.air import Air, Wind
from disc_sim_ros.core.errors import ConfigError
from disc_sim_ros.core.launch import LIMITS, Launch
from disc_sim_ros.nodes import parameter_pages, parameters
from disc_sim_ros.nodes.entry import Entry
from disc_sim_ros.nodes.parameter_table import TABLE
from disc_sim_ros.nodes.sim_config import configuration

ROOT = Path(__file__).parents[2]
DEFAULTS = {entry.name: entry.default for entry in TABLE}
ENTRIES = {entry.name: entry for entry in TABLE}
NUMBERS = [
    entry
    for entry in TABLE
    if isinstance(entry.default, int | float) and not isinstance(entry.default, bool)
]
# With these, any one number may be at the end of its range.
LENIENT = {
    'ground': False,
    'launch.spin': 0.0,
    'launch.speed': 0.0,
    'publish_rate': 10.0,
    'wind.reference_height': 1e3,
}
DISC_FILE = """\
based_on: frisbee
mass_kg: {mass}
"""


def flat(nested: dict, prefix: str = '') -> dict[str, object]:
    """Return a parameter file's nested keys with dots."""
    values = {}
    for key, value in nested.items():
        values |= (
            flat(value, f'{prefix}{key}.') if isinstance(value, dict) else {prefix + key: value}
        )
    return values


def as_lists(values: dict[str, object]) -> dict[str, object]:
    return {name: list(x) if isinstance(x, tuple) else x for name, x in values.items()}


# ---- the table ----


def test_names_are_unique():
    assert len(DEFAULTS) == len(TABLE)


@pytest.mark.parametrize('entry', TABLE, ids=lambda entry: entry.name)
def test_every_parameter_says_what_it_is(entry):
    assert entry.meaning.endswith('.')
    assert entry.effect in {'next throw', 'at once', 'fixed'}
    number = isinstance(entry.default, int | float | tuple) and not isinstance(entry.default, bool)
    assert number == math.isfinite(entry.lowest) == math.isfinite(entry.highest)


def test_defaults_and_limits_of_the_launch_are_those_of_the_core():
    launch = {name: ENTRIES[f'launch.{name}'] for name in LIMITS}
    assert {name: entry.default for name, entry in launch.items()} == dataclasses.asdict(Launch())
    assert {name: (e.lowest, e.highest, e.unit) for name, e in launch.items()} == LIMITS


def test_the_effects_are_those_that_the_node_can_keep():
    by_effect = {
        effect: {entry.name for entry in TABLE if entry.effect == effect}
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
        'run: python -m disc_sim_ros.nodes.parameter_pages > docs/parameters.md'
    )


def test_file_is_up_to_date():
    text = (ROOT / 'config/sim.yaml').read_text(encoding='utf-8')
    assert text == parameter_pages.yaml_file(), (
        'run: python -m disc_sim_ros.nodes.parameter_pages yaml > config/sim.yaml'
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
    """A changed value must change the configuration: none may be forgotten on the way."""
    words = {'disc': 'ultrastar', 'model': 'precession', 'moment_axes': 'wind', 'aero': 'linear'}
    words |= {'frame_prefix': 'red/', 'publish_rate': 100.0, 'physics_rate': 2000.0}
    for entry in TABLE:
        value = words.get(entry.name)
        if value is None:
            value = changed(entry)
        assert configuration({entry.name: value}) != configuration({}), entry.name


def changed(entry: Entry) -> object:
    if isinstance(entry.default, bool):
        return not entry.default
    if isinstance(entry.default, tuple):
        return [1.0, 2.0, 3.0]
    return entry.default + 1


def test_wind_turns_from_map_to_the_axes_of_the_paper():
    wind = configuration({'wind.x': 1.0, 'wind.y': 2.0, 'wind.z': 3.0}).setup.wind
    assert wind.mean == (1.0, -2.0, -3.0)


def test_calm_has_no_minus_zeros():
    assert [math.copysign(1.0, x) for x in configuration({}).setup.wind.mean] == [1.0, 1.0, 1.0]


def test_a_whole_number_is_a_double_where_one_is_due():
    config = configuration({'physics_rate': 500, 'publish_rate': 100, 'imu.offset': [0, 0, 1]})
    assert (config.physics_rate, type(config.physics_rate)) == (500.0, float)
    assert config.imu.offset == (0.0, 0.0, 1.0)
    assert {type(x) for x in config.imu.offset} == {float}


@pytest.mark.parametrize('end', ['lowest', 'highest'])
@pytest.mark.parametrize('entry', NUMBERS, ids=lambda entry: entry.name)
def test_the_ends_of_a_range_are_in_it(entry, end):
    """The core has ranges of its own, which must not be narrower."""
    value = getattr(entry, end)
    others = dict(LENIENT)
    if entry.name in {'physics_rate', 'publish_rate'} and value >= 10.0:
        others |= {'physics_rate': value, 'publish_rate': value}
    elif entry.name == 'wind.reference_height':
        others['wind.roughness_length'] = 0.0
    configuration({**others, entry.name: value})


@pytest.mark.parametrize('entry', NUMBERS, ids=lambda entry: entry.name)
@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf, '1', None, True, [1.0], 10**400])
def test_a_number_is_finite_and_no_other_type(entry, value):
    with pytest.raises(ConfigError) as refused:
        configuration({entry.name: value})
    assert refused.value.thing == entry.name


@pytest.mark.parametrize('entry', NUMBERS, ids=lambda entry: entry.name)
def test_beyond_its_range_a_number_is_refused(entry):
    step = 1 if isinstance(entry.default, int) else 1e-9 * max(1.0, entry.highest)
    for value in (entry.lowest - step, entry.highest + step):
        with pytest.raises(ConfigError, match='number from') as refused:
            configuration({entry.name: value})
        assert refused.value.thing == entry.name


@pytest.mark.parametrize(
    ('values', 'thing', 'reason'),
    [
        # together
        ({'launch.height': -1.0}, 'launch.height', 'with ground, release at 0 m or above'),
        ({'physics_rate': 50.0, 'publish_rate': 50.0, 'launch.spin': -100.0}, 'physics_rate',
         '50 is not allowed; its step is 0.02 s, and at spin -100 rad/s .* at most 0.0139'),
        ({'disc': 'wraith', 'aero': 'linear'}, 'aero', 'disc wraith holds no such coefficients'),
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
def test_refused_with_the_name_of_the_parameter_and_the_reason(values, thing, reason):
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


def test_the_rates_that_a_refusal_proposes_are_taken():
    for rate in ('250', '333.333333333'):
        configuration({'publish_rate': float(rate)})


@pytest.mark.parametrize('prefix', ['', 'red', 'red/', 'red_', 'a1/b_2/', 'a/b'])
def test_frame_prefix(prefix):
    assert configuration({'frame_prefix': prefix}).frame_prefix == prefix


@pytest.mark.parametrize(
    'prefix', ['/', '/a', 'a//', '1a', 'a b', 'a-b', 'aä', '_a', 'a\n', 'a/1']
)
def test_frame_prefix_that_is_no_name(prefix):
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


# ---- ROS ----


@pytest.fixture
def new_node(ros_context):
    """Make a node from ROS arguments, without parameters yet."""
    nodes = []

    def make(*arguments, name='sim_node', **kwargs):
        cli = ['--ros-args', *arguments] if arguments else None
        nodes.append(Node(name, context=ros_context, cli_args=cli, **kwargs))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()


@pytest.fixture
def declared(new_node):
    """Make a node with its parameters, and the callbacks that check a change."""

    def make(*arguments, **kwargs):
        node = new_node(*arguments, **kwargs)
        parameters.declare(node, TABLE)
        node.add_pre_set_parameters_callback(lambda new: parameters.widened(new, TABLE))
        node.add_on_set_parameters_callback(lambda changes: verdict(node, changes))
        return node

    return make


def verdict(node: Node, changes: list[Parameter]) -> SetParametersResult:
    reason = parameters.refusal(node, changes, TABLE, configuration)
    return SetParametersResult(successful=not reason, reason=reason)


def change(**values):
    return [Parameter(name.replace('__', '.'), value=value) for name, value in values.items()]


def parameter_file(folder: Path, text: str) -> tuple[str, str]:
    path = folder / 'params file.yaml'
    path.write_text(f'/**:\n  ros__parameters:\n    {text}\n', encoding='utf-8')
    return '--params-file', str(path)


@pytest.mark.ros
def test_without_arguments_the_values_are_the_defaults(declared):
    assert parameters.values(declared(), TABLE) == DEFAULTS


@pytest.mark.ros
def test_descriptions_show_range_unit_effect_and_choices(declared):
    node = declared()
    described = {e.name: node.describe_parameter(e.name) for e in TABLE}

    speed = described['launch.speed']
    (span,) = speed.floating_point_range
    assert (speed.type, span.from_value, span.to_value) == (Parameter.Type.DOUBLE.value, 0, 200)
    assert speed.description == (
        'Speed over the ground. Unit: m/s. A change counts from the next throw on.'
    )
    seed = described['imu.seed']
    (span,) = seed.integer_range
    assert (seed.type, span.from_value) == (Parameter.Type.INTEGER.value, 0)
    assert span.to_value == 2**63 - 1
    assert described['model'].additional_constraints == 'exact, constant_spin, precession'
    assert described['imu.offset'].type == Parameter.Type.DOUBLE_ARRAY.value
    assert described['imu.offset'].additional_constraints == '3 numbers from -10 to 10'
    assert 'twice' in described['wind.reference_height'].additional_constraints
    for entry in TABLE:
        assert described[entry.name].read_only == (entry.effect == 'fixed')
        assert not described[entry.name].dynamic_typing
        assert (f'Unit: {entry.unit}.' in described[entry.name].description) == bool(entry.unit)


@pytest.mark.ros
def test_the_file_of_the_package_is_taken_whole(declared):
    node = declared('--params-file', str(ROOT / 'config/sim.yaml'), name='other', namespace='/a/b')
    assert parameters.values(node, TABLE) == DEFAULTS
    parameters.refuse_unused(node)


@pytest.mark.ros
def test_values_come_from_file_command_line_and_constructor(declared, tmp_path):
    node = declared(
        *parameter_file(tmp_path, 'launch: {speed: 20.5, pitch: 3.5}\n    wind.y: -2.5'),
        '-p', 'launch.pitch:=4.5', '-p', 'frame_prefix:=red/', '-p', 'ground:=false',
        parameter_overrides=change(wind__seed=7, imu__gyroscope_bias=[0.5, 0.0, 0.0]),
    )  # fmt: skip
    assert parameters.values(node, TABLE) == DEFAULTS | {
        'launch.speed': 20.5,
        'launch.pitch': 4.5,
        'wind.y': -2.5,
        'frame_prefix': 'red/',
        'ground': False,
        'wind.seed': 7,
        'imu.gyroscope_bias': (0.5, 0.0, 0.0),
    }


@pytest.mark.ros
def test_an_integer_will_do_for_a_double(declared, tmp_path):
    node = declared(
        *parameter_file(tmp_path, 'physics_rate: 2000\n    imu: {offset: [0, 0, 1]}'),
        '-p', 'launch.speed:=20',
        parameter_overrides=change(gravity=9),
    )  # fmt: skip
    values = parameters.values(node, TABLE)
    assert (values['physics_rate'], values['launch.speed'], values['gravity']) == (2000, 20, 9)
    assert type(values['physics_rate']) is float
    assert values['imu.offset'] == (0.0, 0.0, 1.0)
    assert node.describe_parameter('physics_rate').type == Parameter.Type.DOUBLE.value
    assert configuration(values).setup.step == 5e-4


@pytest.mark.ros
@pytest.mark.parametrize(
    ('line', 'message'),
    [
        ('launch.sped: 3.0', 'launch.sped: 3 is not allowed; .* did you mean launch.speed?'),
        ('launch: {angle_of_atack: 3}', 'did you mean launch.angle_of_attack?'),
        ('use_simtime: true', 'use_simtime: True is not allowed; there is no such parameter'),
        ('launch.speed: fast', "launch.speed: 'fast' is not allowed; give a number from 0 to 200"),
        ('launch.speed: true', 'launch.speed: True is not allowed'),
        ('launch.speed: [1.0]', 'launch.speed: .* is not allowed'),
        ('launch.speed: -1', 'launch.speed: -1 is not allowed; give a number from 0 to 200 m/s'),
        ('launch.speed: 200.0001', 'launch.speed: 200.0001 is not allowed'),
        ('launch.speed: .nan', 'launch.speed: nan is not allowed'),
        ('launch.speed: -.inf', 'launch.speed: -inf is not allowed'),
        ('launch.speed: 1e400', "launch.speed: '1e400' is not allowed"),
        ('wind.seed: 3.0', 'wind.seed: 3 is not allowed; give a whole number from 0'),
        ('wind.seed: 9223372036854775808', 'give a whole number from 0 to 9223372036854775807'),
        ('ground: 1', 'ground: 1 is not allowed; give true or false'),
        ('model: rigid', "model: 'rigid' is not allowed; choose from exact"),
        ('disc: 1', 'disc: 1 is not allowed; give a text'),
        ('imu.offset: []', 'imu.offset: None is not allowed; give 3 numbers'),
        ('imu.offset: [1.0, 2.0]', 'imu.offset: .* is not allowed; give 3 numbers'),
        ('imu.offset: [.nan, 0.0, 0.0]', 'imu.offset: .nan, 0.0, 0.0. is not allowed'),
    ],
)
def test_a_bad_file_is_refused_in_one_line_and_nothing_declared(new_node, tmp_path, line, message):
    node = new_node(*parameter_file(tmp_path, line))
    with pytest.raises(ConfigError, match=message) as refused:
        parameters.declare(node, TABLE)
    assert '\n' not in str(refused.value)
    assert not any(node.has_parameter(name) for name in DEFAULTS)


@pytest.mark.ros
@pytest.mark.parametrize('source', ['command line', 'constructor', 'context'])
def test_a_misspelt_name_is_refused_wherever_it_comes_from(ros_environment, tmp_path, source):
    rclpy = pytest.importorskip('rclpy')
    arguments = ['--ros-args', '-p', 'launch.sped:=3.0']
    context = rclpy.Context()
    context.init(args=arguments if source == 'context' else [])
    try:
        node = Node(
            'sim_node',
            context=context,
            cli_args=arguments if source == 'command line' else None,
            parameter_overrides=change(launch__sped=3.0) if source == 'constructor' else None,
        )
        with pytest.raises(ConfigError, match=r'launch\.sped: 3 .* did you mean launch\.speed\?'):
            parameters.declare(node, TABLE)
        node.destroy_node()
    finally:
        context.try_shutdown()


@pytest.mark.ros
def test_parameters_of_ros_itself_are_taken(declared, tmp_path):
    lines = (
        'use_sim_time: true\n    start_type_description_service: false\n'
        '    qos_overrides./chatter.publisher.depth: 7'
    )
    node = declared(*parameter_file(tmp_path, lines))
    assert node.get_parameter('use_sim_time').value
    options = QoSOverridingOptions.with_default_policies()
    node.create_publisher(Empty, '/chatter', 10, qos_overriding_options=options)
    assert node.get_parameter('qos_overrides./chatter.publisher.depth').value == 7
    parameters.refuse_unused(node)


@pytest.mark.ros
def test_a_misspelt_quality_of_service_is_refused_in_the_end(declared):
    node = declared('-p', 'qos_overrides./chater.publisher.depth:=7')
    options = QoSOverridingOptions.with_default_policies()
    node.create_publisher(Empty, '/chatter', 10, qos_overriding_options=options)
    with pytest.raises(
        ConfigError, match=r'did you mean qos_overrides\./chatter\.publisher\.depth'
    ):
        parameters.refuse_unused(node)


@pytest.mark.ros
@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        (
            change(wind__x=3.0, launch__height=-1.0),
            'launch.height: -1 is not allowed; with ground',
        ),
        (
            change(wind__x=3.0, publish_rate=300.0),
            'publish_rate: 300 is not allowed; physics_rate',
        ),
        (change(wind__x=3.0, disc='wraith', aero='linear'), 'aero: .* disc wraith holds no such'),
        (change(wind__x=3.0, disc='frisby'), 'did you mean frisbee'),
        (change(wind__x=3.0, imu__offset=[0.0, math.inf, 0.0]), 'imu.offset: .* give 3 numbers'),
        (change(wind__x=3.0, imu__offset=[0.0]), 'imu.offset: .* give 3 numbers'),
        (change(wind__x=3.0, launch__speed=200.0001), 'launch.speed: 200.0001 is not allowed'),
        (change(wind__x=3.0, launch__speed=math.nan), 'launch.speed out of range'),
        (change(wind__x=3.0, launch__speed=-math.inf), 'launch.speed out of range'),
        (change(wind__x=3.0, wind__seed=-1), 'wind.seed out of range'),
        (change(wind__x=3.0, launch__speed='fast'), "expected 'Type.DOUBLE' got 'Type.STRING'"),
        (change(wind__x=3.0, wind__seed=1.0), "expected 'Type.INTEGER' got 'Type.DOUBLE'"),
        (change(wind__x=3.0, ground=1), "expected 'Type.BOOL' got 'Type.INTEGER'"),
        (change(wind__x=3.0, launch__speed=None), 'cannot be undeclared'),
        (change(wind__x=3.0, frame_prefix='red/'), 'read-only parameter: frame_prefix'),
    ],
)
def test_an_impossible_change_is_refused_as_a_whole(declared, changes, reason):
    node = declared()
    result = node.set_parameters_atomically(changes)
    assert not result.successful
    assert '\n' not in result.reason
    assert re.search(reason, result.reason)
    assert parameters.values(node, TABLE) == DEFAULTS


@pytest.mark.ros
def test_a_change_that_is_only_possible_together_is_taken(declared):
    node = declared()
    alone, _ = node.set_parameters(change(physics_rate=300.0, wind__x=1.0))
    assert not alone.successful
    together = change(physics_rate=300.0, publish_rate=100.0, ground=False, launch__height=-5.0)
    assert node.set_parameters_atomically(together).successful
    config = configuration(parameters.values(node, TABLE))
    assert (config.steps_per_publish, config.launch.height, config.ground) == (3, -5.0, False)


@pytest.mark.ros
def test_a_change_is_judged_with_the_present_values(declared):
    node = declared('-p', 'ground:=false', '-p', 'launch.height:=-5')
    result = node.set_parameters_atomically(change(ground=True))
    assert result.reason.startswith('launch.height: -5 is not allowed; with ground')
    assert node.set_parameters_atomically(change(launch__height=-6.0)).successful


@pytest.mark.ros
def test_parameters_of_ros_itself_may_change(declared):
    node = declared()
    assert node.set_parameters_atomically(change(use_sim_time=True)).successful


@pytest.mark.ros
def test_through_the_services_of_the_node(declared, new_node, ros_context):
    """As `ros2 param` asks: describe, and set a double to an integer and a list to integers."""
    node, asker = declared(), new_node(name='asker')
    executor = SingleThreadedExecutor(context=ros_context)
    executor.add_node(node)
    executor.add_node(asker)
    client = AsyncParameterClient(asker, 'sim_node')

    def answer(future):
        executor.spin_until_future_complete(future, timeout_sec=10.0)
        return future.result()

    try:
        assert client.wait_for_services(10.0)
        (described,) = answer(client.describe_parameters(['launch.spin'])).descriptors
        assert described.floating_point_range[0].to_value == 1000.0
        assert 'Unit: rad/s.' in described.description

        numbers = change(launch__speed=20, imu__offset=[0, 0, 1])
        assert answer(client.set_parameters_atomically(numbers)).result.successful
        values = parameters.values(node, TABLE)
        assert (values['launch.speed'], values['imu.offset']) == (20.0, (0.0, 0.0, 1.0))
        assert type(values['launch.speed']) is float

        doubles = change(imu__offset=[0.5, 0.0, 0.0])
        assert answer(client.set_parameters_atomically(doubles)).result.successful
        assert parameters.values(node, TABLE)['imu.offset'] == (0.5, 0.0, 0.0)

        (result,) = answer(client.set_parameters(change(publish_rate=300))).results
        assert result.reason.startswith('publish_rate: 300 is not allowed; physics_rate 1000 Hz')
        assert parameters.values(node, TABLE)['publish_rate'] == 200.0
    finally:
        executor.shutdown()
