"""Every parameter of sim_node, in one table: name, default, range, unit, when a change counts."""

from collections.abc import Iterator, Mapping, Sequence

from disc_sim_ros.physics.disc import AERODYNAMICS
from disc_sim_ros.physics.environment import Air, Wind
from disc_sim_ros.physics.flight import MODELS, MOMENT_AXES
from disc_sim_ros.physics.launch import LIMITS, Launch
from disc_sim_ros.ros.parameter_spec import ParameterSpec

_ZEROS = (0.0, 0.0, 0.0)
_LARGEST_SEED = 2**63 - 1
_LATEST_START = 2.1e9  # s; stamps end at 2^31 s, this leaves a year and a half
PREFIX_RULE = 'letters, digits and _ after a letter, or such parts with / after each'


def _launch() -> Iterator[ParameterSpec]:
    meanings = {
        'speed': 'Speed over the ground.',
        'pitch': 'Pitch of the disc, nose up positive.',
        'roll': 'Roll of the disc, right edge down positive.',
        'yaw': 'Heading of the disc, right of +x of `map` positive.',
        'angle_of_attack': 'How far below the x axis of the disc the velocity points.',
        'sideslip': 'How far right of the x axis of the disc the velocity points.',
        'spin': 'Spin, clockwise from above positive.',
        'roll_rate': 'Body rate p, right edge down positive.',
        'pitch_rate': 'Body rate q, nose up positive.',
        'height': 'Height of the centre of the disc above the ground.',
    }
    constraints = {'height': 'at least 0 with `ground`'}
    for name, (lowest, highest, unit) in LIMITS.items():
        yield ParameterSpec(
            f'launch.{name}',
            getattr(Launch(), name),
            'next throw',
            meanings[name],
            unit,
            lowest,
            highest,
            constraint=constraints.get(name, ''),
        )


def _wind() -> Iterator[ParameterSpec]:
    still = Wind()
    for axis, towards in {'x': 'forward', 'y': 'left', 'z': 'up'}.items():
        meaning = f'Velocity of the air along {axis} of `map`, {towards} positive.'
        yield ParameterSpec(f'wind.{axis}', 0.0, 'at once', meaning, 'm/s', -100.0, 100.0)
    meaning = 'Roughness length of a logarithmic profile of the wind over the height; 0: none.'
    default = still.roughness_length
    yield ParameterSpec('wind.roughness_length', default, 'at once', meaning, 'm', 0.0, 10.0)
    meaning = 'Height at which the profile has the velocities x and y.'
    default = still.reference_height
    constraint = 'at least twice `wind.roughness_length`'
    yield ParameterSpec(
        'wind.reference_height', default, 'at once', meaning, 'm', 0.1, 1000.0, (), constraint
    )
    meaning = (
        'Wind at 6 m height that sets the strength of the Dryden gusts: about 8 light, '
        '15 moderate, 23 severe; 0: none.'
    )
    yield ParameterSpec(
        'wind.turbulence', still.turbulence, 'next throw', meaning, 'm/s', 0.0, 50.0
    )
    meaning = 'Seed of the gusts; the same seed gives the same gusts.'
    yield ParameterSpec('wind.seed', still.seed, 'next throw', meaning, '', 0, _LARGEST_SEED)


def _imu() -> Iterator[ParameterSpec]:
    meaning = 'Where the IMU sits, from the centre of mass in `disc_body`.'
    yield ParameterSpec('imu.offset', _ZEROS, 'next throw', meaning, 'm', -10.0, 10.0)
    for name, quantity, unit, highest in (
        ('accelerometer', 'the specific force', 'm/s^2', 1000.0),
        ('gyroscope', 'the angular velocity', 'rad/s', 100.0),
    ):
        meaning = f'Standard deviation of the white noise of {quantity}, each axis and sample.'
        yield ParameterSpec(f'imu.{name}_noise', 0.0, 'next throw', meaning, unit, 0.0, highest)
        meaning = f'What is added to {quantity}, in `disc_body`.'
        yield ParameterSpec(
            f'imu.{name}_bias', _ZEROS, 'next throw', meaning, unit, -highest, highest
        )
    meaning = 'Seed of the noise; the same seed gives the same noise.'
    yield ParameterSpec('imu.seed', 0, 'next throw', meaning, '', 0, _LARGEST_SEED)


