"""The rules of simulation_interfaces, without that package: states, steps, filters, entities."""

import itertools
import math
import time
from types import SimpleNamespace

from geometry_msgs.msg import Pose, Twist
import numpy as np
from numpy.testing import assert_allclose
import pytest
from scipy.spatial.transform import Rotation
from std_msgs.msg import Header

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics import frames as paper_frames
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.cdr_template import assign
from disc_sim_ros.ros.sim.standard import rules
from disc_sim_ros.ros.sim.standard.offers import OFFERS
from disc_sim_ros.ros.sim.standard.rules import Code, SimState
from disc_sim_ros.topics import Frames
from sample_discs import FRISBEE

WOBBLING = Launch(
    speed=14.0, pitch=20.0, roll=-35.0, yaw=70.0, sideslip=8.0, spin=45.0, roll_rate=6.0,
    pitch_rate=-4.0, height=3.0,
)  # fmt: skip


def test_the_names_are_those_of_the_standard():
    assert [offer.name for offer in OFFERS] == [
        'get_simulator_features',
        'get_simulation_state',
        'set_simulation_state',
        'reset_simulation',
        'step_simulation',
        'simulate_steps',
        'get_entities',
        'get_entities_states',
        'get_entity_state',
        'set_entity_state',
        'get_entity_info',
    ]


def test_every_transition():
    """The comments of SetSimulationState.srv: 101 is the state already, 103 pause from stopped."""
    refused = {(state, state): 101 for state in SimState}
    refused[SimState.STOPPED, SimState.PAUSED] = 103
    for now, target in itertools.product(SimState, SimState):
        assert rules.transition(now, target).code == refused.get((now, target), Code.OK)
    for target in (4, 5, 255):  # the world of 2.0, and no state at all
        answer = rules.transition(SimState.PLAYING, target)
        assert answer.code == Code.FEATURE_UNSUPPORTED
        assert str(target) in answer.text


def test_only_the_state_is_reset():
    codes = {scope: rules.check_scope(scope).code for scope in range(256)}
    possible = {scope for scope, code in codes.items() if code == Code.OK}
    assert possible == {0, 2, 255}
    assert {codes[scope] for scope in codes.keys() - possible} == {Code.FEATURE_UNSUPPORTED}


@pytest.mark.parametrize('steps', [0, 1_000_001, 2**63, 2**64 - 1])
def test_steps_out_of_range_are_refused(steps):
    answer = rules.check_steps(steps, SimState.PAUSED)
    assert answer.code == Code.OPERATION_FAILED
    assert answer.text == f'steps: {steps} is not allowed; give a whole number from 1 to 1000000'


def test_steps_need_a_paused_simulation():
    for state in SimState:
        expected = Code.OK if state == SimState.PAUSED else Code.OPERATION_FAILED
        assert rules.check_steps(1, state).code == expected


@pytest.mark.parametrize(
    ('pattern', 'matches'),
    [
        ('', True),
        ('disc', True),
        ('^red/d', True),
        ('^disc', False),
        ('(blue|red)/[[:alpha:]]{4}$', True),  # a class that only POSIX has
        ('-e', False),
        ('$(exit 0)', False),  # no shell reads it
    ],
)
def test_names_match_a_posix_expression(pattern, matches):
    assert rules.match_name('red/disc', pattern) == (rules.DONE, matches)


@pytest.mark.parametrize('pattern', ['(', '((.{1,255}){1,255}){1,255}', 'a\0b', '\ud800'])
def test_a_bad_or_endless_expression_is_refused(pattern):
    start = time.monotonic()
    answer, matches = rules.match_name('red/disc', pattern)
    assert answer.code == Code.OPERATION_FAILED
    assert not matches
    assert 'regular expression' in answer.text
    assert time.monotonic() - start < 2 * rules.LONGEST_MATCH


@pytest.mark.parametrize(
    ('centre', 'radius', 'touches'),
    [
        ((0.0, 0.0, 0.5), 0.51, True),
        ((0.0, 0.0, 0.5), 0.49, False),
        ((3.0, 4.0, 0.0), 4.9, True),  # the rim is 0.15 m from the centre
        ((3.0, 4.0, 0.0), 4.8, False),
        ((0.15, 0.4, 0.3), math.hypot(math.hypot(0.15, 0.4) - 0.15, 0.3) + 1e-9, True),
    ],
)
def test_a_sphere_touches_the_plate(centre, radius, touches):
    assert rules.overlaps_sphere(0.15, centre, radius) is touches


