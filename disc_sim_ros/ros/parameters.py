"""The parameters of a table in ROS: declared, described, refused."""

from array import array
from collections.abc import Callable, Mapping, Sequence

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.ros.parameter_spec import (
    ParameterSpec,
    Value,
    allowed_text,
    checked,
    no_such,
    plain,
)

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


def declare(node: Node, table: Sequence[ParameterSpec]) -> None:
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
        value = plain(first[entry.name])
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
            raise ConfigError(name, value, no_such(name, declared))


def values(node: Node, table: Sequence[ParameterSpec]) -> dict[str, object]:
    """Return the present value of every parameter of a table, arrays as tuples."""
    present = {entry.name: node.get_parameter(entry.name).value for entry in table}
    return {n: tuple(x) if isinstance(x, list | array) else x for n, x in present.items()}


def refusal(
    node: Node,
    changes: Sequence[Parameter],
    table: Sequence[ParameterSpec],
    judge: Callable[[Mapping[str, object]], object],
) -> str:
    """Return why a set of changes is impossible, as a whole; empty if it is possible.

    Parameters of ROS itself, such as use_sim_time, are not looked at.

    Args:
        node: Who declared the table.
        changes: What is asked for.
        table: Its parameters.
        judge: Raises ConfigError where the values of all do not go together.
    """
    now = values(node, table)
    new = {change.name: change.value for change in changes if change.name in now}
    try:
        judge({**now, **new})
    except ConfigError as error:
        return str(error)
    return ''


def widened(changes: Sequence[Parameter], table: Sequence[ParameterSpec]) -> list[Parameter]:
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


def descriptor(entry: ParameterSpec) -> ParameterDescriptor:
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


def _description(entry: ParameterSpec) -> str:
    unit = f' Unit: {entry.unit}.' if entry.unit else ''
    return f'{entry.meaning}{unit} {_WHEN[entry.effect]}'


def _constraints(entry: ParameterSpec) -> str:
    """Return what a range cannot say."""
    ranged = isinstance(entry.default, int | float)
    parts = [] if ranged else [allowed_text(entry)]
    return '; '.join(part for part in (*parts, entry.constraint) if part)
