"""`/tf` of a bag that was made without tf2_msgs: its bytes, its definition, and where it is."""

import pytest
from rosbags.typesys import Stores, get_typestore

from disc_sim_ros.bags import transforms
from disc_sim_ros.bags.reader import open_bag

STORE = get_typestore(Stores.ROS2_JAZZY)
OWN, HELD = STORE.types[transforms.TF_MESSAGE], STORE.types[transforms.TRANSFORM]


def transform(frame: str, child: str):
    types = STORE.types
    stamp = types['builtin_interfaces/msg/Time'](sec=7, nanosec=123_456_789)
    vector = types['geometry_msgs/msg/Vector3'](x=1.5, y=-2.25, z=0.1)
    turn = types['geometry_msgs/msg/Quaternion'](x=0.1, y=0.2, z=0.3, w=0.9)
    return HELD(
        header=types['std_msgs/msg/Header'](stamp=stamp, frame_id=frame),
        child_frame_id=child,
        transform=types['geometry_msgs/msg/Transform'](translation=vector, rotation=turn),
    )


@pytest.mark.parametrize('frame', ['', 'm', 'map', 'odom', 'world', 'a/map', 'earth/a'])
@pytest.mark.parametrize('child', ['d', 'disc', 'red/disc', 'disc_body'])
def test_a_message_is_what_another_library_serialises(frame, child):
    held = transform(frame, child)
    made = transforms.tf_message(bytes(STORE.serialize_cdr(held, transforms.TRANSFORM)))
    expected = STORE.serialize_cdr(OWN(transforms=[held]), transforms.TF_MESSAGE)
    assert STORE.deserialize_cdr(made, transforms.TF_MESSAGE) == OWN(transforms=[held])
    assert len(made) == len(expected)


@pytest.mark.parametrize(
    'data', [b'', b'\0\1\0\0', b'\0\0\0\0' + bytes(100), b'\0\1\0\0' + bytes(20)]
)
def test_what_is_no_transform_makes_none(data):
    assert transforms.tf_message(data) is None


def test_definition_and_hash_are_those_of_tf2_msgs():
    """Compared with the installed tf2_msgs where there is one, and with rosbags."""
    pytest.importorskip('geometry_msgs')
    topic = transforms.tf_topic()
    assert topic.type_hash == STORE.hash_rihs01(transforms.TF_MESSAGE)
    assert topic.definition.startswith('geometry_msgs/TransformStamped[] transforms\n\n====')
    held = [line for line in topic.definition.splitlines() if line.startswith('MSG: ')]
    assert held[0] == 'MSG: geometry_msgs/TransformStamped'
    assert len(held) == len(set(held)) == 6
    assert topic.definition.replace('\r', '') == transforms._definition().replace('\r', '')


def test_a_bag_of_fly_has_both_frames_on_tf(tmp_path):
    pytest.importorskip('rclpy')
    if not transforms.is_needed():
        pytest.skip('tf2_msgs is installed: /tf has a publisher')
    from disc_sim_ros.physics.kernels.equations import Control
    from disc_sim_ros.ros.sim.config import configuration
    from disc_sim_ros.ros.sim.offline_bag import write_flight

    write_flight(str(tmp_path / 'bag'), configuration({}), Control(), 0.1, 0)
    bag = open_bag(tmp_path / 'bag')
    tf = [m.value.transforms for m in bag.messages(['/tf'])]
    sent = [m.value for m in bag.messages(['/transform'])]
    assert len(tf) == len(sent) == 42
    assert {(t.header.frame_id, t.child_frame_id) for (t,) in tf} == {
        ('map', 'disc'),
        ('disc', 'disc_body'),
    }
    assert [t.transform.rotation.w for (t,) in tf] == [t.transform.rotation.w for t in sent]
    assert bag.custom_data['made /tf'] == 'from /transform: no tf2_msgs is installed'
