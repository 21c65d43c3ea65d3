"""The parameters of sim_node: one table, how ROS declares it, and the configuration it means.

`python -m disc_sim_ros.nodes.parameters` prints docs/parameters.md, and with the word `yaml`
config/sim.yaml.
"""

from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
import difflib
from functools import lru_cache
import math
from pathlib import Path
import re
import sys
import textwrap
from typing import Any, Literal

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter
import yaml

from disc_sim_ros.core import axes, catalogue, check
from disc_sim_ros.core.air import Air, Wind
from disc_sim_ros.core.disc import AERODYNAMICS, Disc
from disc_sim_ros.core.errors import ConfigError
from disc_sim_ros.core.flight import MODELS, MOMENT_AXES, Setup
from disc_sim_ros.core.launch import LIMITS, Launch

Value = bool | int | float | str | tuple[float, ...]
Effect = Literal['next throw', 'at once', 'fixed']

_ZEROS = (0.0, 0.0, 0.0)
_LARGEST_SEED = 2**63 - 1
_LATEST_START = 2.1e9  # s; stamps end at 2^31 s, this leaves a year and a half
_FRAME_PREFIX = re.compile(r'([A-Za-z]\w*/)*([A-Za-z]\w*)?', re.ASCII)
_PREFIX_RULE = 'letters, digits and _ after a letter, or such parts with / after each'
_INTEGER_RATIO = 1e-9  # relative; how far physics_rate / publish_rate may be from a whole number


@dataclass(frozen=True, kw_only=True, slots=True)
class ImuConfig:
    """The IMU: where it sits and how it errs. Axes are those of `disc_body`."""

    offset: tuple[float, ...]  # m, shape (3,), from the centre of mass
    accelerometer_noise: float  # m/s^2, standard deviation of a sample
    gyroscope_noise: float  # rad/s, standard deviation of a sample
    accelerometer_bias: tuple[float, ...]  # m/s^2, shape (3,)
    gyroscope_bias: tuple[float, ...]  # rad/s, shape (3,)
    seed: int


@dataclass(frozen=True, kw_only=True, slots=True)
class SimConfig:
    """What sim_node shall do: all its parameters, checked together. Rates are in Hz, times in s.

    Attributes:
        setup: The disc, the model, the air and the step 1 / `physics_rate`.
        launch: The release.
        physics_rate: Integration steps a second.
        publish_rate: Messages of a state topic a second.
        steps_per_publish: `physics_rate` / `publish_rate`.
        real_time_factor: Simulated seconds a second; 0 is as fast as possible.
        publish_clock: Whether the node supplies `/clock`.
        start_time: First stamp; negative for the wall clock, or for 0 with `publish_clock`.
        command_timeout: Simulated time after which a command falls to zero.
        auto_throw: Whether the node throws without being asked.
        throw_period: From release to release; 0 is one throw.
        ground: Whether a flight ends where z = 0 is crossed.
        frame_prefix: What stands before the names of the frames.
        path_rate: Points of `path` a second; 0 is none.
        realtime_priority: SCHED_FIFO priority of the simulation thread; 0 is none.
        imu: The IMU.
    """

    setup: Setup
    launch: Launch
    physics_rate: float
    publish_rate: float
    steps_per_publish: int
    real_time_factor: float
    publish_clock: bool
    start_time: float
    command_timeout: float
    auto_throw: bool
    throw_period: float
    ground: bool
    frame_prefix: str
    path_rate: float
    realtime_priority: int
    imu: ImuConfig


# ---- the table ----


@dataclass(frozen=True, slots=True)
class Entry:
    """One parameter. The type of its default is its type; a tuple is an array of doubles.

    Attributes:
        name: Its name in ROS.
        default: Its value unless another is given.
        effect: When a change counts; what is 'fixed' is read-only.
        meaning: A sentence.
        unit: Of a number, and of its range.
        lowest: Least allowed number.
        highest: Greatest allowed number.
        choices: Allowed words; any text where empty.
        constraint: What else is asked for, a part of a sentence.
    """

    name: str
    default: Value
    effect: Effect
    meaning: str
    unit: str = ''
    lowest: float = -math.inf
    highest: float = math.inf
    choices: Sequence[str] = ()
    constraint: str = ''


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
            constraint=_PREFIX_RULE,
        ),
    ),
}
TABLE = tuple(entry for group in GROUPS.values() for entry in group)


