"""The launch files agree with the parameters and executables of the nodes.

PyPI has no `launch` of ROS, so the launch files run with stand-ins that keep their arguments. If
the real one is installed, it reads them too.
"""

import importlib.util
from pathlib import Path
import sys
from types import ModuleType, SimpleNamespace
import xml.etree.ElementTree as ET

import pytest
import yaml

pytest.importorskip('rclpy')

from disc_sim_ros import topics
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.ros.launch_arguments import argument_of, refuse_unknown
from disc_sim_ros.ros.recorder.options import RECORDER_TABLE
from disc_sim_ros.ros.sim.config import configuration
from disc_sim_ros.ros.sim.parameters import TABLE
from package.sources import ON_DEMAND, PACKAGE, ROOT, executables

NAMES = [argument_of(entry.name) for entry in TABLE]


class Made:
    """An object of launch that keeps the arguments of its constructor."""

    def __init__(self, *args, **kwargs):
        self.kind = type(self).__name__
        self.args = args
        self.kwargs = kwargs


class StandIn(ModuleType):
    """A module with a class for every name."""

    def __getattr__(self, name):
        if name.startswith('__'):
            raise AttributeError(name)
        setattr(self, name, type(name, (Made,), {}))
        return getattr(self, name)


@pytest.fixture
def load(monkeypatch):
    """Return a function that loads a launch file with stand-ins for launch."""
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
    """Return the context of a launch file that was started with some arguments."""
    declared = arguments(module)
    assert given.keys() <= declared.keys()
    defaults = {name: kwargs['default_value'] for name, kwargs in declared.items()}
    return SimpleNamespace(launch_configurations=defaults | given, argv=[])


def sim_node(nodes: list) -> dict:
    return next(node.kwargs for node in nodes if node.kwargs['package'] == PACKAGE)


def test_every_parameter_is_an_argument_with_unit_and_default(load):
    declared = arguments(load('sim.launch.py'))
    assert list(declared) == ['namespace', 'params_file', 'rviz', 'robot_state_publisher', *NAMES]
    for entry in TABLE:
        text = declared[argument_of(entry.name)]['description']
        assert entry.unit in text
        default = list(entry.default) if isinstance(entry.default, tuple) else entry.default
        assert text.endswith(f'default {default!r}]')
    assert '0 to 200 m/s' in declared['launch.speed']['description']


def test_the_default_parameter_file_holds_the_defaults(load):
    file = Path(arguments(load('sim.launch.py'))['params_file']['default_value'])
    assert file == ROOT / 'config/sim.yaml'
    given = yaml.safe_load(file.read_text(encoding='utf-8'))['/**']['ros__parameters']
    assert configuration(flat(given)) == configuration({})


def flat(tree: dict, before: str = '') -> dict:
    flattened = {}
    for key, value in tree.items():
        flattened |= (
            flat(value, f'{before}{key}.') if isinstance(value, dict) else {before + key: value}
        )
    return flattened


def test_an_argument_that_is_not_given_does_not_override_the_file(load):
    module = load('sim.launch.py')
    file, given = sim_node(module.nodes(context(module)))['parameters']
    assert file.args == ('params_file',)
    assert given == {}


