"""The standard services of a real sim_node, where simulation_interfaces is installed."""

import math
import signal

from numpy.testing import assert_array_equal
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('simulation_interfaces', reason='simulation_interfaces is not installed')

from geometry_msgs.msg import Vector3, Vector3Stamped
from nav_msgs.msg import Odometry
from rclpy.action import ActionClient
from simulation_interfaces.action import SimulateSteps
from simulation_interfaces.msg import Bounds, EntityCategory
from simulation_interfaces.srv import (
    GetEntities,
    GetEntitiesStates,
    GetEntityInfo,
    GetEntityState,
    GetSimulationState,
    GetSimulatorFeatures,
    ResetSimulation,
    SetEntityState,
    SetSimulationState,
    StepSimulation,
)

from disc_sim_ros import topics
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.sim.standard.offers import OFFERS
from ros.sim.paused_sim import (
    SHORT,
    assert_flown,
    control_change,
    launch_parameters,
    numbers,
    resimulated,
)
from sample_discs import FRISBEE

pytestmark = pytest.mark.ros

STOPPED, PLAYING, PAUSED, QUITTING = range(4)
OK, NOT_FOUND, OPERATION_FAILED = 1, 2, 4
FROM_ZERO = {'start_time': 0.0}
AT_TWO_METRES = {
    'auto_throw': False, 'launch.height': 2.0, 'launch.pitch': 0.0, 'frame_prefix': 'red/',
}  # fmt: skip
CAN_CHOOSE = hasattr(SetEntityState.Request(), 'set_pose')  # since 1.3


class Standard:
    """A simulator and the clients of its standard services."""

    def __init__(self, ros, parameters, **options):
        self.ros = ros
        self.sim = ros.start(FROM_ZERO | parameters, **options)
        self._clients = {}
        self._names = {offer.type_name: offer.name for offer in OFFERS}

    def begin(self, service_type, **fields):
        """Send a request and return its future."""
        if service_type not in self._clients:
            name = self._names[service_type.__name__]
            client = self.ros.node.create_client(service_type, name)
            self.ros.spin_until(client.service_is_ready, name)
            self._clients[service_type] = client
        self.ros._reach(self.sim)
        return self._clients[service_type].call_async(service_type.Request(**fields))

    def call(self, service_type, **fields):
        future = self.begin(service_type, **fields)
        self.ros.spin_until(future.done, service_type.__name__)
        return future.result()

    def code(self, service_type, **fields):
        return self.call(service_type, **fields).result.result

    def go_to(self, state):
        request = SetSimulationState.Request()
        request.state.state = state
        return self.code(SetSimulationState, state=request.state)

    @property
    def state(self):
        return self.call(GetSimulationState).state.state

    def entity(self, name='disc'):
        return self.call(GetEntityState, entity=name)

    def place(self, entity='disc', frame='', w=1.0, **fields):
        """Set pose and twist of the disc, and return the result."""
        request = SetEntityState.Request(entity=entity)
        if CAN_CHOOSE:
            request.set_pose = request.set_twist = True
        request.state.header.frame_id = frame
        request.state.pose.orientation.w = w
        request.state.pose.position.z = fields.get('z', 5.0)
        request.state.twist.linear.x = fields.get('vx', 0.0)
        request.state.twist.angular.z = fields.get('wz', 0.0)
        future = self.begin(SetEntityState)
        self.ros.spin_until(future.done)
        future = self._clients[SetEntityState].call_async(request)
        self.ros.spin_until(future.done)
        return future.result().result


def test_states_follow_the_standard(ros):
    sim = Standard(ros, {'publish_clock': True})
    features = self_described(sim)
    assert list(features.features) == [8, 10, 11, 12, 20, 22, 24, 25, 26, 31, 32, 33]
    assert '0.005 s' in features.custom_info

    assert (sim.state, sim.go_to(PLAYING)) == (PLAYING, 101)
    assert sim.code(StepSimulation, steps=1) == OPERATION_FAILED
    assert (sim.go_to(PAUSED), sim.state, sim.go_to(PAUSED)) == (OK, PAUSED, 101)
    assert (sim.go_to(STOPPED), sim.state, sim.go_to(STOPPED)) == (OK, STOPPED, 101)
    assert sim.go_to(PAUSED) == 103
    assert sim.code(StepSimulation, steps=1) == OPERATION_FAILED
    at_start = sim.entity().state
    assert at_start.pose.position.z == 0.0
    assert at_start.twist.linear == Vector3()
    assert sim.go_to(4) == 0
    assert (sim.go_to(PLAYING), sim.state) == (OK, PLAYING)
    ros.spin_until(lambda: sim.entity().state.pose.position.x > 0.1, 'the throw of auto_throw')
    assert (sim.go_to(QUITTING), sim.sim.wait()) == (OK, 0)


