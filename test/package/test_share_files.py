"""Launch files, URDF, RViz configuration and package.xml agree with the code.

ROS's `launch` is not among the wheels on PyPI, so the launch files run with stand-ins that keep
what they are made with; where the real one is there, it reads them too.
"""

import ast
import importlib.util
import math
from pathlib import Path
import re
import sys
from types import ModuleType, SimpleNamespace
import xml.etree.ElementTree as ET

import pytest
import yaml

pytest.importorskip('rclpy')

from disc_sim_ros import topics
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.recorder.options import RECORDER_TABLE
from disc_sim_ros.ros.sim import markers
from disc_sim_ros.ros.sim.config import configuration
from disc_sim_ros.ros.sim.parameters import TABLE
from disc_sim_ros.topics import Frames

ROOT = Path(__file__).parents[2]
PACKAGE = 'disc_sim_ros'
ON_DEMAND = {'rviz2', 'robot_state_publisher'}  # not in package.xml
NAMES = [entry.name for entry in TABLE]
FRAMES = Frames()


# ---- launch files ----


class Made:
    """Anything of launch: keeps what it was made with."""

    def __init__(self, *args, **kwargs):
        self.kind = type(self).__name__
        self.args = args
        self.kwargs = kwargs


class StandIn(ModuleType):
    """A module that has every class."""

    def __getattr__(self, name):
        if name.startswith('__'):
            raise AttributeError(name)
        setattr(self, name, type(name, (Made,), {}))
        return getattr(self, name)


@pytest.fixture
def load(monkeypatch):
    """A function that loads a launch file with stand-ins for launch."""
    for name in (
        'launch',
        'launch.actions',
        'launch.conditions',
        'launch.launch_description_sources',
        'launch.substitutions',
        'launch_ros',
        'launch_ros.actions',
        'launch_ros.parameter_descriptions',
    ):
        monkeypatch.setitem(sys.modules, name, StandIn(name))
    return load_file


def load_file(name):
    spec = importlib.util.spec_from_file_location(name.partition('.')[0], ROOT / 'launch' / name)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def contents(module) -> list:
    return module.generate_launch_description().args[0]


def arguments(module) -> dict[str, dict]:
    return {
        made.args[0]: made.kwargs
        for made in contents(module)
        if made.kind == 'DeclareLaunchArgument'
    }


def context(module, **given: str) -> SimpleNamespace:
    """What a launch file finds when it was started with some arguments."""
    declared = arguments(module)
    assert given.keys() <= declared.keys()
    defaults = {name: kwargs['default_value'] for name, kwargs in declared.items()}
    return SimpleNamespace(launch_configurations=defaults | given)


def sim_node(nodes: list) -> dict:
    return next(node.kwargs for node in nodes if node.kwargs['package'] == PACKAGE)


def test_every_parameter_is_an_argument_that_tells_its_unit_and_default(load):
    told = arguments(load('sim.launch.py'))
    assert list(told) == ['namespace', 'params_file', 'rviz', 'robot_state_publisher', *NAMES]
    for entry in TABLE:
        text = told[entry.name]['description']
        assert entry.unit in text
        default = list(entry.default) if isinstance(entry.default, tuple) else entry.default
        assert text.endswith(f'default {default!r}]')
    assert '0 to 200 m/s' in told['launch.speed']['description']


def test_the_parameter_file_is_the_one_with_the_defaults(load):
    file = Path(arguments(load('sim.launch.py'))['params_file']['default_value'])
    assert file == ROOT / 'config/sim.yaml'
    given = yaml.safe_load(file.read_text(encoding='utf-8'))['/**']['ros__parameters']
    assert configuration(flat(given)) == configuration({})


def flat(tree: dict, before: str = '') -> dict:
    found = {}
    for key, value in tree.items():
        found |= (
            flat(value, f'{before}{key}.') if isinstance(value, dict) else {before + key: value}
        )
    return found


def test_an_argument_that_is_not_given_leaves_the_file_alone(load):
    module = load('sim.launch.py')
    file, given = sim_node(module.nodes(context(module)))['parameters']
    assert file.args == ('params_file',)
    assert given == {}


