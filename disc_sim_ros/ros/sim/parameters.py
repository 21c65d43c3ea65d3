"""Every parameter of sim_node, in one table: name, quantity, and when a change takes effect."""

from collections.abc import Iterator, Mapping, Sequence

from disc_sim_ros.physics.disc import AERODYNAMICS, GROUND_CONTACTS
from disc_sim_ros.physics.disc_file import DEFAULT_DISC
from disc_sim_ros.physics.flight import MODELS, MOMENT_AXES, Setup
from disc_sim_ros.quantities import AIR, IMU, LAUNCH, TIMING, WIND
from disc_sim_ros.ros.parameter_spec import Effect, ParameterSpec, spec_of
from disc_sim_ros.topics import Frames

_CONSTRAINTS = {
    'height': 'at least 0 with `ground`',
    'reference_height': 'at least twice `wind.roughness_length`',
    'throw_period': '0 or at least one step',
    'physics_rate': 'high enough for `launch.spin`',
    'publish_rate': '`physics_rate` divided by a whole number',
}


def _timing(name: str, effect: Effect) -> ParameterSpec:
    return spec_of(TIMING[name], effect, constraint=_CONSTRAINTS.get(name, ''))


def _launch() -> Iterator[ParameterSpec]:
    for name, quantity in LAUNCH.items():
        constraint = _CONSTRAINTS.get(name, '')
        yield spec_of(quantity, 'next throw', f'launch.{name}', constraint)


def _wind() -> Iterator[ParameterSpec]:
    for name, quantity in WIND.items():
        tail = name.removeprefix('wind_').removeprefix('gust_')
        of_gusts = name in {'turbulence', 'gust_seed'}
        effect: Effect = 'next throw' if of_gusts else 'at once'
        yield spec_of(quantity, effect, f'wind.{tail}', _CONSTRAINTS.get(name, ''))


def _imu() -> Iterator[ParameterSpec]:
    for name, quantity in IMU.items():
        yield spec_of(quantity, 'next throw', f'imu.{name.removeprefix("imu_")}')


GROUPS: Mapping[str, Sequence[ParameterSpec]] = {
    'Disc and model': (
        ParameterSpec(
            'disc',
            DEFAULT_DISC,
            'next throw',
            'The disc: a name of the catalogue, or the path of a disc file.',
            constraint='a file ends in .yaml or .yml; a relative path starts at the folder in '
            'which the node was started',
        ),
        ParameterSpec(
            'model', Setup.model, 'next throw', 'Rigid-body model.', choices=tuple(MODELS)
        ),
        ParameterSpec(
            'aero',
            '',
            'next throw',
            "Steady coefficients; empty: the disc's own.",
            choices=('', *AERODYNAMICS),
            constraint='the disc must hold them',
        ),
        ParameterSpec(
            'moment_axes',
            Setup.moment_axes,
            'next throw',
            "Axes of the moment coefficients: the paper's axes 3 (body) or 4 (wind).",
            choices=tuple(MOMENT_AXES),
        ),
        *(spec_of(quantity, 'next throw') for quantity in AIR.values()),
        ParameterSpec(
            'ground',
            default=True,
            effect='next throw',
            meaning='End a flight where the disc crosses z = 0 from above.',
        ),
        ParameterSpec(
            'ground_contact',
            '',
            'next throw',
            "What touches the ground: centre (the paper) or rim; empty: the disc's own.",
            choices=('', *GROUND_CONTACTS),
        ),
    ),
    'Launch': tuple(_launch()),
    'Throws and commands': (
        ParameterSpec(
            'auto_throw',
            default=True,
            effect='fixed',
            meaning='Throw as soon as the node is ready; otherwise wait for `~/throw` or `throw`.',
        ),
        _timing('throw_period', 'at once'),
        _timing('command_timeout', 'at once'),
    ),
    'Rates and time': (
        _timing('physics_rate', 'next throw'),
        _timing('publish_rate', 'next throw'),
        _timing('path_rate', 'at once'),
        _timing('real_time_factor', 'at once'),
        ParameterSpec(
            'publish_clock',
            default=False,
            effect='fixed',
            meaning='Supply `/clock` to nodes that run with use_sim_time.',
        ),
        _timing('start_time', 'fixed'),
        _timing('realtime_priority', 'fixed'),
    ),
    'Wind': tuple(_wind()),
    'IMU': tuple(_imu()),
    'Frames': (
        ParameterSpec(
            'frame_prefix',
            '',
            'fixed',
            'Put as it is before the names of the frames: `red/` makes `red/disc`.',
            constraint=Frames.PREFIX_RULE,
        ),
    ),
}
TABLE = tuple(spec for group in GROUPS.values() for spec in group)
PARAMETER_OF = {spec.quantity.name: spec.name for spec in TABLE if spec.quantity is not None}
