"""predictor_node: its parameters, its measurements from messages, and the node itself."""

import math
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry, Path
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from visualization_msgs.msg import MarkerArray

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.prediction.prior import ThrowPrior
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.ros.predictor import outputs
from disc_sim_ros.ros.predictor.measured import measurement, stamp_of
from disc_sim_ros.ros.predictor.node import PredictorNode
from disc_sim_ros.ros.predictor.options import node_config
from disc_sim_ros.ros.qos import STATE_QOS
from disc_sim_ros.topics import PredictorTopic
from estimation.synthetic_throws import throw
from ros.sim_process import DEADLINE

pytestmark = pytest.mark.ros

KINDS = {
    'landing': (PoseWithCovarianceStamped, PredictorTopic.LANDING),
    'path': (Path, PredictorTopic.PATH),
    'ellipse': (MarkerArray, PredictorTopic.ELLIPSE),
    'estimate': (Odometry, PredictorTopic.ESTIMATE),
    'intercept': (PoseStamped, PredictorTopic.INTERCEPT),
    'weights': (DiagnosticStatus, PredictorTopic.DISC_WEIGHTS),
}


def pose(t: float, position, axis=None) -> PoseStamped:
    """Return a message; a tilt of z to `axis`, or no attitude."""
    m = PoseStamped()
    m.header.frame_id = 'map'
    m.header.stamp.sec, m.header.stamp.nanosec = divmod(round(t * 1e9), 10**9)
    m.pose.position.x, m.pose.position.y, m.pose.position.z = map(float, position)
    q = m.pose.orientation
    q.w = 0.0
    if axis is not None:
        a = np.asarray(axis) / np.linalg.norm(axis)
        e = np.array([-a[1], a[0], 0.0, 1.0 + a[2]])
        q.x, q.y, q.z, q.w = (e / np.linalg.norm(e)).tolist()
    return m


@pytest.mark.parametrize(
    ('name', 'value', 'allowed'),
    [
        ('sources', 'odom camera', 'point, pose'),
        ('sources', '', 'point, pose'),
        ('position_sigma', 0.0, '0.0001'),
        ('disc', 'frisby', 'frisbee'),
        ('ellipse_rat', 1.0, 'ellipse_rate'),
        ('wind', (1.0, 2.0), '3 numbers'),
        ('discs', 'ultrastar frisby', 'frisbee'),
        ('intercept_plane_point', (1.0, 0.0, 0.0), 'intercept_plane_normal'),
        ('intercept_plane_normal', (math.nan, 0.0, 1.0), 'intercept_plane_normal'),
        ('opposite_spin', 0.6, '0.5'),
    ],
)
def test_bad_parameters_are_refused(name, value, allowed):
    with pytest.raises(ConfigError, match=allowed):
        node_config({name: value})


def test_opposite_spin_of_probability_0_is_not_tried():
    of_share = [node_config({'opposite_spin': x}).predictor for x in (0.0, 0.3)]
    assert [len(c.models_of_opposite_spin) for c in of_share] == [0, 1]
    assert of_share[1].opposite_spin == 0.3


