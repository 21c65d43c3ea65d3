"""The compiled loop and the Python loop do the same, to the byte."""

from contextlib import contextmanager
import ctypes
import gc
import math
import time

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMessage
import numpy as np
from rclpy._rclpy_pybind11 import InvalidHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64

from disc_sim_ros.physics import frames, imu, trajectory
from disc_sim_ros.physics.kernels import jit, rotation
from disc_sim_ros.physics.kernels.equations import Control, State, Velocity
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.ros.cdr_template import CdrTemplate
from disc_sim_ros.ros.internals import NativeTopics
from disc_sim_ros.ros.messages import ODOMETRY_FIELDS, Quantities
from disc_sim_ros.ros.sim import compiled_loop
from disc_sim_ros.ros.sim.node import SimNode
from ros.sim_process import ALL_QOS, DEADLINE

pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(not jit.COMPILED, reason='numba is absent or switched off'),
]

SECOND, MS = 1_000_000_000, 1_000_000
START = 1000.0  # s, the first stamp
NAN = math.nan
PUBLISHED = {
    'odom': Odometry,
    'pose': PoseStamped,
    'transform': TransformStamped,
    'joint_states': JointState,
    'imu': Imu,
    'aero_wrench': WrenchStamped,
    **dict.fromkeys(Quantities._fields, Float64),
    'path': PathMessage,
    'applied_moment': WrenchStamped,
    'applied_coefficients': Vector3Stamped,
    'applied_wind': Vector3Stamped,
    'release': Odometry,
    'flight_events': DiagnosticStatus,
}

STATES = ('odom', 'pose', 'transform', 'joint_states', 'imu', 'aero_wrench')
BUILT = ('path', 'flight_events')  # afresh by Python; ROS leaves their padding uninitialised


class World:
    """Nodes in this process, spun by one executor, and a node that communicates with them."""

    def __init__(self, context):
        self.context = context
        self.node = Node('world', context=context)
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.node)
        self.sims = []

    def sim(self, namespace, *, compiled=True, **parameters):
        """Return a simulator that is not started yet, with the compiled loop or without it."""
        overrides = [Parameter(k.replace('__', '.'), value=v) for k, v in parameters.items()]
        sim = SimNode(context=self.context, namespace=namespace, parameter_overrides=overrides)
        sim.steps_compiled = 0
        if compiled:
            assert sim.loop._compiled is not None
            count_steps(sim)
        else:
            sim.loop._compiled.close()
            sim.loop._compiled = None
        self.executor.add_node(sim)
        self.sims.append(sim)
        return sim

    def received(self, namespace, names):
        """Return the serialised messages by topic, filled while the world spins."""
        lists = {name: [] for name in names}
        for name, messages in lists.items():
            topic = f'{namespace}/{name}'
            self.node.create_subscription(
                PUBLISHED[name], topic, messages.append, ALL_QOS, raw=True
            )
        return lists

    def until(self, condition, what=''):
        end = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < end, what
            self.executor.spin_once(0.01)

    def matched(self, *publishers):
        self.until(lambda: all(p.get_subscription_count() for p in publishers), 'matched')

    def subscribed(self, sim, *names):
        """Wait until a simulator knows the subscribers of topics."""
        publishers = vars(sim.loop._publishers)
        sinks = (*publishers.values(), *publishers['quantities'])
        of = {x.publisher.topic.rpartition('/')[2]: x for x in sinks if hasattr(x, 'publisher')}
        self.until(lambda: all(of[name].has_subscribers for name in names), names)

    def end(self, sim):
        assert sim.stop() == ''
        self.executor.remove_node(sim)
        self.sims.remove(sim)
        sim.destroy_node()


def count_steps(sim):
    """Let a simulator count the steps of its compiled loop."""
    run = sim.loop._compiled.run

    def counted(pacer):
        before = pacer.done
        go_on = run(pacer)
        sim.steps_compiled += pacer.done - before
        return go_on

    sim.loop._compiled.run = counted


@pytest.fixture
def world(ros_context):
    compiled_loop.warm_up()

    @contextmanager
    def made():
        it = World(ros_context)
        try:
            yield it
        finally:
            for sim in tuple(it.sims):
                it.end(sim)
            it.executor.shutdown()
            it.node.destroy_node()

    with made() as it:
        yield it


def stamp_of(message):
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


# ---- the same bytes ----


def moment(frame, x, y, z, force=0.0):
    message = WrenchStamped()
    message.header.frame_id = frame
    torque = message.wrench.torque
    torque.x, torque.y, torque.z = x, y, z
    message.wrench.force.y = force
    return message


def vector(frame, x, y, z):
    message = Vector3Stamped()
    message.header.frame_id = frame
    message.vector.x, message.vector.y, message.vector.z = x, y, z
    return message


