"""Packed messages are those that ROS serialises, whatever the lengths of their strings."""

import itertools

from geometry_msgs.msg import (
    PoseStamped,
    Transform,
    TransformStamped,
    Vector3Stamped,
    WrenchStamped,
)
from nav_msgs.msg import Odometry, Path
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, Header
from visualization_msgs.msg import Marker

from disc_sim_ros.ros import messages
from disc_sim_ros.ros.cdr_template import CdrTemplate, assign

SECONDS, NANOSECONDS = 1_700_000_123, 987_654_321
LENGTHS = range(10)


def odometry(length):
    message = Odometry(child_frame_id='c' * (length * 7 % 10))
    message.pose.covariance[0] = 0.25
    message.twist.covariance[35] = -3.5
    return message


def joints(length):
    names = ['j' * length, 'spin']
    return JointState(name=names, position=[0.0, 1.0], velocity=[0.0, 2.0])


def joints_without_position(length):
    return JointState(name=['spin'], velocity=[0.0])


def imu(length):
    message = Imu()
    message.orientation_covariance[0] = -1.0
    return message


def path(length):
    return Path(poses=[PoseStamped(header=Header(frame_id='p' * n)) for n in (length, 1)])


JOINTS = ('position.1', 'velocity.0')
LAST_POSE = ('poses.1.pose.position.z', 'poses.0.pose.position.x')
CASES = {
    'Odometry': (odometry, messages.ODOMETRY_FIELDS),
    'Odometry covariance': (odometry, ('pose.covariance.7', 'twist.covariance.0')),
    'PoseStamped': (lambda n: PoseStamped(), messages.POSE_FIELDS),
    'TransformStamped': (
        lambda n: TransformStamped(child_frame_id='c' * n),
        messages.TRANSFORM_FIELDS,
    ),
    'spin': (
        lambda n: TransformStamped(child_frame_id='c' * (n + 1), transform=Transform()),
        messages.SPIN_TRANSFORM_FIELDS,
    ),
    'JointState': (joints, JOINTS),
    'JointState without position': (joints_without_position, ('velocity.0',)),
    'Imu': (imu, messages.IMU_FIELDS),
    'WrenchStamped': (lambda n: WrenchStamped(), messages.WRENCH_FIELDS),
    'Vector3Stamped': (lambda n: Vector3Stamped(), messages.VECTOR_FIELDS),
    'Marker': (lambda n: Marker(ns='m' * n, text='ö'), ('pose.position.x', 'scale.z')),
}


def assert_serialised(cdr, message):
    """Every byte is that of the serialiser, or zero in padding.

    Where the two differ, any other byte deserialises to the same message: it is padding.
    """
    expected = serialize_message(message)
    assert type(cdr) is bytes
    assert len(cdr) == len(expected)
    assert deserialize_message(cdr, type(message)) == message
    poisoned = bytearray(cdr)
    for i in range(len(cdr)):
        if cdr[i] != expected[i]:
            assert cdr[i] == 0
            poisoned[i] = 0xAA
    assert deserialize_message(bytes(poisoned), type(message)) == message


def with_values(message, fields, values, stamps=('header.stamp',)):
    for field, value in zip(fields, values, strict=True):
        assign(message, field, value)
    for stamp in stamps:
        assign(message, f'{stamp}.sec', SECONDS)
        assign(message, f'{stamp}.nanosec', NANOSECONDS)
    return message


@pytest.mark.parametrize('length', LENGTHS)
@pytest.mark.parametrize(('make', 'fields'), CASES.values(), ids=CASES)
def test_bytes_are_those_of_the_serialiser(make, fields, length):
    message = make(length)
    message.header.frame_id = 'f' * length
    template = CdrTemplate(message, fields)
    for sign in (1.0, -1.0):  # twice: the second has nothing of the first
        values = [sign * (i + 1) / 3.0 for i in range(len(fields))]
        cdr = template.pack(SECONDS, NANOSECONDS, *values)
        assert_serialised(cdr, with_values(message, fields, values))


