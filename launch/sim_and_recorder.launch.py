"""Start sim_node and a recorder, and throw when the recorder has subscribed.

ros2 launch disc_sim_ros sim_and_recorder.launch.py bag:=my_bag launch.speed:=20

It takes all arguments of sim.launch.py except sim.auto_throw. The bag holds every topic, as MCAP.
"""

from datetime import datetime
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

from disc_sim_ros.ros.launch_arguments import (
    argument_of,
    is_started_directly,
    number,
    refuse_unknown,
)
from disc_sim_ros.ros.recorder.options import default_bag
from disc_sim_ros.ros.sim.parameters import TABLE
from disc_sim_ros.validation import Quantity

THROW_AFTER = Quantity('throw_after', 's', -3600.0, 3600.0, 0.0, 'Time to the throw')
ARGUMENTS = {
    'bag': ('', 'New folder for the bag; empty: bags/disc_DATE_TIME in the current folder.'),
    'throw_after': (
        '0.0',
        'Time from the moment when the recorder records all topics to the throw. Unit: s. '
        'Negative: no throw.',
    ),
}

OF_SIMULATOR = ('namespace', 'params_file', 'rviz', 'robot_state_publisher')


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, the simulator, the recorder and the throw."""
    own = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    simulator = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(Path(__file__).with_name('sim.launch.py'))),
        launch_arguments={'sim.auto_throw': 'false'}.items(),
    )
    return LaunchDescription([*own, OpaqueFunction(function=record_and_throw), simulator])


def record_and_throw(context: LaunchContext) -> list[Node | ExecuteProcess]:
    """Return the recorder and the program that throws; refuse misspelt arguments."""
    known = [*ARGUMENTS, *OF_SIMULATOR, *(argument_of(spec.name) for spec in TABLE)]
    refuse_unknown(context.argv, known, direct=is_started_directly(__file__))
    arguments = context.launch_configurations
    namespace = arguments.get('namespace', '')
    bag = arguments['bag'] or default_bag(datetime.now().astimezone())
    recorder = Node(
        package='disc_sim_ros',
        executable='recorder_node',
        namespace=namespace,
        parameters=[{'bag': bag}],
        output='screen',
    )
    wait = number('throw_after', arguments['throw_after'], THROW_AFTER)
    if wait < 0.0:
        return [recorder]
    program = [sys.executable, '-m', 'disc_sim_ros.ros.throw_when_ready']
    options = ['--namespace', namespace, '--bag', bag, '--wait', str(wait)]
    return [recorder, ExecuteProcess(cmd=[*program, *options], output='screen')]