GROUPS: Mapping[str, Sequence[ParameterSpec]] = {
    'Disc and model': (
        ParameterSpec(
            'disc',
            'frisbee',
            'next throw',
            'The disc: a name of the catalogue, or the path of a disc file.',
            constraint='a file ends in .yaml or .yml; from the folder where the node was started',
        ),
        ParameterSpec('model', 'exact', 'next throw', 'Rigid-body model.', choices=tuple(MODELS)),
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
            'body',
            'next throw',
            "Axes of the moment coefficients: the paper's axes 3 (body) or 4 (wind).",
            choices=tuple(MOMENT_AXES),
        ),
        ParameterSpec(
            'air_density', Air().density, 'next throw', 'Density of the air.', 'kg/m^3', 0.0, 100.0
        ),
        ParameterSpec(
            'gravity',
            Air().gravity,
            'next throw',
            'Acceleration of free fall.',
            'm/s^2',
            0.0,
            100.0,
        ),
        ParameterSpec(
            'ground',
            default=True,
            effect='next throw',
            meaning='End a flight where the centre of the disc crosses z = 0 from above.',
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
        ParameterSpec(
            'throw_period',
            0.0,
            'at once',
            'Simulated time from release to release; 0: throw once.',
            's',
            0.0,
            86400.0,
            constraint='0 or at least one step',
        ),
        ParameterSpec(
            'command_timeout',
            0.5,
            'at once',
            'Simulated time after which a command that is not renewed falls to zero.',
            's',
            0.001,
            3600.0,
        ),
    ),
    'Rates and time': (
        ParameterSpec(
            'physics_rate',
            1000.0,
            'next throw',
            'Integration steps a simulated second.',
            'Hz',
            10.0,
            100000.0,
            constraint='high enough for `launch.spin`',
        ),
        ParameterSpec(
            'publish_rate',
            200.0,
            'next throw',
            'Messages of each state topic a simulated second.',
            'Hz',
            0.1,
            100000.0,
            constraint='`physics_rate` divided by a whole number',
        ),
        ParameterSpec(
            'path_rate',
            20.0,
            'at once',
            'Points of `path` a simulated second; 0: no path.',
            'Hz',
            0.0,
            1000.0,
        ),
        ParameterSpec(
            'real_time_factor',
            1.0,
            'at once',
            'Simulated seconds a second; 0: as fast as possible.',
            '',
            0.0,
            1000.0,
        ),
        ParameterSpec(
            'publish_clock',
            default=False,
            effect='fixed',
            meaning='Supply `/clock` to nodes that run with use_sim_time.',
        ),
        ParameterSpec(
            'start_time',
            -1.0,
            'fixed',
            'First stamp; negative: the wall clock, or 0 with `publish_clock`.',
            's',
            -1.0,
            _LATEST_START,
        ),
        ParameterSpec(
            'realtime_priority',
            0,
            'fixed',
            'SCHED_FIFO priority of the simulation thread; 0: ordinary scheduling.',
            '',
            0,
            99,
        ),
    ),
    'Wind': tuple(_wind()),
    'IMU': tuple(_imu()),
    'Frames': (
        ParameterSpec(
            'frame_prefix',
            '',
            'fixed',
            'Put as it is before the names of the frames: `red/` makes `red/disc`.',
            constraint=PREFIX_RULE,
        ),
    ),
}
TABLE = tuple(entry for group in GROUPS.values() for entry in group)