def test_arguments_come_after_the_file_and_mean_what_they_say(load):
    module = load('sim.launch.py')
    some = {
        'disc': 'wraith',
        'launch.speed': '20',
        'launch.pitch': '-3.5',
        'auto_throw': 'false',
        'wind.seed': '7',
        'imu.offset': '[0.0, 0.1, 0.0]',
        'frame_prefix': 'red/',
    }
    parameters = sim_node(module.nodes(context(module, **some)))['parameters']
    assert parameters[0].args == ('params_file',)
    config = configuration(parameters[1])
    assert config.setup.disc.name == 'wraith'
    assert (config.launch.speed, config.launch.pitch) == (20.0, -3.5)
    assert config.auto_throw is False
    assert config.setup.wind.seed == 7
    assert config.imu.offset == (0.0, 0.1, 0.0)
    assert config.frame_prefix == 'red/'


def test_every_node_of_the_launch_file_can_be_started(load):
    module = load('sim.launch.py')
    for node in (node.kwargs for node in module.nodes(context(module))):
        assert node['namespace'].args == ('namespace',)
        if node['package'] == PACKAGE:
            assert node['executable'] in executables()
            assert 'condition' not in node
        else:
            assert node['package'] == node['executable']
            assert node['package'] in ON_DEMAND
            assert node['condition'].kind == 'IfCondition'
    assert arguments(module)['rviz']['default_value'] == 'false'
    assert arguments(module)['robot_state_publisher']['default_value'] == 'false'


def test_the_helpers_get_existing_files_and_the_time_and_prefix_of_the_simulator(load):
    module = load('sim.launch.py')
    given = context(module, publish_clock='true', frame_prefix='red/')
    _, rviz, publisher = (node.kwargs for node in module.nodes(given))
    assert rviz['arguments'] == ['-d', str(ROOT / 'rviz/disc.rviz')]
    assert Path(rviz['arguments'][1]).is_file()
    assert rviz['parameters'] == [{'use_sim_time': True}]
    sim_time, description = publisher['parameters']
    assert sim_time == {'use_sim_time': True}
    assert description['frame_prefix'].args == ('red/',)
    assert ET.fromstring(description['robot_description'].args[0]).tag == 'robot'
    assert all(made.kwargs == {'value_type': str} for made in description.values())
    assert publisher['remappings'][0][0] == topics.TF


def test_all_is_recorded_as_mcap(load):
    module = load('sim_and_recorder.launch.py')
    given = arguments_of_both(load)
    for bag in ('', 'my bag'):
        given.launch_configurations['bag'] = bag
        recorder, _ = module.record_and_throw(given)
        assert recorder.kwargs['executable'] == 'recorder_node'
        assert recorder.kwargs['parameters'] == [{'bag': bag}]
        assert recorder.kwargs['parameters'][0].keys() <= {e.name for e in RECORDER_TABLE}


def arguments_of_both(load) -> SimpleNamespace:
    """The defaults of both files, as the recorder's finds them after including the simulator's."""
    both = [context(load(name)) for name in ('sim.launch.py', 'sim_and_recorder.launch.py')]
    merged = both[0].launch_configurations | both[1].launch_configurations
    return SimpleNamespace(launch_configurations=merged)


def test_the_simulator_of_the_recorder_waits_for_the_throw(load):
    module = load('sim_and_recorder.launch.py')
    include = next(made for made in contents(module) if made.kind == 'IncludeLaunchDescription')
    assert Path(include.args[0].args[0]) == ROOT / 'launch/sim.launch.py'
    passed_on = dict(include.kwargs['launch_arguments'])
    assert passed_on == {'auto_throw': 'false'}
    assert passed_on.keys() <= set(NAMES)


@pytest.mark.parametrize(
    ('namespace', 'service'),
    [
        ('', '/sim_node/throw'),
        ('red', '/red/sim_node/throw'),
        ('/red', '/red/sim_node/throw'),
        ('a/b/', '/a/b/sim_node/throw'),
    ],
)
def test_the_recorder_is_given_time_before_the_throw(load, namespace, service):
    module = load('sim_and_recorder.launch.py')
    given = arguments_of_both(load)
    given.launch_configurations['namespace'] = namespace
    _, later = module.record_and_throw(given)
    assert later.kwargs['period'] == 3.0
    (call,) = later.kwargs['actions']
    assert call.kwargs['cmd'] == ['ros2', 'service', 'call', service, 'std_srvs/srv/Trigger']
    source = (ROOT / PACKAGE / 'ros/sim/services.py').read_text(encoding='utf-8')
    assert "create_service(Trigger, '~/throw'" in source
    given.launch_configurations['throw_after'] = '-1'
    assert len(module.record_and_throw(given)) == 1