# ---- values ----


def checked(values: Mapping[str, object], table: Sequence[Entry] = TABLE) -> dict[str, Any]:
    """Return a value for every parameter, each in its own range: those given, else defaults.

    Raises:
        ConfigError: A name that is not in the table, a wrong type or a value out of range.
    """
    names = [entry.name for entry in table]
    for name, value in values.items():
        if name not in names:
            raise ConfigError(name, value, _no_such(name, names))
    return {entry.name: _clean(entry, values.get(entry.name, entry.default)) for entry in table}


def configuration(values: Mapping[str, object]) -> SimConfig:
    """Return what the parameters mean together; those that are not given have their defaults.

    Raises:
        ConfigError: A value is not allowed, or not together with the others; its `thing` is the
            name of the parameter.
    """
    v = checked(values)
    try:
        return _configuration(v)
    except ConfigError as error:
        raise _in_ros_words(error, v) from None


def _no_such(name: str, names: Sequence[str]) -> str:
    tails = [known for known in names if known.endswith(f'.{name}')]
    close = tails or difflib.get_close_matches(name, names, n=1)
    guess = f', did you mean {" or ".join(close)}?' if close else ''
    return f'there is no such parameter{guess}'


def _clean(entry: Entry, value: object) -> Value:
    """Return a value as the type of the parameter; a whole number is a double where one is due."""
    name = entry.name
    match entry.default:
        case bool() if isinstance(value, bool):
            return value
        case bool():
            raise ConfigError(name, value, 'give true or false')
        case int():
            return _whole_number(entry, value)
        case float():
            return check.number(name, value, entry.lowest, entry.highest, unit=entry.unit)
        case str():
            return _text(entry, value)
    return _numbers(entry, value, len(entry.default))


def _whole_number(entry: Entry, value: object) -> int:
    match value:
        case bool():
            pass
        case int() if entry.lowest <= value <= entry.highest:
            return value
    raise ConfigError(entry.name, value, f'give a whole number from {_allowed(entry)}')


def _text(entry: Entry, value: object) -> str:
    if not isinstance(value, str):
        raise ConfigError(entry.name, value, 'give a text')
    if entry.choices and value not in entry.choices:
        raise ConfigError(entry.name, value, f'choose from {_words(entry.choices)}')
    return value


def _numbers(entry: Entry, value: object, count: int) -> tuple[float, ...]:
    allowed = f'give {_allowed(entry)} {entry.unit}'
    if not isinstance(value, list | tuple | array) or len(value) != count:
        raise ConfigError(entry.name, value, allowed)
    try:
        return tuple(check.number('', x, entry.lowest, entry.highest) for x in value)
    except ConfigError:
        raise ConfigError(entry.name, list(value), allowed) from None


# ---- values together ----


def _configuration(v: Mapping[str, Any]) -> SimConfig:
    setup = Setup(
        disc=_disc(v['disc']),
        model=v['model'],
        aero=v['aero'] or None,
        moment_axes=v['moment_axes'],
        air=Air(density=v['air_density'], gravity=v['gravity']),
        wind=_wind_of(**_group(v, 'wind')),
        step=1.0 / v['physics_rate'],
    )
    launch = Launch(**_group(v, 'launch'))
    setup.check_step(launch.spin)
    if v['ground'] and launch.height < 0.0:
        raise ConfigError('launch.height', launch.height, 'with ground, release at 0 m or above')
    if 0.0 < v['throw_period'] < setup.step:
        allowed = f'give 0 or at least one step, {setup.step:g} s'
        raise ConfigError('throw_period', v['throw_period'], allowed)
    if not _FRAME_PREFIX.fullmatch(v['frame_prefix']):
        raise ConfigError('frame_prefix', v['frame_prefix'], f'give {_PREFIX_RULE}')
    return SimConfig(
        setup=setup,
        launch=launch,
        steps_per_publish=_steps_per_publish(v['physics_rate'], v['publish_rate']),
        imu=ImuConfig(**_group(v, 'imu')),
        **{field.name: v[field.name] for field in fields(SimConfig) if field.name in v},
    )


