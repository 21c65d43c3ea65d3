"""Every parameter of sim_node, in one table: name, default, range, unit, when a change counts."""

from collections.abc import Iterator, Mapping, Sequence

from disc_sim_ros.core.air import Air, Wind
from disc_sim_ros.core.disc import AERODYNAMICS
from disc_sim_ros.core.flight import MODELS, MOMENT_AXES
from disc_sim_ros.core.launch import LIMITS, Launch
from disc_sim_ros.nodes.entry import Entry

_ZEROS = (0.0, 0.0, 0.0)
_LARGEST_SEED = 2**63 - 1
_LATEST_START = 2.1e9  # s; stamps end at 2^31 s, this leaves a year and a half
PREFIX_RULE = 'letters, digits and _ after a letter, or such parts with / after each'


def _launch() -> Iterator[Entry]:
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
        yield Entry(
            f'launch.{name}',
            getattr(Launch(), name),
            'next throw',
            meanings[name],
            unit,
            lowest,
            highest,
            constraint=constraints.get(name, ''),
        )


def _wind() -> Iterator[Entry]:
    still = Wind()
    for axis, towards in {'x': 'forward', 'y': 'left', 'z': 'up'}.items():
        meaning = f'Velocity of the air along {axis} of `map`, {towards} positive.'
        yield Entry(f'wind.{axis}', 0.0, 'at once', meaning, 'm/s', -100.0, 100.0)
    meaning = 'Roughness length of a logarithmic profile of the wind over the height; 0: none.'
    default = still.roughness_length
    yield Entry('wind.roughness_length', default, 'at once', meaning, 'm', 0.0, 10.0)
    meaning = 'Height at which the profile has the velocities x and y.'
    default = still.reference_height
    constraint = 'at least twice `wind.roughness_length`'
    yield Entry(
        'wind.reference_height', default, 'at once', meaning, 'm', 0.1, 1000.0, (), constraint
    )
    meaning = (
        'Wind at 6 m height that sets the strength of the Dryden gusts: about 8 light, '
        '15 moderate, 23 severe; 0: none.'
    )
    yield Entry('wind.turbulence', still.turbulence, 'next throw', meaning, 'm/s', 0.0, 50.0)
    meaning = 'Seed of the gusts; the same seed gives the same gusts.'
    yield Entry('wind.seed', still.seed, 'next throw', meaning, '', 0, _LARGEST_SEED)


def _imu() -> Iterator[Entry]:
    meaning = 'Where the IMU sits, from the centre of mass in `disc_body`.'
    yield Entry('imu.offset', _ZEROS, 'next throw', meaning, 'm', -10.0, 10.0)
    for name, quantity, unit, highest in (
        ('accelerometer', 'the specific force', 'm/s^2', 1000.0),
        ('gyroscope', 'the angular velocity', 'rad/s', 100.0),
    ):
        meaning = f'Standard deviation of the white noise of {quantity}, each axis and sample.'
        yield Entry(f'imu.{name}_noise', 0.0, 'next throw', meaning, unit, 0.0, highest)
        meaning = f'What is added to {quantity}, in `disc_body`.'
        yield Entry(f'imu.{name}_bias', _ZEROS, 'next throw', meaning, unit, -highest, highest)
    meaning = 'Seed of the noise; the same seed gives the same noise.'
    yield Entry('imu.seed', 0, 'next throw', meaning, '', 0, _LARGEST_SEED)


GROUPS: Mapping[str, Sequence[Entry]] = {
    'Disc and model': (
        Entry(
            'disc',
            'frisbee',
            'next throw',
            'The disc: a name of the catalogue, or the path of a disc file.',
            constraint='a file ends in .yaml or .yml; from the folder where the node was started',
        ),
        Entry('model', 'exact', 'next throw', 'Rigid-body model.', choices=tuple(MODELS)),
        Entry(
            'aero',
            '',
            'next throw',
            "Steady coefficients; empty: the disc's own.",
            choices=('', *AERODYNAMICS),
            constraint='the disc must hold them',
        ),
        Entry(
            'moment_axes',
            'body',
            'next throw',
            "Axes of the moment coefficients: the paper's axes 3 (body) or 4 (wind).",
            choices=tuple(MOMENT_AXES),
        ),
        Entry(
            'air_density', Air().density, 'next throw', 'Density of the air.', 'kg/m^3', 0.0, 100.0
        ),
        Entry(
            'gravity',
            Air().gravity,
            'next throw',
            'Acceleration of free fall.',
            'm/s^2',
            0.0,
            100.0,
        ),
        Entry(
            'ground',
            default=True,
            effect='next throw',
            meaning='End a flight where the centre of the disc crosses z = 0 from above.',
        ),
    ),
    'Launch': tuple(_launch()),
    'Throws and commands': (
        Entry(
            'auto_throw',
            default=True,
            effect='fixed',
            meaning='Throw as soon as the node is ready; otherwise wait for `~/throw` or `throw`.',
        ),
        Entry(
            'throw_period',
            0.0,
            'at once',
            'Simulated time from release to release; 0: throw once.',
            's',
            0.0,
            86400.0,
            constraint='0 or at least one step',
        ),
        Entry(
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
        Entry(
            'physics_rate',
            1000.0,
            'next throw',
            'Integration steps a simulated second.',
            'Hz',
            10.0,
            100000.0,
            constraint='high enough for `launch.spin`',
        ),
        Entry(
            'publish_rate',
            200.0,
            'next throw',
            'Messages of each state topic a simulated second.',
            'Hz',
            0.1,
            100000.0,
            constraint='`physics_rate` divided by a whole number',
        ),
        Entry(
            'path_rate',
            20.0,
            'at once',
            'Points of `path` a simulated second; 0: no path.',
            'Hz',
            0.0,
            1000.0,
        ),
        Entry(
            'real_time_factor',
            1.0,
            'at once',
            'Simulated seconds a second; 0: as fast as possible.',
            '',
            0.0,
            1000.0,
        ),
        Entry(
            'publish_clock',
            default=False,
            effect='fixed',
            meaning='Supply `/clock` to nodes that run with use_sim_time.',
        ),
        Entry(
            'start_time',
            -1.0,
            'fixed',
            'First stamp; negative: the wall clock, or 0 with `publish_clock`.',
            's',
            -1.0,
            _LATEST_START,
        ),
        Entry(
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
        Entry(
            'frame_prefix',
            '',
            'fixed',
            'Put as it is before the names of the frames: `red/` makes `red/disc`.',
            constraint=PREFIX_RULE,
        ),
    ),
}
TABLE = tuple(entry for group in GROUPS.values() for entry in group)
