"""Signs, frames and limits between the physics and messages."""

import math

from geometry_msgs.msg import TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
import numpy as np
from numpy.testing import assert_allclose
import pytest
from scipy.spatial.transform import Rotation

from disc_sim_ros import topics
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import frames as paper_frames
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.kernels.equations import DISC, DISC_AIR, DISC_BODY, State, Velocity
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.cdr_template import assign
from disc_sim_ros.topics import Frames
from sample_discs import FRISBEE, VACUUM

FRAMES = Frames()
RED = Frames.prefixed('red/')
STILL = Velocity(0.0, 0.0, 0.0)
LEVEL = Launch(pitch=0.0, spin=30.0).state()
TUMBLED = Launch(
    speed=12.0, pitch=-70.0, roll=130.0, yaw=200.0, angle_of_attack=40.0, sideslip=-20.0,
    spin=-25.0, roll_rate=3.0, pitch_rate=-4.0, height=2.0,
).state()._replace(X=5.0, Y=-3.0, sigma=100.0)  # fmt: skip
IMPOSSIBLE = [math.nan, math.inf, -math.inf, 1e300]


# To messages.


def test_position_by_hand():
    """5 m forward, 3 m right, 2 m down is x 5, y -3, z -2."""
    state = LEVEL._replace(X=5.0, Y=3.0, Z=2.0)
    assert messages.pose(state) == (5.0, -3.0, -2.0, 0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ('angle', 'quaternion'),
    [
        ('roll', (math.sin(0.1), 0.0, 0.0)),  # right edge down: positive about x forward
        ('pitch', (0.0, -math.sin(0.1), 0.0)),  # nose up: negative about y left
        ('yaw', (0.0, 0.0, -math.sin(0.1))),  # nose right: negative about z up
    ],
)
def test_attitude_by_hand(angle, quaternion):
    launch = Launch(**{'pitch': 0.0, angle: math.degrees(0.2)})
    assert_allclose(messages.pose(launch.state())[3:], (*quaternion, math.cos(0.1)))


@pytest.mark.parametrize(
    ('launch', 'linear'),
    [
        (Launch(speed=10.0, pitch=30.0), (10.0, 0.0, 0.0)),  # along its own x, not the map's
        (Launch(speed=10.0, yaw=90.0, sideslip=90.0), (0.0, -10.0, 0.0)),  # to its own right
        (Launch(speed=10.0, roll=40.0, angle_of_attack=90.0), (0.0, 0.0, -10.0)),  # sinking
    ],
)
def test_velocity_is_in_the_disc(launch, linear):
    assert_allclose(messages.odometry(launch.state())[7:10], linear, atol=1e-14)


def test_rates_by_hand():
    state = Launch(roll_rate=1.0, pitch_rate=2.0, spin=30.0).state()
    assert messages.odometry(state)[10:] == (1.0, -2.0, -30.0)


def test_no_minus_zeros():
    """A minus zero would be read as a sign."""
    values = messages.odometry(LEVEL._replace(r=0.0)) + messages.spin_joint(LEVEL)
    assert not any(math.copysign(1.0, v) < 0.0 for v in values if v == 0.0)


def test_odometry_has_the_vectors_of_the_state():
    values = messages.odometry(TUMBLED)
    assert values[:7] == messages.pose(TUMBLED)
    assert_allclose(values[:3], paper_frames.map_from_paper(TUMBLED[:3]), rtol=0.0)
    assert_allclose(values[3:7], paper_frames.message_quaternion(TUMBLED[6:10]), rtol=0.0)
    in_map = Rotation.from_quat(values[3:7]).apply(values[7:10])
    assert_allclose(in_map, paper_frames.map_from_paper(TUMBLED[3:6]), atol=1e-14)


@pytest.mark.parametrize(
    ('sigma', 'angle'),
    [(0.0, 0.0), (0.5, -0.5), (-0.5, 0.5), (4.0, math.tau - 4.0), (20 * math.pi + 1.0, -1.0)],
)
def test_the_plastic_turns_against_sigma(sigma, angle):
    """Clockwise from above is negative about z up."""
    state = LEVEL._replace(sigma=sigma)
    assert messages.spin_joint(state) == pytest.approx((angle, -30.0), abs=1e-13)
    z, w = messages.spin_transform(state)
    assert_allclose((z, w), (math.sin(angle / 2), math.cos(angle / 2)), atol=1e-13)


def test_the_fields_have_the_order_of_the_numbers():
    message = TransformStamped()
    for field, value in zip(messages.TRANSFORM_FIELDS, messages.pose(TUMBLED), strict=True):
        assign(message, field, value)
    assert message.transform.translation.y == -TUMBLED.Y
    assert message.transform.rotation.w == TUMBLED.e0


