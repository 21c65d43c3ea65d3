"""Parameters of a ROS node from a table of specifications: declaration, description, refusal."""

from array import array
from collections.abc import Callable, Mapping, Sequence

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.ros.internals import parameter_overrides
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
    'next throw': 'A change takes effect at the next throw.',
    'at once': 'A change takes effect at once.',
    'fixed': 'Fixed when the node starts.',
}


def declare(node: Node, table: Sequence[ParameterSpec]) -> None:
    """Declare the parameters of a table, with the values from files and the command line.

    The type of a parameter is fixed, so that `ros2 param describe` shows type and range. rclpy
    would refuse an integer for a double; it is converted first. Call this function before adding
    a callback that uses `refusal`.

    Raises:
        ConfigError: A value is given for an unknown parameter, has the wrong type or is out of
            range; no parameter is declared then.
    """
    given = {
        name: value
        for name, value in parameter_overrides(node, [spec.name for spec in table]).items()
        if name not in _OF_ROS and not name.startswith(_QOS)
    }
    initial = checked(given, table)
    for spec in table:
        value = plain(initial[spec.name])
        node.declare_parameter(spec.name, value, descriptor(spec), ignore_override=True)


def refuse_unused(node: Node) -> None:
    """Refuse values for parameters that are not declared, such as a misspelt `qos_overrides`.

    Publishers and subscriptions declare `qos_overrides`: call this function after making them.

    Raises:
        ConfigError: A value is given for a parameter that is not declared.
    """
    declared = node.list_parameters([], depth=0).names
    for name, value in parameter_overrides(node, declared).items():
        if name not in declared:
            raise ConfigError(name, value, no_such(name, declared))


def values(node: Node, table: Sequence[ParameterSpec]) -> dict[str, object]:
    """Return the current value of every parameter of a table, arrays as tuples."""
    current = {spec.name: node.get_parameter(spec.name).value for spec in table}
    return {n: tuple(x) if isinstance(x, list | array) else x for n, x in current.items()}


def refusal(
    node: Node,
    changes: Sequence[Parameter],
    table: Sequence[ParameterSpec],
    judge: Callable[[Mapping[str, object]], object],
) -> str:
    """Return why a set of changes is refused as a whole; empty if it is allowed.

    Parameters of ROS itself, such as use_sim_time, are ignored.

    Args:
        node: The node that declared the table.
        changes: The requested changes.
        table: The parameters of the node.
        judge: Raises ConfigError where the values of all parameters contradict each other.
    """
    current = values(node, table)
    new = {change.name: change.value for change in changes if change.name in current}
    try:
        judge({**current, **new})
    except ConfigError as error:
        return str(error)
    return ''


def widened(changes: Sequence[Parameter], table: Sequence[ParameterSpec]) -> list[Parameter]:
    """Return changes with integers converted to doubles where the parameter is a double.

    For `add_pre_set_parameters_callback`: `ros2 param set /sim_node launch.speed 20` sends an
    integer, and rclpy would refuse it.
    """
    defaults = {spec.name: spec.default for spec in table}
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


def descriptor(spec: ParameterSpec) -> ParameterDescriptor:
    """Return the description that `ros2 param describe` shows."""
    described = ParameterDescriptor(
        name=spec.name,
        type=_TYPES[type(spec.default)].value,
        description=_description(spec),
        additional_constraints=_constraints(spec),
        read_only=spec.effect == 'fixed',
    )
    match spec.default:
        case bool():
            pass
        case int():
            described.integer_range = [
                IntegerRange(from_value=int(spec.lowest), to_value=int(spec.highest), step=1)
            ]
        case float():
            described.floating_point_range = [
                FloatingPointRange(from_value=spec.lowest, to_value=spec.highest)
            ]
    return described


def _description(spec: ParameterSpec) -> str:
    unit = f' Unit: {spec.unit}.' if spec.unit else ''
    return f'{spec.meaning}{unit} {_WHEN[spec.effect]}'


def _constraints(spec: ParameterSpec) -> str:
    """Return the conditions that a range of a descriptor cannot express."""
    ranged = isinstance(spec.default, int | float)
    parts = [] if ranged else [allowed_text(spec)]
    return '; '.join(part for part in (*parts, spec.constraint) if part)