def test_arguments_override_the_file(load):
    module = load('sim.launch.py')
    some = {
        'sim.disc': 'wraith',
        'launch.speed': '20',
        'launch.pitch': '-3.5',
        'sim.auto_throw': 'false',
        'wind.seed': '7',
        'imu.offset': '[0.0, 0.1, 0.0]',
        'sim.frame_prefix': 'red/',
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


def test_rviz_and_the_publisher_get_existing_files_and_the_time_and_prefix_of_the_simulator(load):
    module = load('sim.launch.py')
    given = context(module, **{'sim.publish_clock': 'true', 'sim.frame_prefix': 'red/'})
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


def test_the_recorder_gets_the_name_of_the_bag(load):
    module = load('sim_and_recorder.launch.py')
    given = arguments_of_both(load)
    for bag in ('', 'my bag'):
        given.launch_configurations['bag'] = bag
        recorder, throw = module.record_and_throw(given)
        assert recorder.kwargs['executable'] == 'recorder_node'
        (parameters,) = recorder.kwargs['parameters']
        assert parameters['bag'] == bag or (not bag and parameters['bag'].startswith('bags/disc_'))
        command = throw.kwargs['cmd']
        assert command[command.index('--bag') + 1] == parameters['bag']
        assert recorder.kwargs['parameters'][0].keys() <= {e.name for e in RECORDER_TABLE}


def arguments_of_both(load) -> SimpleNamespace:
    """Return the defaults of both files: that of the recorder includes that of the simulator."""
    both = [context(load(name)) for name in ('sim.launch.py', 'sim_and_recorder.launch.py')]
    merged = both[0].launch_configurations | both[1].launch_configurations
    return SimpleNamespace(launch_configurations=merged, argv=[])


def test_the_simulator_of_the_recorder_waits_for_the_throw(load):
    module = load('sim_and_recorder.launch.py')
    include = next(made for made in contents(module) if made.kind == 'IncludeLaunchDescription')
    assert Path(include.args[0].args[0]) == ROOT / 'launch/sim.launch.py'
    passed_on = dict(include.kwargs['launch_arguments'])
    assert passed_on == {'sim.auto_throw': 'false'}
    assert passed_on.keys() <= set(NAMES)


def test_the_throw_waits_for_the_recorder(load):
    module = load('sim_and_recorder.launch.py')
    given = arguments_of_both(load)
    given.launch_configurations['namespace'] = 'a/b'
    _, throw = module.record_and_throw(given)
    interpreter, option, program, *options = throw.kwargs['cmd']
    assert (interpreter, option) == (sys.executable, '-m')
    assert importlib.util.find_spec(program) is not None
    assert options[:2] == ['--namespace', 'a/b']
    given.launch_configurations['throw_after'] = '-1'
    assert len(module.record_and_throw(given)) == 1


@pytest.mark.parametrize('value', ['abc', 'nan', '5000', '', '1_5'])
@pytest.mark.parametrize(
    ('file', 'make', 'name'),
    [
        ('sim_and_recorder.launch.py', 'record_and_throw', 'throw_after'),
        ('sim_and_predictor.launch.py', 'predict_and_throw', 'noise'),
    ],
)
def test_a_bad_number_is_refused_in_one_line(load, file, make, name, value):
    """`noise:=abc` ended in 'could not convert string to float', nan reached the nodes."""
    module = load(file)
    both = [context(module), context(load('sim.launch.py'))]
    merged = both[1].launch_configurations | both[0].launch_configurations | {name: value}
    with pytest.raises(ConfigError, match=rf'^{name}: .*{value}.* [-\d]+ to \d+ [ms]$'):
        getattr(module, make)(SimpleNamespace(launch_configurations=merged, argv=[]))


@pytest.mark.parametrize('word', ['launch.sped:=20', 'disc:=wraith', 'sim.modell:=exact'])
def test_misspelt_arguments_are_refused_with_the_nearest_name(word):
    name = word.partition(':=')[0]
    with pytest.raises(ConfigError, match=f'{name}: .* did you mean (launch.speed|sim.)'):
        refuse_unknown(['rviz:=true', word], ['rviz', *NAMES], direct=True)


def test_arguments_of_an_including_file_are_its_own():
    given = ['model:=robot.urdf', 'camera.rate:=30', 'launch.speed:=20', '--debug']
    refuse_unknown(given, NAMES, direct=False)
    with pytest.raises(ConfigError, match=r'launch\.sped'):
        refuse_unknown([*given, 'launch.sped:=20'], NAMES, direct=False)
    assert not set(NAMES) & {'model', 'disc', 'ground', 'aero'}


def test_two_discs_have_scopes_of_their_own(load):
    module = load('two_discs.launch.py')
    groups = [made for made in contents(module) if made.kind == 'GroupAction']
    spaces = [made.kwargs['launch_configurations'] for made in groups]
    assert [s['namespace'] for s in spaces] == ['red', 'blue']
    for made, given in zip(groups, spaces, strict=True):
        assert (made.kwargs['scoped'], made.kwargs['forwarding']) == (True, False)
        assert given.keys() - {'namespace'} <= set(NAMES)
        for value in given.values():
            assert isinstance(value, str) or value.args[0] in arguments(module)


def test_the_real_launch_reads_the_files():
    pytest.importorskip('launch_ros', reason='not among the wheels on PyPI')
    for name in sorted(path.name for path in (ROOT / 'launch').glob('*.launch.py')):
        assert load_file(name).generate_launch_description().get_launch_arguments()
