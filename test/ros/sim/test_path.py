"""The serialised path is that of the message."""

import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.serialization import deserialize_message

from disc_sim_ros.ros.cdr_template import assign
from disc_sim_ros.ros.messages import POSE_FIELDS
from disc_sim_ros.ros.sim.path import PathBytes

pytestmark = pytest.mark.ros


@pytest.mark.parametrize('frame', ['map', 'a/map', 'abcd', 'abcde', 'red_12/map'])
def test_the_path_holds_the_last_points(frame):
    path = PathBytes(frame, 5)
    expected = Path()
    expected.header.frame_id = frame
    for n in range(12):
        if n == 8:
            path.clear()
            expected.poses = []
        pose = tuple(n + 0.1 * k for k in range(7))
        path.extend(1000 + n, 7 * n, pose)
        point = PoseStamped()
        point.header.frame_id = frame
        point.header.stamp.sec, point.header.stamp.nanosec = 1000 + n, 7 * n
        for field, value in zip(POSE_FIELDS, pose, strict=True):
            assign(point, field, value)
        expected.poses = [*expected.poses, point][-5:]
        expected.header.stamp = point.header.stamp
        assert deserialize_message(path.message(), Path) == expected