@pytest.mark.parametrize('nanoseconds', [0, 1, 1_700_000_000_123_456_789, -1])
def test_stamp(nanoseconds):
    sec, nanosec = messages.stamp(nanoseconds)
    assert 0 <= nanosec < 10**9
    assert sec * 10**9 + nanosec == nanoseconds


def test_quantities_of_a_flight():
    setup = Setup(disc=FRISBEE, wind=Wind(mean=(2.0, -3.0, 0.5)))
    trajectory = fly(Launch(), setup, sample_rate=10.0).trajectory
    for i, row in enumerate(trajectory.rows.tolist()):
        plotted = messages.quantities(State(*row[1:15]), Velocity(*row[15:]), trajectory.diameter)
        for name in ('airspeed', 'absolute_attitude', 'advance_ratio'):
            assert_allclose(getattr(plotted, name), getattr(trajectory, name)[i], rtol=1e-12)
        assert_allclose(plotted.angle_of_attack, trajectory.alpha[i], rtol=1e-10)
        assert plotted.spin_rate == trajectory.spin[i] > 0.0


@pytest.mark.parametrize('speed', [0.0, 1e-320])
def test_quantities_without_airspeed(speed):
    """The square of 1e-320 m/s is 0: to the equations of motion that is no airspeed."""
    state = LEVEL._replace(VX=0.0, VY=0.0, VZ=speed)
    assert messages.quantities(state, STILL, 0.275)[:4] == (0.0, 0.0, 0.0, 0.0)


# The IMU.

NO_CHANGE = (0.0, 0.0, 0.0)


def test_imu_lying_on_the_ground():
    state = LEVEL._replace(VX=0.0, r=0.0, sigma=2.0)
    measured = messages.imu(state, NO_CHANGE, NO_CHANGE, (0.1, 0.2, 0.3), 9.81)
    assert measured == (0.0, 0.0, 0.0, 0.0, 0.0, 9.81)


def test_imu_on_edge():
    """Right edge down: the acceleration away from the ground is to the left."""
    state = Launch(pitch=0.0, roll=90.0).state()
    measured = messages.imu(state, NO_CHANGE, NO_CHANGE, NO_CHANGE, 10.0)
    assert_allclose(measured[3:], (0.0, 10.0, 0.0), atol=1e-14)


def test_imu_turns_with_the_plastic():
    """After a quarter turn clockwise, forward is to the left of the x axis of the plastic."""
    state = LEVEL._replace(sigma=math.pi / 2, p=2.0)
    measured = messages.imu(state, (5.0, 0.0, 10.0), NO_CHANGE, NO_CHANGE, 10.0)
    assert_allclose(measured[:2], (0.0, 2.0), atol=1e-14)
    assert measured[2] == -30.0


@pytest.mark.parametrize('sigma', [0.0, 1.0, 77.0])
def test_imu_in_free_fall_measures_only_the_pull_to_the_axis(sigma):
    """0 at the centre; at an offset w^2 r towards the axis, in the axes of the plastic."""
    state = TUMBLED._replace(p=0.0, q=0.0, r=60.0, sigma=sigma)
    falling = (0.0, 0.0, 9.81)
    centre = messages.imu(state, falling, NO_CHANGE, (0.0, 0.0, 0.0), 9.81)
    assert_allclose(centre, (0.0, 0.0, -60.0, 0.0, 0.0, 0.0), atol=1e-12)
    rim = messages.imu(state, falling, NO_CHANGE, (0.1, -0.02, 0.01), 9.81)
    assert_allclose(rim[3:], (-360.0, 72.0, 0.0), atol=1e-10)


@pytest.mark.parametrize('air', ['air', 'vacuum'])
def test_imu_against_the_motion_of_the_sensor(air):
    """Differences of the position of the sensor, from the poses of a wobbling flight at 5 kHz."""
    offset, h = (0.1, 0.05, 0.02), 2e-4
    launch = Launch(pitch=20.0, roll=10.0, spin=40.0, roll_rate=4.0, pitch_rate=-3.0, height=1.5)
    setup = Setup(disc=FRISBEE, step=h, wind=Wind(mean=(3.0, -2.0, 0.0)))
    if air == 'vacuum':
        setup = Setup(disc=FRISBEE, step=h, air=VACUUM)
    rows = fly(launch, setup, duration=0.5, sample_rate=1 / h).trajectory.rows
    states = [State(*row[1:15]) for row in rows.tolist()]
    poses = np.array([messages.pose(s) for s in states])
    spins = np.array([[0.0, 0.0, *messages.spin_transform(s)] for s in states])
    plastic = Rotation.from_quat(poses[:, 3:]) * Rotation.from_quat(spins)
    sensor = poses[:, :3] + plastic.apply(offset)

    for i in range(10, len(states) - 10, 50):
        # Differences of fourth order: errors of 1e-7 m/s^2 from rounding; 1e-5 would be a part in
        # 10^7 of the pull to the axis.
        near = sensor[i - 2 : i + 3]
        acceleration = np.dot([-1.0, 16.0, -30.0, 16.0, -1.0], near) / (12 * h**2)
        specific_force = plastic[i].inv().apply(np.add(acceleration, (0.0, 0.0, 9.81)))
        turn = (plastic[i - 1].inv() * plastic[i + 1]).as_rotvec() / (2 * h)

        change = np.dot([1.0, -8.0, 0.0, 8.0, -1.0], rows[i - 2 : i + 3, 1:15]) / (12 * h)
        measured = messages.imu(states[i], tuple(change[3:6]), tuple(change[10:13]), offset, 9.81)
        assert_allclose(measured[:3], turn, atol=2e-4)  # of second order: 1.6e-4
        assert_allclose(measured[3:], specific_force, atol=1e-5)