def _group(v: Mapping[str, Any], group: str) -> dict[str, Any]:
    """Return the parameters `group.NAME` by NAME."""
    prefix = f'{group}.'
    return {name.removeprefix(prefix): x for name, x in v.items() if name.startswith(prefix)}


def _wind_of(*, x: float, y: float, z: float, **profile_and_gusts: Any) -> Wind:
    forward, right, down = (axes.paper_from_map((x, y, z)) + 0.0).tolist()  # no minus zeros
    return Wind(mean=(forward, right, down), **profile_and_gusts)


def _steps_per_publish(physics_rate: float, publish_rate: float) -> int:
    ratio = physics_rate / publish_rate
    steps = round(ratio)
    if abs(ratio - steps) <= _INTEGER_RATIO * ratio:
        return steps
    near = (physics_rate / n for n in (math.ceil(ratio), math.floor(ratio)) if n > 0)
    allowed = (
        f'physics_rate {physics_rate:g} Hz must be a whole multiple of it; '
        f'near are {" and ".join(f"{rate:.12g}" for rate in near)}'
    )
    raise ConfigError('publish_rate', publish_rate, allowed)


def _disc(name: str) -> Disc:
    try:
        return _loaded(name, _version(name))
    except ConfigError as error:
        if error.thing == 'disc':
            raise
        raise ConfigError('disc', name, str(error)) from None


@lru_cache(maxsize=8)
def _loaded(name: str, version: tuple[int, int] | None) -> Disc:
    """Load a disc once: reading the YAML takes milliseconds, in which no other thread runs."""
    return catalogue.load(name)


def _version(name: str) -> tuple[int, int] | None:
    """Return what changes when the file changes."""
    try:
        status = Path(name).stat()
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size


_ROS_NAMES = {
    'density': 'air_density',
    'step': 'physics_rate',
    **{name: f'launch.{name}' for name in LIMITS},
    **{f'wind {axis.upper()}': f'wind.{axis}' for axis in 'xyz'},
    **{name: f'wind.{name}' for name in ('roughness_length', 'turbulence', 'seed')},
    'reference_height': 'wind.reference_height',
}


def _in_ros_words(error: ConfigError, v: Mapping[str, Any]) -> ConfigError:
    """Return an error of `core` with the name and the value of the parameter."""
    name = _ROS_NAMES.get(error.thing, error.thing)
    allowed = error.allowed
    if name == 'physics_rate':
        allowed = f'its step is {error.value:g} s, and {allowed}'
    if name == 'wind.reference_height':
        allowed = f'{allowed}, at least twice wind.roughness_length'
    return ConfigError(name, v.get(name, error.value), allowed)


# ---- ROS ----

_OF_ROS = ('use_sim_time', 'start_type_description_service')
_QOS = 'qos_overrides.'
_TYPES = {
    bool: Parameter.Type.BOOL,
    int: Parameter.Type.INTEGER,
    float: Parameter.Type.DOUBLE,
    str: Parameter.Type.STRING,
    tuple: Parameter.Type.DOUBLE_ARRAY,
}
_WHEN = {
    'next throw': 'A change counts from the next throw on.',
    'at once': 'A change counts at once.',
    'fixed': 'Fixed when the node starts.',
}


def declare(node: Node, table: Sequence[Entry] = TABLE) -> None:
    """Declare the parameters of a table, with the values that came from files and command line.

    A parameter has one type for good, so that `ros2 param describe` tells type and range, and an
    integer for a double, which rclpy would refuse, is turned into one before it gets there. Call
    this before adding a callback that uses `refusal`.

    Raises:
        ConfigError: A value for a parameter that does not exist, of a wrong type or out of range;
            nothing is declared then.
    """
    given = {
        name: value
        for name, value in _overrides(node).items()
        if name not in _OF_ROS and not name.startswith(_QOS)
    }
    first = checked(given, table)
    for entry in table:
        value = _plain(first[entry.name])
        node.declare_parameter(entry.name, value, descriptor(entry), ignore_override=True)


