"""One disc of the graph: its newest messages, as a page needs them."""

from collections.abc import Sequence
import math
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped, Vector3Stamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from disc_sim_ros import topics
from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.physics import flight_config, frames
from disc_sim_ros.physics.kernels.equations import State, Velocity
from disc_sim_ros.physics.kernels.rotation import rotation_elements
from disc_sim_ros.physics.trajectory import quantities
from disc_sim_ros.ros.internals import PolledSubscription
from disc_sim_ros.ros.qos import COMMAND_QOS, LATCHED_QOS, NEWEST_QOS
from disc_sim_ros.units import NANOSECONDS, System
from disc_sim_ros.view.shown import LEVEL

RARELY = 6  # updates between two looks at topics that change little
DIAMETER = 0.27  # m, of a disc whose configuration is not known
_PLACES = 4  # behind the point, of what the page gets


class LiveDisc:
    """The disc of one namespace.

    Attributes:
        namespace: Its namespace, '' for the root.
        frame: Frame of its odometry; empty before the first message.
        child_frame: Frame of the disc itself; empty before the first message.
        throw: Publisher of launches.
    """

    def __init__(self, node: Node, namespace: str) -> None:
        """Subscribe to the newest message of each topic."""
        self.namespace = namespace
        self.child_frame = ''
        self.frame = ''

        def newest(kind: type, name: str, qos: QoSProfile = NEWEST_QOS) -> PolledSubscription:
            return PolledSubscription(node, kind, f'{namespace}/{name}', qos)

        self.throw = node.create_publisher(Odometry, f'{namespace}/{topics.THROW}', COMMAND_QOS)
        self._odometry = newest(Odometry, topics.ODOM)
        self._release = newest(Odometry, topics.RELEASE, LATCHED_QOS)
        self._configuration = newest(String, topics.CONFIGURATION, LATCHED_QOS)
        self._landing = newest(PoseWithCovarianceStamped, topics.PredictorTopic.LANDING)
        self._applied_wind = newest(Vector3Stamped, topics.APPLIED_WIND)
        self._name, self._diameter = '', DIAMETER
        self._wind = (0.0, 0.0, 0.0)  # in `map` [m/s]
        self._flight = self._updates = 0
        self._start: int | None = None
        self._last: tuple[float, ...] = ()
        self._stamp = 0
        self._angle = 0.0
        self._newest: int | None = None  # stamp of the last odometry [ns]

    def about(self) -> dict[str, Any]:
        """Return what the page shows once for each flight of this disc."""
        return {
            'name': ' '.join(filter(None, (self._name, self.namespace))) or 'disc',
            'diameter': self._diameter,
            'flight': self._flight,
            'wind': list(self._wind) if any(self._wind) else None,
        }

    def update(self, system: System) -> dict[str, Any] | None:
        """Take the newest messages; return the new state of the disc, or None if it rests.

        Args:
            system: Units of the curves.
        """
        self._updates += 1
        self._take_flight()
        message = _newest(self._odometry)
        if message is None:
            return None
        numbers = _numbers(message)
        if numbers[:7] == self._last[:7] or not all(map(math.isfinite, numbers)):
            return None
        self.frame, self.child_frame = message.header.frame_id, message.child_frame_id
        stamp = _nanoseconds(message)
        was_set_back = self._newest is not None and stamp < self._newest
        self._newest = stamp
        if self._start is None or (was_set_back and stamp < self._start):  # no release is known
            self._begin(stamp)
        elif stamp < self._start:
            return None  # from before the release, which was taken first
        elif self._last:
            rate = (self._last[12] + numbers[12]) / 2.0
            self._angle += rate * (stamp - self._stamp) / NANOSECONDS
        self._last, self._stamp = numbers, stamp
        return self._state(numbers, stamp, system)

    def _take_flight(self) -> None:
        configuration = _newest(self._configuration)
        if configuration is not None:
            self._configure(configuration.data)
        wind = _newest(self._applied_wind) if self._is_turn_of_rare() else None
        if wind is not None:
            self._wind = (wind.vector.x, wind.vector.y, wind.vector.z)
        release = _newest(self._release)
        if release is not None:
            self._begin(_nanoseconds(release))

    def _is_turn_of_rare(self) -> bool:
        return self._updates % RARELY == 0

    def _configure(self, text: str) -> None:
        recorded = flight_config.document_of(text)
        if recorded is None:
            return
        try:
            setup = flight_config.from_document(recorded).setup
        except DiscSimError:  # of another version
            return
        self._name, self._diameter = setup.disc.name, setup.disc.diameter
        self._wind = frames.flip_yz(setup.wind.mean)

    def _begin(self, stamp: int) -> None:
        self._flight += 1
        self._start, self._stamp, self._last, self._angle = stamp, stamp, (), 0.0

    def _state(self, numbers: tuple[float, ...], stamp: int, system: System) -> dict[str, Any]:
        state = _state_of(numbers)
        flown = quantities(state, Velocity(*frames.flip_yz(self._wind)), self._diameter)
        curves = (
            system.number(numbers[2], 'm'),
            system.number(flown.airspeed, 'm/s'),
            math.degrees(flown.angle_of_attack),
            system.number(flown.spin_rate, 'rad/s'),
            *_pitch_and_roll(state),
        )
        values: dict[str, Any] = {
            't': round((stamp - (self._start or 0)) / NANOSECONDS, _PLACES),
            'position': [round(x, _PLACES) for x in numbers[:3]],
            'attitude': [round(x, _PLACES + 2) for x in numbers[3:7]],
            'spin': round(self._angle, _PLACES),
            'curves': [round(x, _PLACES) for x in curves],
        }
        landing = _newest(self._landing) if self._is_turn_of_rare() else None
        if landing is not None:
            at = landing.pose.pose.position
            values['landing'] = [at.x, at.y, at.z]
        return values