# From messages.


def wrench(frame='', force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0)):
    message = WrenchStamped()
    message.header.frame_id = frame
    for field, value in zip(messages.WRENCH_FIELDS, (*force, *torque), strict=True):
        assign(message, field, value)
    return message


def vector(*values, frame=''):
    message = Vector3Stamped()
    message.header.frame_id = frame
    for field, value in zip(messages.VECTOR_FIELDS, values, strict=True):
        assign(message, field, value)
    return message


def thrown(state=TUMBLED, frames=FRAMES):
    message = Odometry(child_frame_id=frames.disc)
    message.header.frame_id = frames.map
    for field, value in zip(messages.ODOMETRY_FIELDS, messages.odometry(state), strict=True):
        assign(message, field, value)
    return message


def assert_refused(convert, message, thing, frames=FRAMES):
    with pytest.raises(ConfigError) as refused:
        convert(message, frames)
    assert refused.value.thing == thing
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize(
    ('frame', 'expected'),
    [('', DISC_AIR), ('disc', DISC), ('disc_body', DISC_BODY), ('disc_air', DISC_AIR)],
)
def test_moment_by_hand(frame, expected):
    """Nose up is a negative torque about y left, more clockwise spin one about z up."""
    moment = messages.moment_from_wrench(wrench(frame, torque=(0.1, -0.2, -0.3)), FRAMES)
    assert moment == (0.1, 0.2, 0.3, expected)


def test_frames_take_the_prefix_but_map_does_not():
    assert messages.moment_from_wrench(wrench('red/disc'), RED)[3] == DISC
    assert messages.moment_from_wrench(wrench(), RED)[3] == DISC_AIR
    assert_refused(messages.moment_from_wrench, wrench('disc'), 'cmd_moment header.frame_id', RED)
    assert RED.map == 'map'


@pytest.mark.parametrize('prefix', ['/red/', 'a b', 'red\n', 'ü', '-', '.'])
def test_prefixes_that_tf2_refuses(prefix):
    with pytest.raises(ConfigError, match='frame_prefix'):
        Frames.prefixed(prefix)


@pytest.mark.parametrize('value', [*IMPOSSIBLE, 1000.1])
@pytest.mark.parametrize('axis', range(3))
def test_torques_out_of_range(axis, value):
    torque = [0.0, 0.0, 0.0]
    torque[axis] = value
    thing = f'cmd_moment wrench.torque.{"xyz"[axis]}'
    assert_refused(messages.moment_from_wrench, wrench(torque=torque), thing)


@pytest.mark.parametrize('value', [*IMPOSSIBLE, 1e-300, -1.0])
@pytest.mark.parametrize('axis', range(3))
def test_forces_are_refused(axis, value):
    force = [0.0, -0.0, 0.0]
    force[axis] = value
    thing = f'cmd_moment wrench.force.{"xyz"[axis]}'
    assert_refused(messages.moment_from_wrench, wrench(force=force), thing)


@pytest.mark.parametrize('frame', ['map', 'Disc', '/disc', ' ', 'x' * 1000, 'disc\nbody'])
def test_unknown_frames(frame):
    for convert, message, topic in (
        (messages.moment_from_wrench, wrench(frame), 'cmd_moment'),
        (
            messages.coefficients_from_vector,
            vector(0.0, 0.0, 0.0, frame=frame),
            'cmd_coefficients',
        ),
        (messages.wind_from_vector, vector(0.0, 0.0, 0.0, frame=f'{frame}_'), 'wind'),
    ):
        assert_refused(convert, message, f'{topic} header.frame_id')


@pytest.mark.parametrize('frame', ['', 'disc_air'])
def test_coefficients_keep_the_signs_of_the_paper(frame):
    message = vector(0.1, -0.2, 10.0, frame=frame)
    assert messages.coefficients_from_vector(message, FRAMES) == (0.1, -0.2, 10.0)


