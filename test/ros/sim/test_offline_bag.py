"""The bag of `fly` has the messages of sim_node and the flight that `fly` computes."""

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.testing import assert_array_equal
import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry, Path
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, String
from visualization_msgs.msg import MarkerArray

from disc_sim_ros import topics
from disc_sim_ros.analysis.odometry import ODOMETRY, motions
from disc_sim_ros.bags import transforms
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.errors import ConfigError, DiscSimError
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.frames import odometry_array
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.ros.qos import discovered_qos
from disc_sim_ros.ros.sim import offline_bag
from disc_sim_ros.ros.sim.config import configuration

pytestmark = pytest.mark.ros

SECOND = 1_000_000_000
START = 1000 * SECOND
# A second of wobbling flight in gusts, down to the ground.
PARAMETERS = {
    'launch.speed': 13.0,
    'launch.pitch': -3.0,
    'launch.roll_rate': 2.0,
    'launch.spin': 40.0,
    'launch.height': 1.0,
    'wind.x': 1.5,
    'wind.turbulence': 12.0,
    'wind.seed': 7,
    'imu.gyroscope_noise': 0.1,
    'frame_prefix': 'red/',
}
CONTROL = Control(C_L=0.004, C_M=-0.003, C_N=1e-5)
PACKED = {
    topics.ODOM: Odometry,
    topics.POSE: PoseStamped,
    topics.TRANSFORM: TransformStamped,
    topics.JOINT_STATES: JointState,
    topics.IMU: Imu,
    topics.AERO_WRENCH: WrenchStamped,
    topics.APPLIED_WIND: Vector3Stamped,
    topics.APPLIED_COEFFICIENTS: Vector3Stamped,
    topics.RELEASE: Odometry,
    **dict.fromkeys(
        (
            topics.AIRSPEED,
            topics.ANGLE_OF_ATTACK,
            topics.ABSOLUTE_ATTITUDE,
            topics.ADVANCE_RATIO,
            topics.SPIN_RATE,
        ),
        Float64,
    ),
}
SERIALISED = {  # by ROS, with arbitrary bytes in the padding
    topics.PATH: Path,
    topics.MARKERS: MarkerArray,
    topics.FIELD_MARKERS: MarkerArray,
    topics.CONFIGURATION: String,
    topics.FLIGHT_EVENTS: DiagnosticStatus,
}
NOT_OF_THE_FLIGHT = {'/diagnostics', '/rosout', '/parameter_events'}


def config(**changes):
    return configuration(PARAMETERS | changes)


def steered(ros, sim):
    """Command control coefficients before the release, and wait until they act."""
    applied = ros.subscribe(Vector3Stamped, topics.APPLIED_COEFFICIENTS)
    message = Vector3Stamped()
    message.vector.x, message.vector.y, message.vector.z = CONTROL[:3]
    ros.send(sim, ros.publisher(Vector3Stamped, topics.CMD_COEFFICIENTS), message)
    ros.spin_until(lambda: ros.call(sim, 'step').success and applied, 'the command')


def test_messages_and_topics_are_those_of_sim_node(ros, tmp_path):
    paused = {'auto_throw': False, 'real_time_factor': 0.0, 'start_time': START / SECOND}
    sim = ros.start(PARAMETERS | paused | {'command_timeout': 3600.0})
    live = {
        name: ros.subscribe(message_type, name, raw=True)
        for name, message_type in (PACKED | SERIALISED).items()
    }
    odom = live[topics.ODOM]
    ros.pause(sim)
    ros.spin_until(lambda: ros.call(sim, 'reset').success and odom, 'odom')
    steered(ros, sim)
    ros.forget()
    assert ros.call(sim, 'throw').success
    ros.spin_until(lambda: live[topics.CONFIGURATION], 'the throw')
    ros.resume(sim)
    release = deserialize_message(live[topics.RELEASE][0], Odometry).header.stamp
    start = release.sec * SECOND + release.nanosec
    file = tmp_path / 'flight'
    offline_bag.write_flight(
        str(file), config(command_timeout=3600.0), CONTROL, duration=60.0, start=start
    )

    bag = open_bag(file)
    assert bag.complete
    written = {f'/{name}': [] for name in live}
    made = {topics.TF} if transforms.is_needed() else set()  # no node publishes that
    for message in bag.raw([t.topic.name for t in bag.topics if t.topic.name not in made]):
        assert start <= message.log_time == message.publish_time
        written[message.topic].append(message.data)
    ros.spin_until(
        lambda: all(len(live[name[1:]]) >= len(data) for name, data in written.items()),
        'as many messages as in the bag',
    )
    assert len(written['/odom']) > 150
    assert len(written['/flight_events']) == 2
    for name in PACKED:
        assert live[name] == written[f'/{name}'], name
    for name, message_type in SERIALISED.items():
        from_node, from_bag = (
            [deserialize_message(data, message_type) for data in messages]
            for messages in (live[name], written[f'/{name}'])
        )
        assert from_node == from_bag, name

    published = {
        name
        for name, _ in ros.node.get_publisher_names_and_types_by_node('sim_node', '/')
        if name not in NOT_OF_THE_FLIGHT
    }
    assert {info.topic.name for info in bag.topics} == published | made
    for info in bag.topics:
        if info.topic.name in made:
            continue
        (publisher,) = ros.node.get_publishers_info_by_topic(info.topic.name)
        assert info.topic.type == publisher.topic_type
        assert info.topic.type_hash == str(publisher.topic_type_hash)
        assert info.topic.qos == (discovered_qos(publisher.qos_profile),)
        assert info.topic.definition.strip()