def test_measurement_is_turned_into_map():
    """A frame at (1, 2, 3), turned by 90 degrees about z: its x is y of map."""
    values = {'frame_position': (1.0, 2.0, 3.0), 'frame_rotation': (0.0, 0.0, 90.0)}
    config = node_config({**values, 'measurement_frame': 'camera'})
    m = pose(0.0, (5.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    m.header.frame_id = 'camera'
    turned = measurement('pose', m, config, 0.0)
    assert turned.position == pytest.approx((1.0, 7.0, 3.0))
    assert turned.axis == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)


def test_measurement_of_another_frame_is_refused():
    m = pose(0.0, (0.0, 0.0, 1.0))
    m.header.frame_id = 'camera'
    with pytest.raises(ConfigError, match='camera'):
        measurement('pose', m, node_config({}), 0.0)


def test_covariance_gives_the_standard_deviation():
    m = PoseWithCovarianceStamped()
    m.pose.covariance[0] = m.pose.covariance[7] = m.pose.covariance[14] = 0.09
    assert measurement(
        'pose_with_covariance', m, node_config({}), 0.0
    ).position_sigma == pytest.approx(0.3)


@pytest.mark.parametrize('variance', [0.0, -1.0, math.nan])
def test_a_covariance_that_says_nothing_leaves_position_sigma(variance):
    m = PoseWithCovarianceStamped()
    m.pose.covariance[0] = m.pose.covariance[7] = m.pose.covariance[14] = variance
    assert measurement('pose_with_covariance', m, node_config({}), 0.0).position_sigma is None


@pytest.mark.parametrize('variance', [101.0, 1e6, math.inf])
def test_a_position_that_may_be_anywhere_is_refused(variance):
    """A tracker that had lost the disc was believed to `position_sigma`: no throw was followed."""
    m = PoseWithCovarianceStamped()
    m.pose.covariance[0] = m.pose.covariance[7] = m.pose.covariance[14] = variance
    with pytest.raises(
        ConfigError, match=r'covariance: .* up to 100 m\^2, or 0 for position_sigma'
    ):
        measurement('pose_with_covariance', m, node_config({}), 0.0)


def test_an_orientation_that_is_not_finite_is_refused():
    m = pose(1.0, (0.0, 0.0, 1.0))
    m.pose.orientation.x = math.nan
    with pytest.raises(ConfigError, match=r'pose orientation: .* where there is no attitude'):
        measurement('pose', m, node_config({}), 0.0)


def test_a_message_without_a_time_is_refused():
    """All were late or repeated, and the node went on to wait for a throw without a word."""
    with pytest.raises(ConfigError, match=r'pose header.stamp: 0 .* time of the measurement'):
        stamp_of('pose', pose(0.0, (0.0, 0.0, 1.0)))
    assert stamp_of('pose', pose(1e-9, (0.0, 0.0, 1.0))) == 1


def straight_path() -> Path:
    """Return a path from (0, 0, 2) at 100 s along (10, 0, -1) m/s, with a pose every 0.1 s."""
    path = Path()
    path.header.frame_id = 'map'
    path.poses = [
        pose(100.0 + 0.1 * k, (1.0 * k, 0.0, 2.0 - 0.1 * k), (0.0, 0.0, 1.0)) for k in range(21)
    ]
    return path


@pytest.mark.parametrize(
    ('normal', 'point', 't'),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0),  # the height of 1 m, on the way down
        ((1.0, 0.0, 0.0), (12.5, 7.0, -3.0), 1.25),
        ((-3.0, 0.0, 0.0), (12.5, 7.0, -3.0), 1.25),  # its length and sense do not matter
        ((1.0, 0.0, 1.0), (3.0, 0.0, 0.0), 1.0 / 9.0),  # 10 t + 2 - t = 3
        ((0.0, 0.0, 1.0), (0.0, 0.0, 3.0), None),  # above the path
    ],
)
def test_intercept_is_where_a_straight_path_crosses_the_plane(normal, point, t):
    config = node_config({'intercept_plane_normal': normal, 'intercept_plane_point': point})
    crossing = outputs.intercept(straight_path(), config.plane)
    if t is None:
        assert crossing is None
        return
    at = crossing.pose.position
    assert (at.x, at.y, at.z) == pytest.approx((10.0 * t, 0.0, 2.0 - t), abs=1e-9)
    assert stamp(crossing) == pytest.approx(100.0 + t, abs=2e-9)
    assert crossing.header.frame_id == 'map'


class Tracking:
    """A predictor node and a tracker that measures the disc, spun by one executor."""

    def __init__(self, context, discs: str) -> None:
        self.flown = throw(Setup(disc=load_disc('ultrastar')), ThrowPrior(), 4)
        chosen = {'disc_uncertainty': 0.0, 'discs': discs}
        parameters = [Parameter(name, value=value) for name, value in chosen.items()]
        self.node = PredictorNode(context=context, parameter_overrides=parameters)
        self.tracker = Node('tracker', context=context, start_parameter_services=False)
        self._publisher = self.tracker.create_publisher(
            PoseStamped, PredictorTopic.MEASURED_POSE, STATE_QOS
        )
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self._executor.add_node(self.tracker)

    def start(self, matched) -> None:
        self.spin_until(lambda: self._publisher.get_subscription_count() and matched())
        self.node.start()

    def spin_until(self, condition) -> None:
        end = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < end
            self._executor.spin_once(0.01)

    def publish(self, message: PoseStamped) -> None:
        self._publisher.publish(message)
        self._executor.spin_once(0.01)

    def publish_flight(self, stop: int | None = None) -> None:
        flown = self.flown
        rows = list(zip(flown.time, flown.position, flown.axis, strict=True))
        for t, position, axis in rows[:stop]:
            self.publish(pose(100.0 + t, position, axis))

    def end(self) -> None:
        assert self.node.stop() == ''
        self._executor.shutdown()
        self.node.destroy_node()
        self.tracker.destroy_node()