def test_coefficients_have_no_other_frame():
    for frame in ('disc', 'disc_body'):
        message = vector(0.1, 0.0, 0.0, frame=frame)
        thing = 'cmd_coefficients header.frame_id'
        assert_refused(messages.coefficients_from_vector, message, thing)


@pytest.mark.parametrize('frame', ['', 'map'])
def test_wind_by_hand(frame):
    """Left and up are negative along the paper's Y (right) and Z (down)."""
    wind = messages.wind_from_vector(vector(1.0, 2.0, 3.0, frame=frame), FRAMES)
    assert wind == (1.0, -2.0, -3.0)


@pytest.mark.parametrize('value', [*IMPOSSIBLE, 100.1])
@pytest.mark.parametrize('axis', range(3))
def test_vectors_out_of_range(axis, value):
    values = [0.0, 0.0, 0.0]
    values[axis] = value
    letter = 'xyz'[axis]
    for convert, topic in (
        (messages.coefficients_from_vector, 'cmd_coefficients'),
        (messages.wind_from_vector, 'wind'),
    ):
        assert_refused(convert, vector(*values), f'{topic} vector.{letter}')


def test_a_throw_by_hand():
    """Nose 90 degrees right of +x, flying along its own x: to the right, with clockwise spin."""
    message = Odometry()
    message.pose.pose.position.z = 1.5
    message.pose.pose.orientation.z = -math.sqrt(0.5)
    message.pose.pose.orientation.w = math.sqrt(0.5)
    message.twist.twist.linear.x = 10.0
    message.twist.twist.angular.z = -50.0
    release = messages.release_from_odometry(message, FRAMES)
    assert_allclose(release[:6], (0.0, 0.0, -1.5, 0.0, 10.0, 0.0), atol=1e-14)
    assert release[10:] == (0.0, 0.0, 50.0, 0.0)
    assert_allclose(release[:10], Launch(speed=10.0, yaw=90.0, pitch=0.0, height=1.5).state()[:10],
                    atol=1e-14)  # fmt: skip


@pytest.mark.parametrize('frames', [FRAMES, RED, Frames('', '', '', '')])
def test_a_throw_there_and_back(frames):
    known = FRAMES if frames.map == '' else frames
    release = messages.release_from_odometry(thrown(TUMBLED, frames), known)
    assert_allclose(release, TUMBLED._replace(sigma=0.0), rtol=1e-14, atol=1e-14)
    again = messages.odometry(release)
    assert_allclose(again, messages.odometry(TUMBLED), rtol=1e-14, atol=1e-14)


def test_a_throw_is_normalised():
    message = thrown(LEVEL)
    message.pose.pose.orientation.w = 1.0009
    assert messages.release_from_odometry(message, FRAMES)[6:10] == (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize('value', IMPOSSIBLE)
@pytest.mark.parametrize('field', messages.ODOMETRY_FIELDS)
def test_a_throw_with_an_impossible_number(field, value):
    message = thrown()
    assign(message, field, value)
    assert_refused(messages.release_from_odometry, message, f'throw {field}')


@pytest.mark.parametrize(
    ('field', 'value', 'thing'),
    [
        ('pose.pose.position.y', -10_001.0, 'pose.pose.position.y'),
        ('pose.pose.orientation.w', 1.002, 'pose.pose.orientation'),
        ('pose.pose.orientation.w', 0.0, 'pose.pose.orientation'),
        ('twist.twist.linear.x', 200.1, 'twist.twist.linear.x'),
        ('twist.twist.linear.x', 199.9, 'twist.twist.linear'),  # with the 10 m/s sideways
        ('twist.twist.angular.x', 1000.1, 'twist.twist.angular.x'),
        ('twist.twist.angular.z', 0.0, 'twist.twist.angular.z'),
        ('twist.twist.angular.z', -0.0, 'twist.twist.angular.z'),
        ('header.frame_id', 'odom', 'header.frame_id'),
        ('child_frame_id', 'disc_body', 'child_frame_id'),
        ('child_frame_id', 'map', 'child_frame_id'),
    ],
)
def test_throws_out_of_range(field, value, thing):
    message = thrown(LEVEL)
    message.twist.twist.linear.y = 10.0
    assign(message, field, value)
    assert_refused(messages.release_from_odometry, message, f'throw {thing}')


def test_names_of_topics_are_relative():
    """Namespaces and remapping need that; ROS fixes these three."""
    names = {k: v for k, v in vars(topics).items() if k.isupper() and isinstance(v, str)}
    del names['SPIN_JOINT']
    assert {v for v in names.values() if v.startswith('/')} == {'/clock', '/diagnostics', '/tf'}
    assert len(set(names.values())) == len(names)