@cache
def written(folder, rate=200.0, duration=60.0, **changes):
    """Return the odometry of a bag, and the flight of `fly`."""
    parameters = config(publish_rate=rate, **changes)
    offline_bag.write_flight(str(folder), parameters, CONTROL, duration, START)
    (motion,) = motions(open_bag(folder).raw(['/odom']), ODOMETRY)
    flown = fly(
        parameters.launch,
        parameters.setup,
        control=CONTROL,
        duration=duration,
        ground=parameters.ground,
        sample_rate=rate,
    )
    return motion, flown


@pytest.mark.parametrize(
    ('rate', 'changes'),
    [
        (200.0, {}),
        (1000.0, {'physics_rate': 3000.0}),
        (50.0, {'disc': 'wraith', 'model': 'constant_spin', 'launch.spin': 90.0}),
    ],
)
def test_it_is_the_flight_of_fly_to_the_bit(tmp_path, rate, changes):
    motion, flown = written(tmp_path / 'bag', rate, **changes)
    states = flown.trajectory.rows[:, 1:15]
    assert flown.landed
    assert len(motion) == len(states) + 1  # and the disc on the ground
    assert_array_equal(motion.numbers[:-1], odometry_array(states))
    every = SECOND / rate
    assert_array_equal(motion.stamps, [START + int(k * every) for k in range(len(motion))])
    assert not motion.numbers[-1, 7:].any()
    assert_array_equal(motion.numbers[-1, :3], flown.position)  # z of a rim on the ground is not 0


def test_it_ends_with_the_duration(tmp_path):
    motion, flown = written(tmp_path / 'bag', duration=0.3, ground=False)
    assert len(motion) == len(flown.trajectory) == 61
    assert_array_equal(motion.numbers, odometry_array(flown.trajectory.rows[:, 1:15]))


def test_numbers_of_messages_are_those_of_the_node():
    """A re-simulation turns arrays of states, the node one state: with the same bits."""
    from disc_sim_ros.physics.kernels.equations import State
    from disc_sim_ros.ros.messages import odometry

    rng = np.random.default_rng(3)
    states = rng.normal(size=(200, 14))
    states[:, 6:10] /= np.linalg.norm(states[:, 6:10], axis=1, keepdims=True)
    states[0] = 0.0
    expected = np.array([odometry(State(*row)) for row in states.tolist()])
    assert odometry_array(states).tobytes() == expected.tobytes()


def test_a_bag_is_never_overwritten_nor_left_unfinished(tmp_path):
    offline_bag.write_flight(str(tmp_path / 'bag'), config(), CONTROL, 0.1, START)
    before = {file: file.read_bytes() for file in (tmp_path / 'bag').iterdir()}
    with pytest.raises(ConfigError, match='exists already'):
        offline_bag.write_flight(str(tmp_path / 'bag'), config(), CONTROL, 0.1, START)
    assert {file: file.read_bytes() for file in (tmp_path / 'bag').iterdir()} == before

    blown_up = replace(
        config(), setup=Setup(disc=config().setup.disc, step=0.1), launch=Launch(speed=190.0)
    )
    with pytest.raises(DiscSimError):
        offline_bag.write_flight(str(tmp_path / 'other'), blown_up, CONTROL, 60.0, START)
    assert [path.name for path in tmp_path.iterdir()] == ['bag']