def test_launch_itself_reads_the_files():
    pytest.importorskip('launch_ros', reason='not among the wheels on PyPI')
    for name in ('sim.launch.py', 'sim_and_recorder.launch.py'):
        assert load_file(name).generate_launch_description().get_launch_arguments()


# ---- URDF ----


@pytest.fixture(scope='module')
def urdf() -> ET.Element:
    return ET.parse(ROOT / 'urdf/disc.urdf').getroot()


def numbers(text: str) -> list[float]:
    return [float(number) for number in text.split()]


def test_links_and_joint_have_the_names_of_the_messages(urdf):
    assert [link.get('name') for link in urdf.iter('link')] == [FRAMES.disc, FRAMES.disc_body]
    (joint,) = urdf.iter('joint')
    assert joint.get('name') == topics.SPIN_JOINT
    assert joint.get('type') == 'continuous'
    assert joint.find('parent').get('link') == FRAMES.disc
    assert joint.find('child').get('link') == FRAMES.disc_body


def test_the_joint_turns_as_the_transform_does(urdf):
    (joint,) = urdf.iter('joint')
    axis = numbers(joint.find('axis').get('xyz'))
    assert numbers(joint.find('origin').get('xyz')) == [0.0, 0.0, 0.0]
    assert numbers(joint.find('origin').get('rpy')) == [0.0, 0.0, 0.0]
    state = Launch(spin=30.0).state()._replace(sigma=2.0)
    angle, rate = messages.spin_joint(state)
    assert rate == -30.0
    assert [math.sin(angle / 2) * x for x in axis] == [
        0.0,
        0.0,
        pytest.approx(messages.spin_transform(state)[0]),
    ]
    assert math.cos(angle / 2) == pytest.approx(messages.spin_transform(state)[1])


def test_mass_inertia_and_size_are_those_of_the_catalogue(urdf):
    disc = disc_file.load_disc('frisbee')
    (inertial,) = urdf.iter('inertial')
    assert inertial.find('mass').get('value') == f'{disc.mass:g}'
    moments = {key: float(value) for key, value in inertial.find('inertia').items()}
    x, z = disc.inertia_diametral, disc.inertia_axial
    assert moments == {'ixx': x, 'ixy': 0, 'ixz': 0, 'iyy': x, 'iyz': 0, 'izz': z}
    assert 0.0 < z <= 2.0 * x
    (cylinder,) = urdf.iter('cylinder')
    assert float(cylinder.get('radius')) == pytest.approx(disc.diameter / 2)
    assert float(cylinder.get('length')) == pytest.approx(markers.RIM_HEIGHT * disc.diameter)


def test_the_mark_is_seen_and_within_the_disc(urdf):
    mark = next(visual for visual in urdf.iter('visual') if visual.get('name') == 'mark')
    (cylinder,) = urdf.iter('cylinder')
    x, y, z = numbers(mark.find('origin').get('xyz'))
    length, width, height = numbers(next(mark.iter('box')).get('size'))
    assert (y, z) == (0.0, 0.0)
    assert x - length / 2 == 0.0
    assert math.hypot(x + length / 2, width / 2) < float(cylinder.get('radius'))
    assert height > float(cylinder.get('length'))


# ---- RViz ----


@pytest.fixture(scope='module')
def rviz() -> dict:
    return yaml.safe_load((ROOT / 'rviz/disc.rviz').read_text(encoding='utf-8'))


def displays(rviz: dict) -> dict[str, dict]:
    found = rviz['Visualization Manager']['Displays']
    return {display['Name']: display for display in found}


def test_rviz_shows_topics_that_exist_as_they_are_published(rviz):
    shown = displays(rviz)
    expected = {
        'Path': topics.PATH,
        'Disc': topics.MARKERS,
        'Field': topics.FIELD_MARKERS,
        'Pose': topics.POSE,
        'Odometry': topics.ODOM,
    }
    assert {name: shown[name]['Topic']['Value'] for name in expected} == expected
    assert {name for name, display in shown.items() if 'Topic' in display} == set(expected)
    for name in expected:
        latched = name in {'Disc', 'Field'}
        durability = 'Transient Local' if latched else 'Volatile'
        assert shown[name]['Topic']['Durability Policy'] == durability
        assert shown[name]['Topic']['Reliability Policy'] == 'Reliable'
    assert shown['RobotModel']['Description Topic']['Durability Policy'] == 'Transient Local'


