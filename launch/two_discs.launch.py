"""Throw two discs side by side: ros2 launch disc_sim_ros two_discs.launch.py red.disc:=wraith.

Each has a namespace and a prefix of its frames: /red/odom with red/disc, and /blue/odom.
"""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    GroupAction,
    IncludeLaunchDescription,
    OpaqueFunction,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

from disc_sim_ros.ros.launch_arguments import is_started_directly, refuse_unknown

DISCS = {'red': {'disc': 'frisbee', 'yaw': '10'}, 'blue': {'disc': 'ultrastar', 'yaw': '-10'}}
OTHERS = {'speed': ('15', 'Speed. Unit: m/s.'), 'spin': ('31.4', 'Spin, clockwise. Unit: rad/s.')}


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and both discs."""
    return LaunchDescription(
        [*arguments(), OpaqueFunction(function=check), *(simulator(name) for name in DISCS)]
    )


def arguments() -> list[DeclareLaunchArgument]:
    """Return the arguments of each disc, such as `red.speed`."""
    own = []
    for name, of in DISCS.items():
        texts = {'disc': (of['disc'], 'The disc.'), 'yaw': (of['yaw'], 'Yaw. Unit: degrees.')}
        for key, (default, text) in (texts | OTHERS).items():
            own.append(
                DeclareLaunchArgument(f'{name}.{key}', default_value=default, description=text)
            )
    return own


def check(context: LaunchContext) -> list[OpaqueFunction]:
    """Refuse misspelt arguments."""
    known = [f'{name}.{key}' for name in DISCS for key in ('disc', 'yaw', *OTHERS)]
    refuse_unknown(context.argv, known, direct=is_started_directly(__file__))
    return []


def simulator(name: str) -> GroupAction:
    """Return the simulator of one disc, in a scope that arguments neither enter nor leave."""
    file = str(Path(__file__).with_name('sim.launch.py'))
    return GroupAction(
        [IncludeLaunchDescription(PythonLaunchDescriptionSource(file))],
        scoped=True,
        forwarding=False,
        launch_configurations={
            'namespace': name,
            'sim.frame_prefix': f'{name}/',
            'sim.disc': LaunchConfiguration(f'{name}.disc'),
            'launch.yaw': LaunchConfiguration(f'{name}.yaw'),
            'launch.speed': LaunchConfiguration(f'{name}.speed'),
            'launch.spin': LaunchConfiguration(f'{name}.spin'),
        },
    )
