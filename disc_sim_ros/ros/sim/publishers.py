"""What the simulator publishes: a sink and a message template for each topic."""

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
from disc_sim_ros.physics.frames import flip_yz
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.ros import messages, qos
from disc_sim_ros.ros.cdr_template import CdrTemplate
from disc_sim_ros.ros.messages import Quantities, Six, moment_axes, stamp
from disc_sim_ros.ros.sim.markers import disc_bytes, field_bytes, field_markers
from disc_sim_ros.ros.sim.path import PathBytes
from disc_sim_ros.ros.sinks import Sink, SinkFactory

try:  # not among the wheels on PyPI
    from tf2_msgs.msg import TFMessage
except ImportError:
    TFMessage = None

LONGEST_PATH = 2000  # points; the oldest are removed first


class Publishers:
    """All topics that one simulator publishes.

    Attributes:
        frames: Names of the frames.
        moments: The template of `applied_moment` for each of the axes of a moment.
        spin_transform: The template of the second message of each state on `transform`.
    """

    def __init__(  # noqa: PLR0915 - a list of topics
        self, factory: SinkFactory, frames: topics.Frames, *, with_clock: bool
    ) -> None:
        """Make a sink for each topic and fill the templates; with `/clock` or without."""
        self.frames = frames
        self._node_name = factory.node_name
        map_, disc, body = frames.map, frames.disc, frames.disc_body

        def sink(name: str, message: Any, floats: tuple[str, ...] = (), **more: Any) -> Sink:
            profile = more.pop('profile', qos.STATE_QOS)
            template = CdrTemplate(message, floats, **more) if floats or more else None
            return factory.sink(type(message), name, profile, template)

        odometry = Odometry(child_frame_id=disc)
        odometry.header.frame_id = map_
        self.odom = sink(topics.ODOM, odometry, messages.ODOMETRY_FIELDS)
        pose = PoseStamped()
        pose.header.frame_id = map_
        self.pose = sink(topics.POSE, pose, messages.POSE_FIELDS)
        tilt = TransformStamped(child_frame_id=disc)
        tilt.header.frame_id = map_
        self.transform = sink(topics.TRANSFORM, tilt, messages.TRANSFORM_FIELDS)
        spin = TransformStamped(child_frame_id=body)
        spin.header.frame_id = disc
        self.spin_transform = CdrTemplate(spin, messages.SPIN_TRANSFORM_FIELDS)
        # No motor turns the joint. Behind an empty list Fast CDR leaves bytes that rosbags refuses
        joint = JointState(name=[topics.SPIN_JOINT], position=[0.0], velocity=[0.0], effort=[0.0])
        self.joint_states = sink(topics.JOINT_STATES, joint, messages.JOINT_FIELDS)
        self.imu = sink(topics.IMU, _imu_message(body), messages.IMU_FIELDS)
        wrench = WrenchStamped()
        wrench.header.frame_id = disc
        self.aero_wrench = sink(topics.AERO_WRENCH, wrench, messages.WRENCH_FIELDS)
        self.quantities = tuple(
            sink(name, Float64(), ('data',), stamps=()) for name in Quantities._fields
        )
        self.tf = None
        if TFMessage is not None:
            both = TFMessage(transforms=[tilt, spin])
            first = tuple(f'transforms.0.{path}' for path in messages.TRANSFORM_FIELDS)
            second = tuple(f'transforms.1.{path}' for path in messages.SPIN_TRANSFORM_FIELDS)
            stamps = ('transforms.0.header.stamp', 'transforms.1.header.stamp')
            self.tf = sink(topics.TF, both, first + second, stamps=stamps)
        self.clock = None
        if with_clock:
            self.clock = sink(topics.CLOCK, Clock(), stamps=('clock',), profile=qos.CLOCK_QOS)
        self._next_clock = 0.0  # by the steady clock [s]
        self.path = factory.sink(Path, topics.PATH, qos.STATE_QOS)
        self._path = PathBytes(map_, LONGEST_PATH)
        self.markers = factory.sink(MarkerArray, topics.MARKERS, qos.LATCHED_QOS)
        self.field_markers = factory.sink(MarkerArray, topics.FIELD_MARKERS, qos.LATCHED_QOS)
        self.events = factory.sink(DiagnosticStatus, topics.FLIGHT_EVENTS, qos.LATCHED_QOS)
        self.configuration = factory.sink(String, topics.CONFIGURATION, qos.LATCHED_QOS)
        self.release = factory.sink(Odometry, topics.RELEASE, qos.LATCHED_QOS)
        self._release = CdrTemplate(odometry, messages.ODOMETRY_FIELDS)
        self.applied_moment = factory.sink(WrenchStamped, topics.APPLIED_MOMENT, qos.STATE_QOS)
        self.moments = {axes: _torque_template(name) for name, axes in moment_axes(frames).items()}
        coefficients = Vector3Stamped()
        coefficients.header.frame_id = frames.disc_air
        self.applied_coefficients = sink(
            topics.APPLIED_COEFFICIENTS, coefficients, messages.VECTOR_FIELDS
        )
        wind = Vector3Stamped()
        wind.header.frame_id = map_
        self.applied_wind = sink(topics.APPLIED_WIND, wind, messages.VECTOR_FIELDS)

    @property
    def clock_is_followed(self) -> bool:
        """Return True if `/clock` has subscribers."""
        return self.clock is not None and self.clock.has_subscribers

    def publish_clock(self, nanoseconds: int, *, delay: float = -qos.CLOCK_PERIOD) -> None:
        """Publish `/clock` if it has subscribers, at most every CLOCK_PERIOD of wall time.

        Args:
            nanoseconds: The simulated time.
            delay: How long after that period to publish [s]. By default one message may come
                early, so that none is left out where calls come with just that period.
        """
        if self.clock is None or not self.clock.has_subscribers:
            return
        now = time.monotonic()
        if now >= self._next_clock + delay:
            self._next_clock = max(self._next_clock, now) + qos.CLOCK_PERIOD
            self.clock.send(*stamp(nanoseconds))

    def publish_motion(self, nanoseconds: int, s: State) -> None:
        """Publish pose, twist, transforms and joint state on the topics that have subscribers."""
        sec, ns = stamp(nanoseconds)
        if self.odom.has_subscribers:
            values = messages.odometry(s)
            self.odom.send(sec, ns, *values)
            if self.pose.has_subscribers:
                self.pose.send(sec, ns, *values[:7])
        elif self.pose.has_subscribers:
            self.pose.send(sec, ns, *messages.pose(s))
        if self.transform.has_subscribers:
            self.transform.send(sec, ns, *messages.pose(s))
            spin = self.spin_transform.pack(sec, ns, *messages.spin_transform(s))
            self.transform.publish(spin)
        if self.tf is not None and self.tf.has_subscribers:
            self.tf.send(sec, ns, *messages.pose(s), *messages.spin_transform(s))
        if self.joint_states.has_subscribers:
            self.joint_states.send(sec, ns, *messages.spin_joint(s))

    @property
    def quantities_have_subscribers(self) -> bool:
        """Return True if a topic of a quantity that the paper plots has subscribers."""
        return any(sink.has_subscribers for sink in self.quantities)

    def publish_quantities(self, quantities: Quantities) -> None:
        """Publish the quantities that the paper plots on the topics that have subscribers."""
        for sink, value in zip(self.quantities, quantities, strict=True):
            if sink.has_subscribers:
                sink.send(0, 0, value)

    def publish_imu(self, nanoseconds: int, reading: Six) -> None:
        """Publish an IMU reading in `disc_body`: rad/s, then m/s^2."""
        self.imu.send(*stamp(nanoseconds), *reading)

    def publish_aero_wrench(self, nanoseconds: int, wrench: Six) -> None:
        """Publish the aerodynamic force [N] and moment [N m] in `disc`."""
        self.aero_wrench.send(*stamp(nanoseconds), *wrench)

    def clear_path(self) -> None:
        """Remove all points of the path."""
        self._path.clear()

    def extend_path(self, nanoseconds: int, s: State) -> None:
        """Add the present pose to the path, and publish it if it has subscribers."""
        self.keep_point(nanoseconds, messages.pose(s))
        if self.path.has_subscribers:
            self.path.publish(self._path.message())

    def keep_point(self, nanoseconds: int, pose: Sequence[float]) -> None:
        """Add a pose to the path: position and quaternion x, y, z, w."""
        self._path.extend(*stamp(nanoseconds), pose)

    def publish_release(
        self, nanoseconds: int, s: State, configuration: str, diameter: float
    ) -> None:
        """Publish what a re-simulation starts from, and the markers of the release.

        Args:
            nanoseconds: The stamp.
            s: State at the release.
            configuration: YAML text of `physics.flight_config`.
            diameter: Diameter of the disc [m].
        """
        values = messages.odometry(s)
        self.release.publish(self._release.pack(*stamp(nanoseconds), *values))
        self.configuration.publish(String(data=configuration))
        self.publish_markers(s, diameter)

    def publish_markers(self, s: State, diameter: float) -> None:
        """Publish the markers of a disc with a diameter [m], and of the field, for a release."""
        self.markers.publish(disc_bytes(self.frames.disc_body, diameter))
        self.field_markers.publish(field_bytes(self.frames, diameter, messages.pose(s)[:3]))

    def publish_landing(self, release: State, touch: State, diameter: float, text: str) -> None:
        """Publish the field with the landing and a text above it."""
        start, end = (messages.pose(s)[:3] for s in (release, touch))
        self.field_markers.publish(field_markers(self.frames, diameter, start, end, text))

    def publish_event(
        self, name: str, text: str, values: Mapping[str, object], *, is_error: bool = False
    ) -> None:
        """Publish a flight event: its name, a text for people and values."""
        self.events.publish(
            DiagnosticStatus(
                level=DiagnosticStatus.ERROR if is_error else DiagnosticStatus.OK,
                name=topics.event_title(self._node_name, name),
                message=text,
                hardware_id=self.frames.disc,
                values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
            )
        )

    def publish_applied_moment(
        self, nanoseconds: int, moment: tuple[float, float, float, int]
    ) -> None:
        """Publish a moment that acts from a stamp on: L, M, N [N m] in the paper's signs, axes.

        It is published even before a subscriber is matched; re-simulation needs every input.
        """
        L, M, N, axes_of_moment = moment
        pack = self.moments[axes_of_moment].pack
        self.applied_moment.publish(pack(*stamp(nanoseconds), *flip_yz((L, M, N))))

    def publish_applied_coefficients(self, nanoseconds: int, values: tuple[float, ...]) -> None:
        """Publish coefficients that act from a stamp on, in the paper's signs."""
        self.applied_coefficients.send(*stamp(nanoseconds), *values)

    def publish_applied_wind(self, nanoseconds: int, mean: Sequence[float]) -> None:
        """Publish the mean wind that blows from a stamp on, in `map` [m/s]."""
        self.applied_wind.send(*stamp(nanoseconds), *mean)


def _torque_template(frame: str) -> CdrTemplate:
    """Return the template of a torque in a frame."""
    message = WrenchStamped()
    message.header.frame_id = frame
    return CdrTemplate(message, messages.TORQUE_FIELDS)


def _imu_message(frame: str) -> Imu:
    """Return a message that declares its orientation as not reported (REP-145)."""
    message = Imu()
    message.header.frame_id = frame
    message.orientation_covariance[0] = -1.0
    return message