def refuse_unused(node: Node) -> None:
    """Refuse values for parameters that nobody declared, such as a misspelt `qos_overrides`.

    Call this when all publishers and subscriptions exist: they declare those.

    Raises:
        ConfigError: There is such a value.
    """
    declared = node.list_parameters([], depth=0).names
    for name, value in _overrides(node).items():
        if name not in declared:
            raise ConfigError(name, value, _no_such(name, declared))


def values(node: Node, table: Sequence[Entry] = TABLE) -> dict[str, object]:
    """Return the present value of every parameter of a table, arrays as tuples."""
    present = {entry.name: node.get_parameter(entry.name).value for entry in table}
    return {n: tuple(x) if isinstance(x, list | array) else x for n, x in present.items()}


def refusal(node: Node, changes: Sequence[Parameter]) -> str:
    """Return why a set of changes is impossible, as a whole; empty if it is possible.

    Parameters of ROS itself, such as use_sim_time, are not looked at.
    """
    now = values(node)
    new = {change.name: change.value for change in changes if change.name in now}
    try:
        configuration({**now, **new})
    except ConfigError as error:
        return str(error)
    return ''


def widened(changes: Sequence[Parameter], table: Sequence[Entry] = TABLE) -> list[Parameter]:
    """Return changes with integers made doubles where doubles are due.

    For `add_pre_set_parameters_callback`: `ros2 param set /sim_node launch.speed 20` sends an
    integer, and rclpy would refuse it.
    """
    defaults = {entry.name: entry.default for entry in table}
    return [_wide(change, defaults.get(change.name)) for change in changes]


def _wide(change: Parameter, default: Value | None) -> Parameter:
    wide: float | list[float]
    if isinstance(default, float) and change.type_ == Parameter.Type.INTEGER:
        wide = float(change.value)
    elif isinstance(default, tuple) and change.type_ == Parameter.Type.INTEGER_ARRAY:
        wide = [float(x) for x in change.value]
    else:
        return change
    return Parameter(change.name, value=wide)


def _overrides(node: Node) -> dict[str, object]:
    """Return what files, command line and constructor gave; rclpy has no public way to ask."""
    return {p.name: p.value for p in node._parameter_overrides.values()}  # noqa: SLF001


def _plain(value: Value) -> bool | int | float | str | list[float]:
    return list(value) if isinstance(value, tuple) else value


def descriptor(entry: Entry) -> ParameterDescriptor:
    """Return a parameter as `ros2 param describe` shows it."""
    described = ParameterDescriptor(
        name=entry.name,
        type=_TYPES[type(entry.default)].value,
        description=_description(entry),
        additional_constraints=_constraints(entry),
        read_only=entry.effect == 'fixed',
    )
    match entry.default:
        case bool():
            pass
        case int():
            described.integer_range = [
                IntegerRange(from_value=int(entry.lowest), to_value=int(entry.highest), step=1)
            ]
        case float():
            described.floating_point_range = [
                FloatingPointRange(from_value=entry.lowest, to_value=entry.highest)
            ]
    return described


def _description(entry: Entry) -> str:
    unit = f' Unit: {entry.unit}.' if entry.unit else ''
    return f'{entry.meaning}{unit} {_WHEN[entry.effect]}'


def _constraints(entry: Entry) -> str:
    """Return what a range cannot say."""
    ranged = isinstance(entry.default, int | float)
    parts = [] if ranged else [_allowed(entry)]
    return '; '.join(part for part in (*parts, entry.constraint) if part)


def _allowed(entry: Entry) -> str:
    match entry.default:
        case bool():
            return 'true or false'
        case str():
            return _words(entry.choices)
        case tuple():
            return f'{len(entry.default)} numbers from {entry.lowest:g} to {entry.highest:g}'
        case int():
            return f'{entry.lowest} to {entry.highest}'
    return f'{entry.lowest:g} to {entry.highest:g}'


