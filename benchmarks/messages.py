"""What a message costs from the state of the disc to the bytes that are published.

Three ways to the same bytes: a new message each time, serialised; one message that is kept and
serialised again; and `CdrTemplate`. `ratio` is new to CdrTemplate. The second table has the
conversion of the state, which comes before all three. CPU time in the best of a few rounds.

usage: benchmarks/messages.py
"""

from collections.abc import Callable
import platform
import time
from typing import Any

from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64

from disc_sim_ros.physics.kernels.equations import Velocity
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.cdr_template import CdrTemplate

ROUNDS = 9
ROUND_S = 0.05  # CPU seconds a round
STAMP = (1_700_000_000, 123_456_789)
STATE = Launch().state()
MESSAGES: dict[str, tuple[Callable[[], Any], tuple[str, ...]]] = {
    'Odometry': (lambda: Odometry(child_frame_id='disc'), messages.ODOMETRY_FIELDS),
    'PoseStamped': (PoseStamped, messages.POSE_FIELDS),
    'TransformStamped': (
        lambda: TransformStamped(child_frame_id='disc'),
        messages.TRANSFORM_FIELDS,
    ),
    'JointState': (
        lambda: JointState(name=['spin'], position=[0.0], velocity=[0.0]),
        messages.JOINT_FIELDS,
    ),
    'Imu': (Imu, messages.IMU_FIELDS),
    'Float64': (Float64, ('data',)),
}


def main() -> None:
    """Measure all types and print two tables."""
    print(f'Python {platform.python_version()}; us per message')
    print(f'{"type":18} {"new":>8} {"kept":>8} {"template":>8} {"ratio":>8}')
    for name, (make, fields) in MESSAGES.items():
        new, kept, template = (microseconds(way) for way in ways(make, fields))
        print(f'{name:18} {new:8.2f} {kept:8.2f} {template:8.3f} {new / template:8.0f}')

    print(f'\n{"from the state":32} {"us":>8}')
    for name, way in {**conversions(), 'odom + pose, to bytes': pair()}.items():
        print(f'{name:32} {microseconds(way):8.2f}')


def ways(make: Callable[[], Any], fields: tuple[str, ...]) -> list[Callable[[], bytes]]:
    """Return the three ways to the bytes of one type: new, kept and `CdrTemplate`."""
    values = tuple(0.1 * i for i in range(len(fields)))
    stamped = hasattr(make(), 'header')
    setter = writer(fields, stamped=stamped)
    message = named(make(), stamped=stamped)
    pack = CdrTemplate(message, fields, ('header.stamp',) if stamped else ()).pack

    def new() -> bytes:
        new_message = named(make(), stamped=stamped)
        setter(new_message, values)
        return serialize_message(new_message)

    def kept() -> bytes:
        setter(message, values)
        return serialize_message(message)

    return [new, kept, lambda: pack(*STAMP, *values)]


def named(message: Any, *, stamped: bool) -> Any:
    """Return a message after setting its frame to `map`."""
    if stamped:
        message.header.frame_id = 'map'
    return message


def writer(fields: tuple[str, ...], *, stamped: bool) -> Callable[[Any, tuple[float, ...]], None]:
    """Return a function that assigns each field of a message, as hand-written code would."""
    lines = [f'    message.{subscripted(path)} = values[{i}]' for i, path in enumerate(fields)]
    if stamped:
        lines += [f'    message.header.stamp.sec = {STAMP[0]}']
        lines += [f'    message.header.stamp.nanosec = {STAMP[1]}']
    made: dict[str, Any] = {}
    exec('\n'.join(['def write(message, values):', *lines]), made)  # noqa: S102 - made above
    return made['write']


def subscripted(path: str) -> str:
    """Return 'position[0]' for 'position.0'."""
    return ''.join(f'[{n}]' if n.isdigit() else f'.{n}' for n in path.split('.')).lstrip('.')


def conversions() -> dict[str, Callable[[], Any]]:
    """Return the conversions that run at the rate of publication."""
    still, none = Velocity(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return {
        'odometry(state), pose included': lambda: messages.odometry(STATE),
        'pose(state)': lambda: messages.pose(STATE),
        'spin_joint(state)': lambda: messages.spin_joint(STATE),
        'spin_transform(state)': lambda: messages.spin_transform(STATE),
        'imu(state, ...)': lambda: messages.imu(STATE, none, none, none, 9.81),
        'quantities(state, ...)': lambda: messages.quantities(STATE, still, 0.275),
    }


def pair() -> Callable[[], Any]:
    """Return the hot path: one state to the bytes of an Odometry and of a PoseStamped."""
    odom, pose = (
        CdrTemplate(named(MESSAGES[name][0](), stamped=True), MESSAGES[name][1]).pack
        for name in ('Odometry', 'PoseStamped')
    )

    def both() -> tuple[bytes, bytes]:
        values = messages.odometry(STATE)
        return odom(*STAMP, *values), pose(*STAMP, *values[:7])

    return both


def microseconds(function: Callable[[], Any]) -> float:
    """Return the CPU time of one call in the best round [us]."""
    count, seconds = 1, 0.0
    while seconds < ROUND_S:
        count *= 2
        seconds = timed(function, count)
    return 1e6 / count * min(timed(function, count) for _ in range(ROUNDS))


def timed(function: Callable[[], Any], count: int) -> float:
    """Return the CPU seconds of some calls."""
    start = time.process_time()
    for _ in range(count):
        function()
    return time.process_time() - start


if __name__ == '__main__':
    main()