def self_described(sim):
    return sim.call(GetSimulatorFeatures).features


def test_the_disc_is_the_only_entity(ros):
    sim = Standard(ros, AT_TWO_METRES)

    def entities(**fields):
        request = GetEntities.Request()
        for name, value in fields.items():
            setattr(request.filters, name, value)
        response = sim.call(GetEntities, filters=request.filters)
        return response.result.result, response.entities

    sphere = Bounds(type=3, points=[Vector3(z=2.5), Vector3(x=0.51)])
    smaller = Bounds(type=3, points=[Vector3(z=2.5), Vector3(x=0.49)])
    assert entities() == (OK, ['red/disc'])
    assert entities(filter='disc$') == (OK, ['red/disc'])
    assert entities(filter='^disc') == (OK, [])
    assert entities(filter='(') == (OPERATION_FAILED, [])
    assert entities(categories=[EntityCategory(category=4)]) == (OK, ['red/disc'])
    assert entities(categories=[EntityCategory(category=2)]) == (OK, [])
    assert entities(bounds=sphere) == (OK, ['red/disc'])
    assert entities(bounds=smaller) == (OK, [])
    assert entities(bounds=Bounds(type=1)) == (0, [])
    assert entities(bounds=Bounds(type=3)) == (OPERATION_FAILED, [])
    both = sim.call(GetEntitiesStates)
    assert both.entities == ['red/disc']
    assert both.states[0].pose == sim.entity('red/disc').state.pose
    assert sim.entity().result.result == NOT_FOUND
    info = sim.call(GetEntityInfo, entity='red/disc').info
    assert (info.category.category, 'frisbee' in info.description) == (4, True)


def test_a_controller_in_lockstep_flies_the_bits_of_a_simulator(ros):
    """Each step takes the command sent before it; the answer acknowledges it."""
    sim = Standard(ros, launch_parameters(SHORT) | {'real_time_factor': 0.3})
    odom = ros.subscribe(Odometry, topics.ODOM)
    commands = ros.publisher(Vector3Stamped, topics.CMD_COEFFICIENTS)
    assert sim.go_to(PAUSED) == OK
    assert sim.code(ResetSimulation) == OK
    ros.forget()
    changes, count = [], 60
    for k in range(count):
        C_M = 0.02 * math.sin(0.3 * k)
        ros.send(sim.sim, commands, Vector3Stamped(vector=Vector3(y=C_M)))
        changes.append((5 * k, control_change(C_M=C_M)))
        assert sim.code(StepSimulation, steps=1) == OK
    ros.spin_until(lambda: len(moving(odom)) >= count, 'odometry')
    _, states = resimulated(Setup(disc=FRISBEE), SHORT.state(), count + 1, 5, changes)
    flown = moving(odom)
    assert_flown(flown, states[-len(flown) :])
    entity = sim.entity().state
    last = numbers(flown[-1:], messages.ODOMETRY_FIELDS)[0]
    assert_array_equal(numbers([entity], messages.POSE_FIELDS)[0], last[:7])
    assert entity.header.stamp == flown[-1].header.stamp


def moving(odom):
    return [m for m in odom if m.twist.twist.linear.x]


def test_a_state_can_be_set_and_flies_on(ros):
    sim = Standard(ros, {'auto_throw': False})
    assert sim.go_to(PAUSED) == OK
    assert sim.place(z=5.0).result == OK  # at rest: held there
    assert sim.entity().state.pose.position.z == 5.0
    assert sim.code(StepSimulation, steps=10) == OK
    assert sim.entity().state.pose.position.z == 5.0

    assert sim.place(z=6.0, vx=12.0, wz=-40.0).result == OK
    state = sim.entity().state
    assert (state.header.frame_id, state.twist.linear.x, state.twist.angular.z) == (
        'map', 12.0, -40.0,
    )  # fmt: skip
    assert state.acceleration.linear.z < 0.0
    assert sim.code(StepSimulation, steps=10) == OK
    assert sim.entity().state.pose.position.x > 0.5

    assert sim.place(entity='other').result == NOT_FOUND
    for fields in ({'z': math.nan}, {'z': -1.0}, {'w': 0.5}, {'frame': 'base_link'}):
        assert sim.place(**fields).result == 101, fields
    for fields in ({'vx': math.nan}, {'vx': 1e6}, {'wz': math.inf}):
        result = sim.place(**fields)
        assert result.result == OPERATION_FAILED, fields
        assert 'twist' in result.error_message
    assert sim.entity().state.pose.position.x > 0.5  # the flight goes on


