"""`/tf` that the live recorder makes from `transform`, as an independent reader sees it."""

import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
import yaml

pytest.importorskip('rclpy')

from nav_msgs.msg import Odometry

from disc_sim_ros import topics
from disc_sim_ros.bags import transforms

pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(
        not transforms.is_needed(), reason='tf2_msgs is installed: sim_node publishes /tf'
    ),
]


def test_a_recorded_bag_has_tf_without_tf2_msgs(ros, record):
    sim = ros.start({'auto_throw': False, 'frame_prefix': 'red/', 'launch.height': 50.0})
    recorder = record()
    recorder.wait_for_topics('/transform', '/odom')
    assert ros.call(sim, 'throw').success
    odom = ros.subscribe(Odometry, topics.ODOM)
    ros.spin_until(lambda: len(odom) > 100, 'half a second of flight')
    assert recorder.end() == 0

    store = get_typestore(Stores.ROS2_JAZZY)
    made, sent = [], []
    with Reader(recorder.bag) as bag:
        assert bag.topics[topics.TF].msgtype == 'tf2_msgs/msg/TFMessage'
        for connection, time, data in bag.messages():
            if connection.topic == topics.TF:
                (held,) = store.deserialize_cdr(data, connection.msgtype).transforms
                made.append((time, held))
            elif connection.topic == f'/{topics.TRANSFORM}':
                sent.append((time, store.deserialize_cdr(data, connection.msgtype)))
    assert len(made) > 200
    assert made == sent  # stamps, frames, numbers, times of arrival
    frames = {(held.header.frame_id, held.child_frame_id) for _, held in made}
    assert frames == {('map', 'red/disc'), ('red/disc', 'red/disc_body')}
    heights = [h.transform.translation.z for _, h in made if h.child_frame_id == 'red/disc']
    assert max(heights) - min(heights) > 0.1  # it moves

    metadata = yaml.safe_load((recorder.bag / 'metadata.yaml').read_text())
    custom = metadata['rosbag2_bagfile_information']['custom_data']
    assert custom['made /tf'] == 'from /transform: no tf2_msgs is installed'
