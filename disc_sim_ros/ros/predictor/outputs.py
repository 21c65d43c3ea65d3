"""Messages of a prediction."""

from collections.abc import Mapping, Sequence
import math
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Vector3Stamped
from nav_msgs.msg import Odometry, Path
import numpy as np
from visualization_msgs.msg import Marker, MarkerArray

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.estimation.prediction.ellipse import half_axes
from disc_sim_ros.estimation.prediction.predictor import Prediction
from disc_sim_ros.physics.frames import map_from_paper, odometry_array, rotation_matrix
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.predictor.options import Plane
from disc_sim_ros.topics import Frames
from disc_sim_ros.units import NANOSECONDS

SHARES = (50, 90)  # percent of the landings in an ellipse
_LOW = 0.02  # m, height of the ellipses over the ground
_COLOURS = {50: (0.835, 0.369, 0.0, 0.6), 90: (0.835, 0.369, 0.0, 0.25)}
_FLIP = np.diag(map_from_paper(np.ones(3)))
_LIFETIME = 2  # s, of an ellipse that is not renewed


def landing(p: Prediction, stamp: int, ground: float, frames: Frames) -> PoseWithCovarianceStamped:
    """Return where the disc lands, stamped with the time of the landing [ns]."""
    m = PoseWithCovarianceStamped()
    _set(m.header, frames.map, stamp)
    at = m.pose.pose
    at.position.x, at.position.y, at.position.z = float(p.landing[0]), float(p.landing[1]), ground
    at.orientation.w = 1.0
    covariance = np.zeros((6, 6))
    covariance[:2, :2] = p.covariance[:2, :2]
    m.pose.covariance = covariance.ravel().tolist()
    return m


def estimate(p: Prediction, stamp: int, ground: float, frames: Frames) -> Odometry:
    """Return the estimated state at a measurement [ns]; its covariances have no rotations."""
    m = Odometry()
    _set(m.header, frames.map, stamp)
    m.child_frame_id = frames.disc
    numbers = odometry_array(p.state)[0].tolist()
    pose, twist = m.pose.pose, m.twist.twist
    pose.position.x, pose.position.y, pose.position.z = numbers[0], numbers[1], numbers[2] + ground
    turn = pose.orientation
    turn.x, turn.y, turn.z, turn.w = numbers[3:7]
    twist.linear.x, twist.linear.y, twist.linear.z = numbers[7:10]
    twist.angular.x, twist.angular.y, twist.angular.z = numbers[10:13]
    of_pose, of_twist = np.zeros((6, 6)), np.zeros((6, 6))
    to_map = _FLIP @ rotation_matrix(p.state[6:10]) @ _FLIP  # of `disc`
    of_pose[:3, :3] = p.state_covariance[:3, :3]
    of_twist[:3, :3] = to_map.T @ p.state_covariance[3:, 3:] @ to_map
    m.pose.covariance, m.twist.covariance = of_pose.ravel().tolist(), of_twist.ravel().tolist()
    return m


def path(stamps: Sequence[int], states: FloatArray, ground: float, frames: Frames) -> Path:
    """Return the rest of the flight, each pose with its own stamp [ns]."""
    m = Path()
    _set(m.header, frames.map, stamps[0])
    for stamp, numbers in zip(stamps, odometry_array(states), strict=True):
        pose = PoseStamped()
        _set(pose.header, frames.map, stamp)
        at, turn = pose.pose.position, pose.pose.orientation
        at.x, at.y, at.z = float(numbers[0]), float(numbers[1]), float(numbers[2]) + ground
        turn.x, turn.y, turn.z, turn.w = map(float, numbers[3:7])
        m.poses.append(pose)
    return m


def intercept(m: Path, plane: Plane) -> PoseStamped | None:
    """Return where a path first crosses a plane, with its time; None if it does not."""
    normal, point = np.array(plane.normal), np.array(plane.point)
    at = np.array([[q.x, q.y, q.z] for q in (p.pose.position for p in m.poses)])
    over = (at - point) @ normal
    crossed = (over[:-1] >= 0.0) & (over[1:] < 0.0)
    if plane.both_ways:
        crossed |= (over[:-1] <= 0.0) & (over[1:] > 0.0)
    if not crossed.any():
        return None
    i = int(np.argmax(crossed))
    share = over[i] / (over[i] - over[i + 1])
    begin, end = _nanoseconds(m.poses[i]), _nanoseconds(m.poses[i + 1])
    crossing = PoseStamped()
    _set(crossing.header, m.header.frame_id, begin + round(share * (end - begin)))
    x, y, z = (at[i] + share * (at[i + 1] - at[i])).tolist()
    position = crossing.pose.position
    position.x, position.y, position.z = x, y, z
    crossing.pose.orientation = m.poses[i].pose.orientation
    return crossing


def disc_weights(throw: int, weights: Mapping[str, float]) -> DiagnosticStatus:
    """Return how likely each disc is, the most likely first."""
    likely = sorted(weights.items(), key=lambda item: item[1], reverse=True)
    return DiagnosticStatus(
        level=DiagnosticStatus.OK,
        name=f'throw {throw}',
        message=likely[0][0],
        values=[KeyValue(key=name, value=f'{weight:.6f}') for name, weight in likely],
    )


def wind(p: Prediction, stamp: int, frames: Frames) -> Vector3Stamped:
    """Return the estimated wind."""
    m = Vector3Stamped()
    _set(m.header, frames.map, stamp)
    m.vector.x, m.vector.y = float(p.wind[0]), float(p.wind[1])
    return m


def ellipses(p: Prediction, stamp: int, ground: float, frames: Frames) -> MarkerArray:
    """Return the ellipses that hold 50 and 90 % of the landings."""
    markers = []
    for i, share in enumerate(SHARES):
        long, short, yaw = half_axes(p.covariance[:2, :2], share / 100.0)
        m = Marker(ns='landing', id=i, type=Marker.CYLINDER, action=Marker.ADD)
        _set(m.header, frames.map, stamp)
        m.lifetime.sec = _LIFETIME
        at = m.pose.position
        at.x, at.y, at.z = float(p.landing[0]), float(p.landing[1]), ground + _LOW
        m.pose.orientation.z, m.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        m.scale.x, m.scale.y, m.scale.z = 2.0 * long, 2.0 * short, _LOW
        m.color.r, m.color.g, m.color.b, m.color.a = _COLOURS[share]
        markers.append(m)
    return MarkerArray(markers=markers)


def _set(header: Any, frame: str, stamp: int) -> None:
    header.frame_id = frame
    header.stamp.sec, header.stamp.nanosec = messages.stamp(stamp)


def _nanoseconds(pose: PoseStamped) -> int:
    return int(pose.header.stamp.sec) * NANOSECONDS + int(pose.header.stamp.nanosec)
