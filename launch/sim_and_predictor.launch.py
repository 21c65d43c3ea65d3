"""Start sim_node and a predictor that follows it through noise, and throw when it is ready.

ros2 launch disc_sim_ros sim_and_predictor.launch.py sim.disc:=ultrastar noise:=0.02

It takes all arguments of sim.launch.py except sim.auto_throw. The predictor gets the positions and
attitudes of `odom`, with noise on the positions.
"""

from pathlib import Path
import sys

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    IncludeLaunchDescription,
    OpaqueFunction,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch_ros.actions import Node

from disc_sim_ros.quantities import PREDICTOR_NODE
from disc_sim_ros.ros.launch_arguments import (
    argument_of,
    is_started_directly,
    number,
    refuse_unknown,
)
from disc_sim_ros.ros.sim.parameters import TABLE

ARGUMENTS = {
    'noise': (
        '0.02',
        'Standard deviation of the noise of each coordinate that the predictor gets. Unit: m.',
    ),
    'predictor_file': ('', 'Parameter file of predictor_node; empty for its defaults.'),
}

OF_SIMULATOR = ('namespace', 'params_file', 'rviz', 'robot_state_publisher')


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, the simulator and the predictor."""
    own = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    simulator = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(Path(__file__).with_name('sim.launch.py'))),
        launch_arguments={'sim.auto_throw': 'false'}.items(),
    )
    return LaunchDescription([*own, OpaqueFunction(function=predict_and_throw), simulator])


def predict_and_throw(context: LaunchContext) -> list[Node | ExecuteProcess]:
    """Return the predictor of the disc and the program that throws; refuse misspelt arguments."""
    known = [*ARGUMENTS, *OF_SIMULATOR, *(argument_of(spec.name) for spec in TABLE)]
    refuse_unknown(context.argv, known, direct=is_started_directly(__file__))
    arguments = context.launch_configurations
    noise = number('noise', arguments['noise'], PREDICTOR_NODE['added_noise'])
    parameters = {
        'sources': 'odom',
        'added_noise': noise,
        'position_sigma': max(noise, 1e-3),
        'disc': arguments.get(argument_of('disc')) or 'frisbee',
        'disc_uncertainty': 0.0,
    }
    files = [arguments['predictor_file']] if arguments['predictor_file'] else []
    namespace = arguments.get('namespace', '')
    predictor = Node(
        package='disc_sim_ros',
        executable='predictor_node',
        namespace=namespace,
        parameters=[parameters, *files],
        output='screen',
    )
    program = [sys.executable, '-m', 'disc_sim_ros.ros.throw_when_ready', '--predictor']
    throw = ExecuteProcess(cmd=[*program, '--namespace', namespace], output='screen')
    return [predictor, throw]