def _newest(subscription: PolledSubscription) -> Any:
    """Return the newest message if it was not taken yet, else None: the queues hold one."""
    taken = subscription.take()
    return None if taken is None else taken[0]


def _nanoseconds(message: Any) -> int:
    stamp = message.header.stamp
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def _state_of(numbers: Sequence[float]) -> State:
    """Return the state of an Odometry, spin angle 0; level where there is no attitude.

    `frames.states_from_odometry` is the same for arrays, at twenty times the cost for one state.
    """
    x, y, z, qx, qy, qz, qw, u, v, w, p, q, r = numbers
    norm = math.hypot(qx, qy, qz, qw)
    e = (qw / norm, *frames.flip_yz((qx / norm, qy / norm, qz / norm))) if norm else LEVEL
    velocity = frames.earth_from_body(e, frames.flip_yz((u, v, w)))
    at, rates = frames.flip_yz((x, y, z)), frames.flip_yz((p, q, r))
    return State(*at, *velocity, *e, *rates, sigma=0.0)


def _pitch_and_roll(s: State) -> tuple[float, float]:
    """Return pitch and roll as `frames.euler_from_quaternion` does [degrees]."""
    xx, _, _, yx, _, _, zx, zy, zz = rotation_elements(s.e0, s.e1, s.e2, s.e3)
    pitch = math.atan2(-zx, math.hypot(xx, yx))
    return math.degrees(pitch), math.degrees(math.atan2(zy, zz))


def _numbers(m: Any) -> tuple[float, ...]:
    """Return the numbers of an Odometry in the order of `frames.odometry`."""
    p, q = m.pose.pose.position, m.pose.pose.orientation
    v, w = m.twist.twist.linear, m.twist.twist.angular
    return (p.x, p.y, p.z, q.x, q.y, q.z, q.w, v.x, v.y, v.z, w.x, w.y, w.z)