def test_node_follows_a_throw(ros_context):
    """A throw with attitudes, with its own stamps; a pose that is not finite between them."""
    tracking = Tracking(ros_context, discs='wraith ultrastar')
    node, flown = tracking.node, tracking.flown
    got = {name: [] for name in KINDS}
    for name, (kind, topic) in KINDS.items():
        tracking.tracker.create_subscription(kind, topic, got[name].append, STATE_QOS)
    try:
        tracking.start(lambda: node.count_subscribers('predicted_landing'))
        tracking.publish(pose(100.0, (math.nan, 0.0, 1.0)))
        tracking.spin_until(lambda: node.refused == 1)
        tracking.publish_flight()
        end = 100.0 + flown.landing[2]
        tracking.spin_until(lambda: got['estimate'] and stamp(got['estimate'][-1]) > end - 0.03)
        tracking.spin_until(lambda: all(got.values()))
    finally:
        tracking.end()
    last = got['landing'][-1]
    at = last.pose.pose.position
    assert math.dist((at.x, at.y), flown.landing[:2]) < 0.1  # noise of 2 cm
    assert stamp(last) == pytest.approx(end, abs=0.03)
    assert last.header.frame_id == 'map'
    covariance = np.reshape(last.pose.covariance, (6, 6))[:2, :2]
    assert (np.linalg.eigvalsh(covariance) > 0.0).all()
    first = np.reshape(got['landing'][0].pose.covariance, (6, 6))[:2, :2]
    assert np.trace(covariance) < 0.1 * np.trace(first)  # the ellipse shrinks
    assert len(got['ellipse'][0].markers) == 2
    path = got['path'][0].poses
    times = [stamp(p) for p in path]
    assert times == sorted(times)
    assert path[-1].pose.position.z == pytest.approx(0.0, abs=0.15)  # the rim touches first
    assert got['intercept'][0].pose.position.z == 1.0
    weights = {value.key: float(value.value) for value in got['weights'][-1].values}
    assert weights['ultrastar'] > 0.99  # a golf disc falls much sooner
    assert sum(weights.values()) == pytest.approx(1.0, abs=1e-5)


def test_a_throw_whose_measurements_end_is_not_followed(ros_context):
    """The tracker dies while the disc flies."""
    tracking = Tracking(ros_context, discs='ultrastar')
    arrays = []
    tracking.tracker.create_subscription(DiagnosticArray, '/diagnostics', arrays.append, 10)

    def says(text, level):
        return any(
            s.message.startswith(text) and s.level == level for a in arrays for s in a.status
        )

    try:
        tracking.start(lambda: True)
        tracking.spin_until(lambda: says('waiting for a throw', DiagnosticStatus.OK))
        tracking.publish_flight(stop=len(tracking.flown.time) // 3)
        tracking.spin_until(lambda: tracking.node.predictions > 3)
        text = 'in a throw of which nothing was measured for '
        tracking.spin_until(lambda: says(text, DiagnosticStatus.WARN))
        text = 'waiting for a throw: the last one must have landed'
        tracking.spin_until(lambda: says(text, DiagnosticStatus.OK))
    finally:
        tracking.end()


def stamp(message) -> float:
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def test_bad_parameter_ends_the_program(ros_environment):
    words = ['--ros-args', '-p', 'position_sigma:=-1.0']
    done = subprocess.run(
        [sys.executable, '-m', 'disc_sim_ros.ros.predictor', *words],
        check=False,
        capture_output=True,
        text=True,
        timeout=DEADLINE,
    )
    assert done.returncode == 2
    assert done.stderr.startswith('predictor_node: error: position_sigma')
    assert done.stderr.count('\n') == 1
