"""Start sim_node, and on demand RViz: ros2 launch disc_sim_ros sim.launch.py disc:=wraith.

Every parameter of sim_node is an argument of the same name; --show-args lists them. A parameter
without an argument has its value of params_file.
"""

from pathlib import Path
from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
import yaml

from disc_sim_ros import topics
from disc_sim_ros.ros.parameter_spec import ParameterSpec, allowed_text, plain
from disc_sim_ros.ros.sim.parameters import TABLE

SHARE = Path(__file__).parents[1]  # launch/, config/, rviz/ and urdf/ are side by side there
NOT_GIVEN = ''

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
        DeclareLaunchArgument(spec.name, default_value=NOT_GIVEN, description=description(spec))
        for spec in TABLE
    ]
    return LaunchDescription([*own, *passed_on, OpaqueFunction(function=nodes)])


def description(spec: ParameterSpec) -> str:
    """Return the meaning of a parameter, its range and its default."""
    allowed = f'{allowed_text(spec)} {spec.unit}'.strip()
    parts = (allowed, spec.constraint, f'default {plain(spec.default)!r}')
    text = f'{spec.meaning} [{"; ".join(part for part in parts if part)}]'
    return text.replace('`', '')


def nodes(context: LaunchContext) -> list[Node]:
    """Return the nodes for the given arguments."""
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
    given = {spec.name: arguments[spec.name] for spec in TABLE}
    return {name: yaml.safe_load(text) for name, text in given.items() if text != NOT_GIVEN}


def robot_description(frame_prefix: str) -> dict[str, Any]:
    """Return the parameters of robot_state_publisher; a URDF is a text, not YAML."""
    urdf = (SHARE / 'urdf/disc.urdf').read_text(encoding='utf-8')
    return {
        'robot_description': ParameterValue(urdf, value_type=str),
        'frame_prefix': ParameterValue(frame_prefix, value_type=str),
    }