# ---- the state of the disc ----


def entity(motion=None, state=None):
    """An object with the fields of an EntityState, for a state of the physics."""
    message = SimpleNamespace(header=Header(), pose=Pose(), twist=Twist())
    if state is not None:
        for path, value in zip(messages.POSE_FIELDS, messages.pose(state), strict=True):
            assign(message, path, value)
        vectors = zip(('twist.linear', 'twist.angular'), motion[:2].tolist(), strict=True)
        for path, vector in vectors:
            for axis, value in zip('xyz', vector, strict=True):
                assign(message, f'{path}.{axis}', value)
    return message


def motion_of(sim):
    observed = sim.observe()
    return paper_frames.motion_in_map(sim.state, observed[:3], observed[3:6])


def test_twist_and_acceleration_are_those_of_the_map():
    """Against the twist of Odometry, which is that of the disc, turned by SciPy."""
    sim = FlightSimulator(Setup(disc=FRISBEE, step=1e-4), WOBBLING.state())
    sim.advance(3000)
    odometry = np.array(messages.odometry(sim.state))
    turn = Rotation.from_quat(odometry[3:7])
    motion = motion_of(sim)
    assert_allclose(motion[0], turn.apply(odometry[7:10]), atol=1e-12)
    assert_allclose(motion[1], turn.apply(odometry[10:13]), atol=1e-12)


def test_the_accelerations_are_the_derivatives_of_the_twist():
    sim = FlightSimulator(Setup(disc=FRISBEE, step=1e-4), WOBBLING.state())
    sim.advance(2999)
    before = motion_of(sim)
    sim.advance(1)
    now = motion_of(sim)
    sim.advance(1)
    after = motion_of(sim)
    derivatives = (after[:2] - before[:2]) / 2e-4
    # Central differences: h^2/6 of the third derivatives. A wobble of 7 rad/s at twice the spin
    # has 7 * 90^3 = 5e6.
    assert_allclose(now[2:], derivatives, atol=1e-2)
    assert np.abs(now[3]).max() > 50.0  # the wobble is no small one


def test_a_state_is_the_inverse_of_what_is_reported():
    sim = FlightSimulator(Setup(disc=FRISBEE, step=1e-3), WOBBLING.state())
    sim.advance(300)
    s = sim.state
    message = entity(motion_of(sim), s)
    position, e = messages.pose_from_entity(message, Frames())
    velocity, rates = messages.twist_from_entity(message, e, Frames())
    assert position == (s.X, s.Y, s.Z)
    assert_allclose(e, (s.e0, s.e1, s.e2, s.e3), atol=1e-15)
    assert_allclose(velocity, (s.VX, s.VY, s.VZ), atol=1e-13)
    assert_allclose(rates, (s.p, s.q, s.r), atol=1e-12)


@pytest.mark.parametrize(
    ('path', 'value'),
    [
        ('pose.position.x', math.nan),
        ('pose.position.z', 1e300),
        ('pose.orientation.w', 0.5),
        ('header.frame_id', 'disc'),
    ],
)
def test_a_bad_pose_is_refused(path, value):
    message = entity()
    assign(message, path, value)
    with pytest.raises(ConfigError, match=path.split('.')[1]):
        messages.pose_from_entity(message, Frames())


@pytest.mark.parametrize(
    ('path', 'value'),
    [
        ('twist.linear.x', math.inf),
        ('twist.linear.y', 1e9),
        ('twist.angular.z', math.nan),
        ('twist.angular.x', 1290.0),  # tumbles faster than a roll rate may be
        ('header.frame_id', 'odom'),
    ],
)
def test_a_bad_twist_is_refused(path, value):
    message = entity()
    assign(message, path, value)
    with pytest.raises(ConfigError, match=path.split('.')[1]):
        messages.twist_from_entity(message, (1.0, 0.0, 0.0, 0.0), Frames())