def _words(choices: Sequence[str]) -> str:
    return ', '.join(word or "''" for word in choices)


# ---- pages ----

_PAGE = """\
# Parameters of sim_node

<!-- Made by: python -m disc_sim_ros.nodes.parameters > docs/parameters.md -->

Give them in a file (`config/sim.yaml` holds them all), on the command line or while the node runs:

    ros2 run disc_sim_ros sim_node --ros-args --params-file my.yaml -p launch.speed:=20
    ros2 param set /sim_node launch.pitch 10

All are checked together, and a change that is impossible with the rest is refused with the reason,
as a whole: parameters that only fit together, such as `physics_rate` and `publish_rate`, go in one
`set_parameters_atomically`. A misspelt name in a file or on the command line ends the node with an
error.

In a file, `/**:` means every node; `sim_node:` would miss a node in a namespace. A whole number
will do where a double is due. ROS itself refuses a list of mixed numbers, `[0, 0.5, 0]`, so write
all of them with a point or none; reads a number that starts with 0 as octal, so that 010 is 8; and
takes an empty text on the command line only as `-p "frame_prefix:=''"`.

A parameter whose change takes effect at the next throw keeps its old meaning for the disc that is
in the air. A fixed one is read-only.
"""


def markdown() -> str:
    """Return docs/parameters.md."""
    return _PAGE + ''.join(_markdown_group(title, group) for title, group in GROUPS.items())


def _markdown_group(title: str, group: Iterable[Entry]) -> str:
    head = (
        '| parameter | default | unit | allowed | change | meaning |\n|---|---|---|---|---|---|\n'
    )
    return f'\n## {title}\n\n{head}{"".join(_markdown_row(entry) for entry in group)}'


def _markdown_row(entry: Entry) -> str:
    allowed = '; '.join(part for part in (_allowed(entry), entry.constraint) if part)
    cells = (
        f'`{entry.name}`',
        f'`{_yaml_value(entry.default)}`',
        entry.unit,
        allowed,
        entry.effect,
        entry.meaning,
    )
    return f'| {" | ".join(cells)} |\n'


def yaml_file() -> str:
    """Return config/sim.yaml: every parameter with its default."""
    lines = [
        '# Every parameter of sim_node with its default. Copy it and keep what you change.',
        '# In brackets: what is allowed, and when a change while the node runs takes effect.',
        '/**:',
        '  ros__parameters:',
    ]
    for title, group in GROUPS.items():
        lines += ['', f'    # ---- {title} ----']
        parent = ''
        for entry in group:
            *parents, key = entry.name.split('.')
            indent = ' ' * (4 + 2 * len(parents))
            if parents and parents[0] != parent:
                parent = parents[0]
                lines.append(f'    {parent}:')
            lines += _yaml_comment(entry, f'{indent}# ')
            lines.append(f'{indent}{key}: {_yaml_value(entry.default)}')
    return '\n'.join(lines) + '\n'


def _yaml_comment(entry: Entry, start: str) -> list[str]:
    allowed = f'{_allowed(entry)} {entry.unit}'.strip()
    parts = [part for part in (allowed, entry.constraint, entry.effect) if part]
    text = f'{entry.meaning} [{"; ".join(parts)}]'.replace('`', '')
    return textwrap.wrap(text, 99, initial_indent=start, subsequent_indent=start)


def _yaml_value(value: Value) -> str:
    text: str = yaml.safe_dump(_plain(value), default_flow_style=True)
    return text.removesuffix('\n').removesuffix('\n...')


def main(arguments: Sequence[str]) -> None:
    """Print docs/parameters.md, or with `yaml` config/sim.yaml."""
    pages: Mapping[str, Callable[[], str]] = {'markdown': markdown, 'yaml': yaml_file}
    page = check.choice('page', arguments[0] if arguments else 'markdown', pages)
    sys.stdout.write(pages[page]())


if __name__ == '__main__':
    main(sys.argv[1:])