def test_many_steps_do_not_block_the_node(ros):
    sim = Standard(ros, {'auto_throw': False})
    assert sim.go_to(PAUSED) == OK
    steps = sim.begin(StepSimulation, steps=1_000_000)
    ros.spin_until(lambda: sim.state == PLAYING, 'the steps')
    assert sim.code(StepSimulation, steps=1) == OPERATION_FAILED
    assert not steps.done()
    assert sim.go_to(PAUSED) == OK
    ros.spin_until(steps.done, 'the interruption')
    result = steps.result().result
    assert result.result == OPERATION_FAILED
    assert 'of 1000000 steps were made until set_simulation_state 2' in result.error_message
    assert sim.state == PAUSED

    sim.begin(StepSimulation, steps=1_000_000)
    ros.spin_until(lambda: sim.state == PLAYING, 'the steps')
    assert sim.sim.end(signal.SIGINT) == 0
    assert 'Traceback' not in sim.sim.stderr


def test_a_reset_ends_the_steps_at_once(ros):
    sim = Standard(ros, {'launch.height': 3.0})
    assert sim.go_to(PAUSED) == OK
    for _ in range(5):
        steps = sim.begin(StepSimulation, steps=1_000_000)
        ros.spin_until(lambda: sim.state == PLAYING, 'the steps')
        assert sim.code(ResetSimulation) == OK
        pose, twist = sim.entity().state.pose, sim.entity().state.twist
        assert (pose.position.x, pose.position.z, twist.linear.x) == (0.0, 3.0, 0.0)
        ros.spin_until(steps.done, 'the interruption')
        assert 'until reset_simulation' in steps.result().result.error_message


def test_the_action_reports_each_step_and_can_be_cancelled(ros):
    sim = Standard(ros, {'auto_throw': False})
    client = ActionClient(ros.node, SimulateSteps, 'simulate_steps')
    ros.spin_until(client.server_is_ready, 'the action')
    # A client drops the feedback that it has not read when the result arrives.
    reports = ros.subscribe(SimulateSteps.Impl.FeedbackMessage, 'simulate_steps/_action/feedback')

    def simulate(steps):
        goal = client.send_goal_async(SimulateSteps.Goal(steps=steps))
        ros.spin_until(goal.done, 'the goal')
        return goal.result(), goal.result().get_result_async()

    def result_of(future):
        ros.spin_until(future.done, 'the result')
        return future.result().status, future.result().result.result.result

    succeeded, cancelled, aborted = 4, 5, 6
    assert result_of(simulate(3)[1]) == (aborted, OPERATION_FAILED)  # not paused
    assert sim.go_to(PAUSED) == OK
    for steps in (0, 2**64 - 1):
        assert result_of(simulate(steps)[1]) == (aborted, OPERATION_FAILED)
    before = sim.entity().state.header.stamp
    _, future = simulate(200)
    assert result_of(future) == (succeeded, OK)
    ros.spin_until(lambda: len(reports) == 200, '200 reports')
    counts = [(m.feedback.completed_steps, m.feedback.remaining_steps) for m in reports]
    assert counts == [(k, 200 - k) for k in range(1, 201)]
    after = sim.entity().state.header.stamp
    assert (after.sec - before.sec, after.nanosec) == (1, before.nanosec)

    goal, future = simulate(1_000_000)
    cancel = goal.cancel_goal_async()
    ros.spin_until(cancel.done, 'the cancellation')
    assert result_of(future) == (cancelled, OPERATION_FAILED)
    assert sim.state == PAUSED
    client.destroy()


def test_a_type_that_is_missing_is_not_offered(ros):
    before = 'import simulation_interfaces.srv as s; del s.GetEntityInfo, s.SetEntityState'
    sim = Standard(ros, {'auto_throw': False}, before=before)
    assert list(self_described(sim).features) == [8, 10, 20, 22, 24, 25, 26, 31, 32, 33]
    assert sim.entity().result.result == OK
    text = 'simulation_interfaces has no SetEntityState, GetEntityInfo: not offered'
    assert text in sim.sim.stderr
