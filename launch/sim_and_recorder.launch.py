"""Start sim_node and a recorder, and throw when the recorder has subscribed.

ros2 launch disc_sim_ros sim_and_recorder.launch.py bag:=my_bag launch.speed:=20

It takes all arguments of sim.launch.py except auto_throw. The bag holds every topic, as MCAP.
"""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    IncludeLaunchDescription,
    OpaqueFunction,
    TimerAction,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch_ros.actions import Node

ARGUMENTS = {
    'bag': ('', 'New folder for the bag; empty: bags/disc_DATE_TIME in the current folder.'),
    'throw_after': (
        '3.0',
        'Time before the throw, in which the recorder subscribes to all topics. Unit: s. '
        'Negative: no throw.',
    ),
}


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, the simulator, the recorder and the throw."""
    own = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    simulator = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(Path(__file__).with_name('sim.launch.py'))),
        launch_arguments={'auto_throw': 'false'}.items(),
    )
    return LaunchDescription([*own, simulator, OpaqueFunction(function=record_and_throw)])


def record_and_throw(context: LaunchContext) -> list[Node | TimerAction]:
    """Return the recorder and the delayed call of the throw."""
    arguments = context.launch_configurations
    recorder = Node(
        package='disc_sim_ros',
        executable='recorder_node',
        namespace=arguments['namespace'],
        parameters=[{'bag': arguments['bag']}],
        output='screen',
    )
    wait = float(arguments['throw_after'])
    if wait < 0.0:
        return [recorder]
    service = f'{absolute(arguments["namespace"])}/sim_node/throw'
    throw = ExecuteProcess(
        cmd=['ros2', 'service', 'call', service, 'std_srvs/srv/Trigger'], output='screen'
    )
    return [recorder, TimerAction(period=wait, actions=[throw])]


def absolute(namespace: str) -> str:
    """Return a namespace as the start of a full name."""
    return ''.join(f'/{part}' for part in namespace.split('/') if part)