def test_rviz_starts_with_what_needs_no_other_node(rviz):
    enabled = {name for name, display in displays(rviz).items() if display['Enabled']}
    assert enabled == {'Ground, 1 m', 'TF', 'Path', 'Disc', 'Field', 'Pose'}
    for display in displays(rviz).values():
        assert display['Enabled'] is display['Value']


def test_rviz_looks_at_the_ground_and_can_follow_the_disc(rviz):
    manager = rviz['Visualization Manager']
    assert manager['Global Options']['Fixed Frame'] == FRAMES.map
    assert manager['Views']['Current']['Target Frame'] == '<Fixed Frame>'
    saved = {view['Name']: view for view in manager['Views']['Saved']}
    follower = saved['Follow the disc']
    assert follower['Class'] == 'rviz_default_plugins/ThirdPersonFollower'
    assert follower['Target Frame'] == FRAMES.disc


def test_rviz_sees_a_flight_of_30_m_from_its_first_view(rviz):
    view = rviz['Visualization Manager']['Views']['Current']
    for x, y, z in ((0, 0, 0), (30, 0, 0), (15, 0, 5), (25, -5, 0), (25, 5, 0)):
        right, up, away = seen_from(view, (x, y, z))
        reach = away * math.tan(view['Field of View'] / 2)  # from the middle to the upper edge
        assert abs(up) < reach
        assert abs(right) < 4 / 3 * reach  # of a window that is 4 wide and 3 high


def seen_from(view: dict, point: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return how far right of the middle of an orbit view, above it and away a point is."""
    yaw, pitch, distance = view['Yaw'], view['Pitch'], view['Distance']
    towards_camera = (
        math.cos(yaw) * math.cos(pitch),
        math.sin(yaw) * math.cos(pitch),
        math.sin(pitch),
    )
    right = (-math.sin(yaw), math.cos(yaw), 0.0)
    up = (-math.cos(yaw) * math.sin(pitch), -math.sin(yaw) * math.sin(pitch), math.cos(pitch))
    focus = view['Focal Point']
    at = [p - focus[axis] for p, axis in zip(point, 'XYZ', strict=True)]

    def along(axis: tuple[float, float, float]) -> float:
        return sum(a * b for a, b in zip(at, axis, strict=True))

    return along(right), along(up), distance - along(towards_camera)


# ---- package.xml ----


def executables() -> set[str]:
    """The list in setup.py, read without running it."""
    for node in ast.parse((ROOT / 'setup.py').read_text(encoding='utf-8')).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == 'EXECUTABLES':
            return set(ast.literal_eval(node.value))
    raise AssertionError('setup.py has no list EXECUTABLES')


def imported(folder: str) -> set[str]:
    """Top names that the Python files of a folder import."""
    found = set()
    for path in (ROOT / folder).rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add(node.module.partition('.')[0])
    return found


# Their keys of rosdep, where these are not the names that Python imports.
KEYS = dict.fromkeys(
    ('diagnostic_msgs', 'geometry_msgs', 'nav_msgs', 'sensor_msgs', 'std_msgs', 'std_srvs'),
    'common_interfaces',
) | {'visualization_msgs': 'common_interfaces', 'yaml': 'python3-yaml'}
KEYS |= {
    name: f'python3-{name}'
    for name in (
        'distributed',
        'llvmlite',
        'lz4',
        'matplotlib',
        'numba',
        'numpy',
        'pyarrow',
        'scipy',
        'zstandard',
    )
} | {
    'mcap': 'python3-mcap-pip',
    'mcap_ros2': 'python3-mcap-ros2-support-pip',
    'PIL': 'python3-pil',
}
STARTED = {'ros2launch', 'ros2service'}  # by or as launch files


def test_package_xml_names_what_is_imported_and_started():
    package = ET.parse(ROOT / 'package.xml')
    named = {depend.text for depend in package.iter('exec_depend')}
    assert named == {KEYS.get(name, name) for name in imported_from_others()} | STARTED
    assert not named & ON_DEMAND


def imported_from_others() -> set[str]:
    """What the package and its launch files import that is not Python's own, nor ours."""
    both = imported(PACKAGE) | imported('launch')
    return both - set(sys.stdlib_module_names) - {PACKAGE}


def test_the_commands_of_the_launch_files_are_those_that_package_xml_is_told_of():
    text = (ROOT / 'launch/sim_and_recorder.launch.py').read_text(encoding='utf-8')
    assert set(re.findall(r"'ros2', '(\w+)'", text)) == {'service'}
