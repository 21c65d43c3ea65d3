"""The parameters of sim_node in ROS: declared, described, changed and refused."""

import math
from pathlib import Path
import re

import pytest

pytest.importorskip('rclpy')

from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_msgs.msg import Empty

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.ros import parameters
from disc_sim_ros.ros.sim.config import configuration
from disc_sim_ros.ros.sim.parameters import TABLE
from ros.parameter_files import DEFAULTS, ROOT


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
        'Speed over the ground. Unit: m/s. A change takes effect at the next throw.'
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
def test_the_parameter_file_of_the_package_is_accepted(declared):
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
def test_an_integer_is_accepted_for_a_double(declared, tmp_path):
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
def test_parameters_of_ros_itself_are_accepted(declared, tmp_path):
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
def test_a_misspelt_qos_override_is_refused_after_the_publishers_exist(declared):
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
        (change(wind__x=3.0, disc='wraith', aero='linear'), 'aero: .* disc wraith has no such'),
        (change(wind__x=3.0, disc='frisby'), 'did you mean frisbee'),
        (change(wind__x=3.0, imu__offset=[0.0, math.inf, 0.0]), 'imu.offset: .* give 3 numbers'),
        (change(wind__x=3.0, imu__offset=[0.0]), 'imu.offset: .* give 3 numbers'),
        (change(wind__x=3.0, launch__speed=200.0001), 'launch.speed: 200.0001 is not allowed'),
        (change(wind__x=3.0, launch__speed=math.nan), 'launch.speed out of range'),
        (change(wind__x=3.0, launch__speed=-math.inf), 'launch.speed out of range'),
        (change(wind__x=3.0, wind__seed=-1), 'wind.seed out of range'),
        (change(wind__x=3.0, launch__speed='fast'), "expected '(Type.DOUBLE|3)' got"),
        (change(wind__x=3.0, wind__seed=1.0), "expected '(Type.INTEGER|2)' got"),
        (change(wind__x=3.0, ground=1), "expected '(Type.BOOL|1)' got"),
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
def test_changes_that_are_only_valid_together_are_accepted(declared):
    node = declared()
    alone, _ = node.set_parameters(change(physics_rate=300.0, wind__x=1.0))
    assert not alone.successful
    together = change(physics_rate=300.0, publish_rate=100.0, ground=False, launch__height=-5.0)
    assert node.set_parameters_atomically(together).successful
    config = configuration(parameters.values(node, TABLE))
    assert (config.steps_per_publish, config.launch.height, config.ground) == (3, -5.0, False)


@pytest.mark.ros
def test_a_change_is_checked_with_the_current_values(declared):
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
    """As `ros2 param` does: describe, and set a double to an integer and a list to integers."""
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
        assert described.floating_point_range[0].to_value == 1300.0
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
