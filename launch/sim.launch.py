"""Start sim_node, and on demand RViz: ros2 launch disc_sim_ros sim.launch.py sim.disc:=wraith.

Every parameter of sim_node is an argument; --show-args lists them. A name without a dot gets
`sim.` in front, so that it is no argument of an including file: `sim.disc`, but `launch.speed`. A
parameter without an argument has its value of params_file. To include this file twice, put each
into a GroupAction with scoped=True and forwarding=False, as two_discs.launch.py does.
"""

from pathlib import Path
from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    OpaqueFunction,
    Shutdown,
    UnsetLaunchConfiguration,
)
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
import yaml

from disc_sim_ros import topics
from disc_sim_ros.ros.launch_arguments import argument_of, is_started_directly, refuse_unknown
from disc_sim_ros.ros.parameter_spec import ParameterSpec, allowed_text, plain
from disc_sim_ros.ros.sim.parameters import TABLE

SHARE = Path(__file__).parents[1]  # launch/, config/, rviz/ and urdf/ are side by side there
NOT_GIVEN = ''
WITH_THIS = (
    'sim_and_recorder.launch.py',
    'sim_and_predictor.launch.py',
    'two_discs.launch.py',
)  # they check their arguments

ARGUMENTS = {
    'namespace': ('', 'Namespace of all nodes, such as red.'),
    'params_file': (
        str(SHARE / 'config/sim.yaml'),
        'Parameter file of sim_node; parameters that are not in it have their defaults.',
    ),
    'rviz': ('false', 'Start RViz with rviz/disc.rviz.'),
    'robot_state_publisher': (
        'false',
        'Publish urdf/disc.urdf on robot_description, for RobotModel of RViz.',
    ),
}


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the action that starts the nodes."""
    own = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    passed_on = [
        DeclareLaunchArgument(
            argument_of(spec.name), default_value=NOT_GIVEN, description=description(spec)
        )
        for spec in TABLE
    ]
    # Otherwise a second inclusion would get the arguments of the first one.
    forgotten = [UnsetLaunchConfiguration(argument_of(spec.name)) for spec in TABLE]
    return LaunchDescription([*own, *passed_on, OpaqueFunction(function=nodes), *forgotten])


def description(spec: ParameterSpec) -> str:
    """Return the meaning of a parameter, its range and its default."""
    allowed = f'{allowed_text(spec)} {spec.unit}'.strip()
    parts = (allowed, spec.constraint, f'default {plain(spec.default)!r}')
    text = f'{spec.meaning} [{"; ".join(part for part in parts if part)}]'
    return text.replace('`', '')


def nodes(context: LaunchContext) -> list[Node]:
    """Return the nodes for the given arguments; refuse misspelt ones."""
    if is_started_directly(__file__) or not any(map(is_started_directly, WITH_THIS)):
        known = [*ARGUMENTS, *(argument_of(spec.name) for spec in TABLE)]
        refuse_unknown(context.argv, known, direct=is_started_directly(__file__))
    given = given_parameters(context.launch_configurations)
    namespace = LaunchConfiguration('namespace')
    # Not for sim_node, which must not wait for its own /clock.
    sim_time = {'use_sim_time': given.get('publish_clock', False)}
    return [
        Node(
            package='disc_sim_ros',
            executable='sim_node',
            namespace=namespace,
            parameters=[LaunchConfiguration('params_file'), given],
            output='screen',
            on_exit=Shutdown(reason='sim_node has ended'),
        ),
        Node(
            package='rviz2',
            executable='rviz2',
            namespace=namespace,
            arguments=['-d', str(SHARE / 'rviz/disc.rviz')],
            parameters=[sim_time],
            condition=IfCondition(LaunchConfiguration('rviz')),
        ),
        Node(
            package='robot_state_publisher',
            executable='robot_state_publisher',
            namespace=namespace,
            parameters=[sim_time, robot_description(given.get('frame_prefix', ''))],
            # sim_node itself sends disc to disc_body on /tf, which must have one sender only.
            remappings=[(topics.TF, 'robot_state_publisher/tf')],
            condition=IfCondition(LaunchConfiguration('robot_state_publisher')),
        ),
    ]


def given_parameters(arguments: dict[str, str]) -> dict[str, Any]:
    """Return the parameters of sim_node that are given as arguments, read as YAML."""
    given = {spec.name: arguments[argument_of(spec.name)] for spec in TABLE}
    return {name: yaml.safe_load(text) for name, text in given.items() if text != NOT_GIVEN}


def robot_description(frame_prefix: str) -> dict[str, Any]:
    """Return the parameters of robot_state_publisher; a URDF is a text, not YAML."""
    urdf = (SHARE / 'urdf/disc.urdf').read_text(encoding='utf-8')
    return {
        'robot_description': ParameterValue(urdf, value_type=str),
        'frame_prefix': ParameterValue(frame_prefix, value_type=str),
    }