# Commands by the time after the throw at which they act [ms]; None: refused when they arrive.
SCHEDULE = [
    (22, 'cmd_coefficients', vector('', 0.001, -0.002, 0.0005)),
    (25, 'cmd_coefficients', vector('disc_air', 0.001, -0.002, 0.0005)),  # no change
    (31, 'cmd_moment', moment('disc', 1e-3, 2e-3, -1e-4)),
    (36, 'cmd_moment', moment('disc_body', 1e-3, -2e-3, -0.0)),
    (36, 'cmd_coefficients', vector('', -0.0, 0.0, 0.0)),
    (40, 'cmd_moment', moment('', -1e-3, 0.0, 1e-4)),
    (None, 'cmd_moment', moment('map', 1e-3, 0.0, 0.0)),
    (None, 'cmd_moment', moment('disc', 1e-3, 0.0, 0.0, force=0.1)),
    (None, 'cmd_moment', moment('disc', 0.0, 1e4, 0.0)),
    (None, 'cmd_coefficients', vector('disc', 0.001, 0.0, 0.0)),
    (None, 'cmd_coefficients', vector('', 0.0, NAN, 0.0)),
    (44, 'cmd_coefficients', vector('', 0.002, 0.001, -0.001)),
    (47, 'wind', vector('map', 1.0, -2.0, 0.5)),
    # Both inputs expire before this one.
    (110, 'cmd_moment', moment('disc_air', 2e-3, 1e-3, 0.0)),
]
AHEAD = 18 * MS  # simulated time from sending to the stamp, 0.6 s at the pace
PACE = 0.03
FLOWN = 260 * MS  # from the throw to the last message that is compared


