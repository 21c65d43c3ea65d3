"""What the simulator publishes: message templates filled once, and who listens."""

from collections.abc import Mapping, Sequence
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry, Path
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, String
from visualization_msgs.msg import MarkerArray

from disc_sim_ros import topics
from disc_sim_ros.physics import frames as paper_frames
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.ros import messages
from disc_sim_ros.ros import qos as ros_qos
from disc_sim_ros.ros.cdr_template import CdrTemplate
from disc_sim_ros.ros.messages import Quantities, Six, moment_axes, stamp
from disc_sim_ros.ros.sim.markers import disc_bytes, field_bytes, field_markers
from disc_sim_ros.ros.sinks import Sink, SinkFactory

try:  # not among the wheels on PyPI
    from tf2_msgs.msg import TFMessage
except ImportError:
    TFMessage = None

LONGEST_PATH = 2000  # points; the oldest go first


class Outputs:
    """All topics of one simulator."""

    def __init__(  # noqa: PLR0915 - a list of topics
        self, medium: SinkFactory, frames: topics.Frames, *, with_clock: bool
    ) -> None:
        """Open a channel for each topic and fill the templates."""
        self.frames = frames
        self._name = medium.name
        map_, disc, body = frames.map, frames.disc, frames.disc_body

        def channel(name: str, message: Any, floats: tuple[str, ...] = (), **more: Any) -> Sink:
            qos = more.pop('qos', ros_qos.STATE_QOS)
            wire = CdrTemplate(message, floats, **more) if floats or more else None
            return medium.channel(type(message), name, qos, wire)

        odometry = Odometry(child_frame_id=disc)
        odometry.header.frame_id = map_
        self.odom = channel(topics.ODOM, odometry, messages.ODOMETRY_FIELDS)
        pose = PoseStamped()
        pose.header.frame_id = map_
        self.pose = channel(topics.POSE, pose, messages.POSE_FIELDS)
        tilt = TransformStamped(child_frame_id=disc)
        tilt.header.frame_id = map_
        self.transform = channel(topics.TRANSFORM, tilt, messages.TRANSFORM_FIELDS)
        turn = TransformStamped(child_frame_id=body)
        turn.header.frame_id = disc
        self._turn = CdrTemplate(turn, messages.SPIN_TRANSFORM_FIELDS)
        joint = JointState(name=[topics.SPIN_JOINT], position=[0.0], velocity=[0.0])
        self.joint_states = channel(topics.JOINT_STATES, joint, messages.JOINT_FIELDS)
        self.imu = channel(topics.IMU, _imu_template(body), messages.IMU_FIELDS)
        wrench = WrenchStamped()
        wrench.header.frame_id = disc
        self.aero_wrench = channel(topics.AERO_WRENCH, wrench, messages.WRENCH_FIELDS)
        self.quantities = tuple(
            channel(name, Float64(), ('data',), stamps=()) for name in Quantities._fields
        )
        self.tf = None
        if TFMessage is not None:
            both = TFMessage(transforms=[tilt, turn])
            first = tuple(f'transforms.0.{path}' for path in messages.TRANSFORM_FIELDS)
            second = tuple(f'transforms.1.{path}' for path in messages.SPIN_TRANSFORM_FIELDS)
            stamps = ('transforms.0.header.stamp', 'transforms.1.header.stamp')
            self.tf = channel(topics.TF, both, first + second, stamps=stamps)
        self.clock = None
        if with_clock:
            self.clock = channel(topics.CLOCK, Clock(), stamps=('clock',), qos=ros_qos.CLOCK_QOS)
        self._next_tick = 0.0  # by the steady clock [s]
        self.path = medium.channel(Path, topics.PATH, ros_qos.STATE_QOS)
        self._path = Path()
        self._path.header.frame_id = map_
        self.markers = medium.channel(MarkerArray, topics.MARKERS, ros_qos.LATCHED_QOS)
        self.field_markers = medium.channel(MarkerArray, topics.FIELD_MARKERS, ros_qos.LATCHED_QOS)
        self.events = medium.channel(DiagnosticStatus, topics.FLIGHT_EVENTS, ros_qos.STATE_QOS)
        self.configuration = medium.channel(String, topics.CONFIGURATION, ros_qos.LATCHED_QOS)
        self.release = medium.channel(Odometry, topics.RELEASE, ros_qos.LATCHED_QOS)
        self._release = CdrTemplate(odometry, messages.ODOMETRY_FIELDS)
        self.applied_moment = medium.channel(
            WrenchStamped, topics.APPLIED_MOMENT, ros_qos.STATE_QOS
        )
        self._moments = {axes: _torque(name) for name, axes in moment_axes(frames).items()}
        coefficients = Vector3Stamped()
        coefficients.header.frame_id = frames.disc_air
        self.applied_coefficients = channel(
            topics.APPLIED_COEFFICIENTS, coefficients, messages.VECTOR_FIELDS
        )
        wind = Vector3Stamped()
        wind.header.frame_id = map_
        self.applied_wind = channel(topics.APPLIED_WIND, wind, messages.VECTOR_FIELDS)

    def tick(self, nanoseconds: int, *, patience: float = -ros_qos.CLOCK_PERIOD) -> None:
        """Publish the time, to whoever listens, every CLOCK_PERIOD of wall time at most.

        Args:
            nanoseconds: The time.
            patience: How long after that period to publish [s]. By default one tick may come
                early, so that none is left out where messages come with just that period.
        """
        if self.clock is None or not self.clock.heard:
            return
        now = time.monotonic()
        if now >= self._next_tick + patience:
            self._next_tick = max(self._next_tick, now) + ros_qos.CLOCK_PERIOD
            self.clock.send(*stamp(nanoseconds))

    def motion(self, nanoseconds: int, s: State) -> None:
        """Publish where the disc is and how it moves, to whoever listens."""
        sec, ns = stamp(nanoseconds)
        if self.odom.heard:
            values = messages.odometry(s)
            self.odom.send(sec, ns, *values)
            if self.pose.heard:
                self.pose.send(sec, ns, *values[:7])
        elif self.pose.heard:
            self.pose.send(sec, ns, *messages.pose(s))
        if self.transform.heard:
            self.transform.send(sec, ns, *messages.pose(s))
            turn = self._turn.pack(sec, ns, *messages.spin_transform(s))
            self.transform.publish(turn)
        if self.tf is not None and self.tf.heard:
            self.tf.send(sec, ns, *messages.pose(s), *messages.spin_transform(s))
        if self.joint_states.heard:
            self.joint_states.send(sec, ns, *messages.spin_joint(s))

    @property
    def quantities_heard(self) -> bool:
        """Say whether anybody listens to a quantity that the paper plots."""
        return any(channel.heard for channel in self.quantities)

    def quantities_of(self, found: Quantities) -> None:
        """Publish the quantities that the paper plots, to whoever listens."""
        for channel, value in zip(self.quantities, found, strict=True):
            if channel.heard:
                channel.send(0, 0, value)

    def measured(self, nanoseconds: int, reading: Six) -> None:
        """Publish an IMU reading in `disc_body`: rad/s, then m/s^2."""
        self.imu.send(*stamp(nanoseconds), *reading)

    def loads(self, nanoseconds: int, wrench: Six) -> None:
        """Publish the aerodynamic force [N] and moment [N m] in `disc`."""
        self.aero_wrench.send(*stamp(nanoseconds), *wrench)

    def begin_path(self) -> None:
        """Forget the trace."""
        self._path.poses = []

    def extend_path(self, nanoseconds: int, s: State) -> None:
        """Add the present pose to the trace, and publish it to whoever listens."""
        point = PoseStamped()
        point.header.frame_id = self.frames.map
        point.header.stamp.sec, point.header.stamp.nanosec = stamp(nanoseconds)
        at, turn = point.pose.position, point.pose.orientation
        at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w = messages.pose(s)
        self._path.poses.append(point)
        del self._path.poses[:-LONGEST_PATH]
        if self.path.heard:
            self._path.header.stamp = point.header.stamp
            self.path.publish(self._path)

    def released(self, nanoseconds: int, s: State, configuration: str, diameter: float) -> None:
        """Publish what a re-flight starts from, and the disc to look at."""
        values = messages.odometry(s)
        self.release.publish(self._release.pack(*stamp(nanoseconds), *values))
        self.configuration.publish(String(data=configuration))
        self.look(s, diameter)

    def look(self, s: State, diameter: float) -> None:
        """Publish the disc [m] to look at, and the field it will be thrown over from there."""
        self.markers.publish(disc_bytes(self.frames.disc_body, diameter))
        self.field_markers.publish(field_bytes(self.frames, diameter, messages.pose(s)[:3]))

    def landed(self, release: State, touch: State, diameter: float, text: str) -> None:
        """Publish the field with the landing and a text above it."""
        start, end = (messages.pose(s)[:3] for s in (release, touch))
        self.field_markers.publish(field_markers(self.frames, diameter, start, end, text))

    def event(
        self, name: str, text: str, values: Mapping[str, object], *, bad: bool = False
    ) -> None:
        """Publish something that happened once."""
        self.events.publish(
            DiagnosticStatus(
                level=DiagnosticStatus.ERROR if bad else DiagnosticStatus.OK,
                name=f'{self._name}: {name}',
                message=text,
                hardware_id=self.frames.disc,
                values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
            )
        )

    def moment_applied(self, nanoseconds: int, moment: tuple[float, float, float, int]) -> None:
        """Publish a moment that acts from a time on: L, M, N in the paper's signs, their axes.

        A re-flight needs all that acts: nobody is asked here whether who comes is known already.
        """
        L, M, N, axes_of_moment = moment
        pack = self._moments[axes_of_moment].pack
        self.applied_moment.publish(pack(*stamp(nanoseconds), *paper_frames.flip_yz((L, M, N))))

    def coefficients_applied(self, nanoseconds: int, values: tuple[float, ...]) -> None:
        """Publish coefficients that act from a time on, in the paper's signs."""
        self.applied_coefficients.send(*stamp(nanoseconds), *values)

    def wind_applied(self, nanoseconds: int, mean: Sequence[float]) -> None:
        """Publish a mean wind in `map` that blows from a time on [m/s]."""
        self.applied_wind.send(*stamp(nanoseconds), *mean)


def _torque(frame: str) -> CdrTemplate:
    """Return the template of a torque in a frame."""
    message = WrenchStamped()
    message.header.frame_id = frame
    return CdrTemplate(message, messages.TORQUE_FIELDS)


def _imu_template(frame: str) -> Imu:
    """Return a message that says it reports no orientation (REP-145)."""
    message = Imu()
    message.header.frame_id = frame
    message.orientation_covariance[0] = -1.0
    return message