@pytest.mark.parametrize('fields', [*itertools.permutations(('vector.x', 'vector.y', 'vector.z'))])
def test_values_are_in_the_order_of_the_fields(fields):
    message = Vector3Stamped()
    cdr = CdrTemplate(message, fields).pack(SECONDS, NANOSECONDS, 1.0, 2.0, 3.0)
    assert_serialised(cdr, with_values(message, fields, (1.0, 2.0, 3.0)))


@pytest.mark.parametrize('length', LENGTHS)
def test_several_stamps_get_the_same_time(length):
    stamps = ('header.stamp', 'poses.1.header.stamp')
    message = path(length)
    cdr = CdrTemplate(message, LAST_POSE, stamps).pack(SECONDS, NANOSECONDS, 1.5, 2.5)
    assert_serialised(cdr, with_values(message, LAST_POSE, (1.5, 2.5), stamps))


def test_a_message_of_a_stamp_alone():
    cdr = CdrTemplate(Clock(), (), ('clock',)).pack(SECONDS, NANOSECONDS)
    assert_serialised(cdr, with_values(Clock(), (), (), ('clock',)))


def test_a_message_without_a_stamp():
    assert_serialised(CdrTemplate(Float64(), ('data',), ()).pack(1, 2, -0.1), Float64(data=-0.1))


def test_the_first_and_last_times_of_a_stamp():
    template = CdrTemplate(Clock(), (), ('clock',))
    assert deserialize_message(template.pack(-1, 999_999_999), Clock).clock.sec == -1
    assert deserialize_message(template.pack(2**31 - 1, 0), Clock).clock.sec == 2**31 - 1


def test_padding_does_not_depend_on_the_memory():
    """The serialiser leaves arbitrary bytes there; zeros make each run the same bytes."""
    packed = []
    for garbage in (b'\x55', b'\xff'):
        blocks = [garbage * size for size in range(600, 800)]
        del blocks
        message = Odometry(header=Header(frame_id='ab'), child_frame_id='c')
        packed.append(CdrTemplate(message, messages.ODOMETRY_FIELDS[:3]).pack(1, 2, 3.0, 4.0, 5.0))
    assert packed[0] == packed[1]
    after_text = 4 + 8 + 4 + len('ab') + 1  # header, stamp, length, characters and their end
    assert packed[0][after_text] == 0


def test_the_given_message_is_not_changed():
    message = odometry(3)
    before = serialize_message(message)
    CdrTemplate(message, messages.ODOMETRY_FIELDS)
    assert deserialize_message(before, Odometry) == message


@pytest.mark.parametrize(
    ('message', 'fields', 'stamps', 'pattern'),
    [
        (Odometry(), ('pose.pose.position.w',), ('header.stamp',), 'position.w'),
        (Odometry(), ('child_frame_id',), ('header.stamp',), 'child_frame_id'),
        (Odometry(), ('pose.covariance.36',), ('header.stamp',), r'covariance\.36'),
        (Odometry(), ('header.stamp.sec',), (), 'stamp.sec'),
        (Odometry(), ('pose.pose',), ('header.stamp',), 'pose.pose'),
        (JointState(), ('position.0',), ('header.stamp',), r'JointState has no field position\.0'),
        (Float64(), ('data',), ('header.stamp',), 'header.stamp'),
        (Float64(), ('data', 'data'), (), 'twice'),
        (Float64(), ('',), (), 'Float64 has no field'),
    ],
)
def test_a_path_that_is_no_field_is_refused(message, fields, stamps, pattern):
    with pytest.raises(ValueError, match=pattern):
        CdrTemplate(message, fields, stamps)


def test_a_missing_or_additional_value_is_refused():
    pack = CdrTemplate(Float64(), ('data',), ()).pack
    for values in ((), (1.0, 2.0)):
        with pytest.raises(TypeError):
            pack(1, 2, *values)


def test_messages_check_the_types_of_their_fields():
    """Otherwise `assign` could set a value that no message holds, and the tests would pass."""
    with pytest.raises(AssertionError):
        Float64(data=3)