@pytest.mark.slow
def test_both_loops_publish_the_same_bytes_also_when_commands_arrive(world):
    """A throw in gusts, steered by commands that arrive on the way, and its landing."""
    parameters = {
        'start_time': START, 'auto_throw': False, 'real_time_factor': PACE,
        'publish_rate': 500.0, 'launch__height': 0.9, 'launch__speed': 12.0,
        'launch__pitch': -20.0, 'command_timeout': 0.05, 'wind__turbulence': 3.0,
        'path_rate': 50.0, 'imu__offset': [0.05, -0.02, 0.01],
        'wind__roughness_length': 0.05, 'wind__x': 3.0,
    }  # fmt: skip
    spaces = {'/loop_c': True, '/loop_p': False}  # compiled, Python
    sims = {s: world.sim(s, compiled=c, **parameters) for s, c in spaces.items()}
    received = {space: world.received(space, PUBLISHED) for space in spaces}
    types = {name: type(message) for _, name, message in SCHEDULE}
    send = {
        (s, name): world.node.create_publisher(kind, f'{s}/{name}', 100)
        for s in spaces for name, kind in types.items()
    }  # fmt: skip
    world.matched(*send.values())
    for sim in sims.values():
        sim.loop.paused = True
        world.subscribed(sim, *PUBLISHED)
        sim.start()
        for action in (str, str, sim.loop.throw):  # the second after the first message
            sim.loop.submit(action).result(DEADLINE)
    thrown = round(START * SECOND)
    for sim in sims.values():
        sim.loop.submit(sim.loop.resume)
    schedule = dict.fromkeys(sims, tuple(SCHEDULE))
    while any(sim.loop.clock.now <= thrown + FLOWN for sim in sims.values()):
        world.executor.spin_once(0.01)  # far less than AHEAD
        for space, sim in sims.items():
            while schedule[space] and sim.loop.clock.now >= sent_at(schedule[space], thrown):
                at, name, message = schedule[space][0]
                ns = thrown + at * MS if at is not None else 0
                message.header.stamp.sec, message.header.stamp.nanosec = divmod(ns, SECOND)
                send[space, name].publish(message)
                schedule[space] = schedule[space][1:]
    world.until(
        lambda: (
            all(
                last_stamp(name, r[name]) > thrown + FLOWN
                for r in received.values()
                for name in STATES
            )
            and all(
                len(messages[name]) >= len(messages['odom']) - 1
                for messages in received.values()
                for name in Quantities._fields
            )
        ),
        'the last messages',
    )
    compiled, python = (between(received[space], thrown, thrown + FLOWN) for space in spaces)
    applied = [stamp_of(deserialize_message(m, WrenchStamped)) for m in python['applied_moment']]
    assert [(t - thrown) // MS for t in applied] == [31, 36, 40, 90, 110, 160]
    assert len(python['odom']) > 100
    for name in PUBLISHED:
        assert len(compiled[name]) == len(python[name]) > 0, name
        if name in BUILT:
            pairs = zip(compiled[name], python[name], strict=True)
            assert all(read(name, a) == read(name, b) for a, b in pairs), name
        else:
            assert compiled[name] == python[name], name
    assert any(b'landed' in message for message in compiled['flight_events'])
    for field in ('accepted', 'dropped'):
        counts = [[getattr(t, field) for t in s.loop.commands.all] for s in sims.values()]
        assert counts[0] == counts[1]
    assert sims['/loop_c'].steps_compiled > 150


def values(message):
    v = deserialize_message(message, Vector3Stamped).vector
    return v.x, v.y, v.z


def read(name, message):
    return deserialize_message(message.replace(b'loop_c', b'loop_p'), PUBLISHED[name])


def sent_at(schedule, thrown):
    """Return when the next command is sent [ns]."""
    at = next((at for at, *_ in schedule if at is not None), 0)
    return thrown + at * MS - AHEAD


def last_stamp(name, messages):
    return stamp_of(deserialize_message(messages[-1], PUBLISHED[name])) if messages else 0


def between(received, start, end):
    """Return the messages with stamps behind `start`, until `end` [ns]; events have none."""
    kept = dict(received)
    of_odom = [stamp_of(deserialize_message(m, Odometry)) for m in received['odom']]
    for name, messages in received.items():
        if name not in {'flight_events', 'release'}:
            of = PUBLISHED[name]
            if of is Float64:  # as many as of `odom`
                stamps = of_odom[: len(messages)]
            else:
                stamps = [stamp_of(deserialize_message(m, of)) for m in messages]
            kept[name] = [
                m for m, stamp in zip(messages, stamps, strict=False) if start < stamp <= end
            ]
    return kept


def test_commands_in_a_stream_act_as_their_topic_says_bit_for_bit(world):
    """At full pace: what `applied_coefficients` says re-simulates every message of the flight."""
    sim = world.sim(
        '/s', start_time=START, auto_throw=False, publish_rate=1000.0, launch__height=100.0
    )
    received = world.received('/s', ['odom', 'applied_coefficients', 'flight_events'])
    send = world.node.create_publisher(Vector3Stamped, '/s/cmd_coefficients', 100)
    world.matched(send)
    world.subscribed(sim, *received)
    sim.start()
    sim.loop.submit(sim.loop.throw).result(DEADLINE)
    flight = sim.loop._simulation.flight_simulator
    for n in range(300):
        send.publish(vector('', 1e-4 * (n % 7), 2e-4 * (n % 5), -1e-5 * n))
        world.executor.spin_once(0.001)
    sim.loop.submit(sim.loop.pause).result(DEADLINE)
    end = sim.loop.clock.now
    world.until(lambda: last_stamp('odom', received['odom']) >= end, 'the last message')
    active = sim.loop._simulation.inputs.active.control[:3]
    world.until(lambda: values(received['applied_coefficients'][-1]) == active, 'the last change')
    assert sim.steps_compiled > 100
    assert sim.loop.commands.coefficients.accepted == 300
    changes = [deserialize_message(m, Vector3Stamped) for m in received['applied_coefficients']]
    by_stamp = {stamp_of(m): Control(m.vector.x, m.vector.y, m.vector.z) for m in changes}
    assert len(by_stamp) == len(changes) > 50
    sent = Odometry(child_frame_id='disc')
    sent.header.frame_id = 'map'
    pack = CdrTemplate(sent, ODOMETRY_FIELDS).pack
    odom = {stamp_of(deserialize_message(m, Odometry)): m for m in received['odom']}
    again = FlightSimulator(flight.setup, flight.release)
    released = end - flight.steps * MS
    for step in range(flight.steps + 1):
        stamp = released + step * MS
        if step:
            again.advance(1)
            state = pack(*divmod(stamp, SECOND), *frames.odometry(again.state))
            assert odom[stamp] == state, (step, flight.steps)
        control = by_stamp.get(stamp)
        if control is not None:
            again.take(control._replace(axes=flight.control.axes))


# ---- lifetimes ----


def test_subscribers_come_and_go_and_nodes_end_while_it_flies(world):
    for n in range(5):
        sim = world.sim(f'/n{n}', publish_rate=1000.0, launch__height=500.0)
        sim.start()
        for _ in range(3):
            received = []
            subscription = world.node.create_subscription(
                Odometry, f'/n{n}/odom', received.append, ALL_QOS
            )
            world.until(lambda r=received: len(r) > 20, 'odom')
            world.node.destroy_subscription(subscription)
            world.until(lambda s=sim: not s.loop._publishers.odom.has_subscribers, 'unmatched')
        assert sim.steps_compiled > 0
        world.end(sim)
        del sim
        gc.collect()


def test_handles_outlive_their_node_until_they_are_released(world):
    node = Node('short', context=world.context)
    publisher = node.create_publisher(Odometry, 'topic_of_a_short_life', 1)
    native = NativeTopics([publisher], [])
    node.destroy_node()
    topic = ctypes.CDLL('librcl.so').rcl_publisher_get_topic_name
    topic.argtypes, topic.restype = [ctypes.c_void_p], ctypes.c_char_p
    assert topic(native.publishers[0]) == b'/topic_of_a_short_life'
    native.close()
    with pytest.raises(InvalidHandle), publisher.handle:
        pass


def test_requests_and_new_subscribers_do_not_wait_for_the_compiled_loop(world):
    sim = world.sim('/r', publish_rate=1000.0, launch__height=500.0, path_rate=0.0)
    sim.start()
    world.until(lambda: sim.steps_compiled > 100, 'compiled steps')
    waits = []
    for _ in range(20):
        begin = time.monotonic()
        sim.loop.submit(lambda: '').result(DEADLINE)
        waits.append(time.monotonic() - begin)
    assert sorted(waits)[10] < 0.05


def test_who_subscribes_to_the_path_later_gets_all_of_it(world):
    """Without subscribers compiled code keeps the points, and Python makes no step for them."""
    sim = world.sim('/late', publish_rate=500.0, path_rate=50.0, launch__height=500.0)
    motion = world.received('/late', ['odom'])['odom']
    world.subscribed(sim, 'odom')
    sim.start()
    world.until(lambda: sim.steps_compiled > 1500, 'compiled steps')
    by_python = sim.loop.clock.steps - sim.steps_compiled
    assert by_python < 0.5 * sim.loop.clock.steps / 20  # there is a point every 20 steps
    paths = world.received('/late', ['path'])['path']
    world.until(lambda: paths, 'a path')
    path = deserialize_message(paths[0], PathMessage)
    of_stamp = {stamp_of(m): m for m in (deserialize_message(x, Odometry) for x in motion)}
    released = min(stamp for stamp, m in of_stamp.items() if m.twist.twist.linear.x != 0.0)
    assert [stamp_of(p) - released for p in path.poses] == [
        20 * MS * i for i in range(len(path.poses))
    ]
    assert len(path.poses) > 60
    world.until(
        lambda: stamp_of(deserialize_message(motion[-1], Odometry)) > stamp_of(path), 'odom'
    )
    of_stamp |= {stamp_of(m): m for m in (deserialize_message(x, Odometry) for x in motion)}
    for point in path.poses:
        assert point.pose == of_stamp[stamp_of(point)].pose.pose


# ---- where it does not run ----


def test_without_the_handles_of_rcl_python_flies(world, monkeypatch):
    monkeypatch.setattr('disc_sim_ros.ros.internals._loaded_library', open_missing)
    sim = SimNode(context=world.context, namespace='/plain')
    assert sim.loop._compiled is None
    sim.destroy_node()


def open_missing(name):
    raise OSError(name)


def test_an_address_of_another_handle_is_refused(world):
    class Other:
        """A publisher whose handle has the address of another one."""

        def __init__(self, publisher, address):
            self._handle, self.pointer = publisher.handle, address
            self.handle = self

        def __enter__(self):
            self._handle.__enter__()

        def __exit__(self, *error):
            self._handle.__exit__(*error)

        def get_topic_name(self):
            return self._handle.get_topic_name()

    a = world.node.create_publisher(Odometry, 'a', 1)
    b = world.node.create_publisher(Odometry, 'b', 1)
    NativeTopics([Other(a, a.handle.pointer)], []).close()
    with pytest.raises(ValueError, match='address'):
        NativeTopics([Other(a, b.handle.pointer)], [])


# ---- the numbers ----


def test_compiled_numbers_of_messages_have_the_bits_of_python():
    numba = pytest.importorskip('numba')
    jit.import_compiler()

    @numba.njit(error_model='numpy')
    def compiled(s):
        return (
            frames.odometry(s),
            frames.spin_transform(s),
            frames.spin_joint(s),
            trajectory.quantities(s, Velocity(1.0, -2.0, 0.5), 0.27),
            imu.reading(s, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (0.1, 0.2, 0.3), 9.8),
        )

    rng = np.random.default_rng(5)
    rows = rng.normal(size=(500, 14)) * 10.0 ** rng.integers(-3, 4, size=(500, 14))
    for row in rows.tolist():
        s = State(*row)
        assert compiled(s) == compiled.py_func(s)


@pytest.mark.parametrize('scale', [1e-3, 1.0, 1e3, 1e9])
def test_a_wrapped_angle_is_the_remainder(scale):
    angles = (np.random.default_rng(3).normal(size=2000) * scale).tolist()
    for angle in [*angles, 0.0, -0.0, math.pi, -math.pi, 3 * math.pi, 5 * math.pi]:
        assert repr(rotation.wrapped_angle(angle)) == repr(math.remainder(angle, math.tau))
