"""The turn between the paper's axes and REP-103: its forms agree, and no other module has one."""

import ast
from collections.abc import Iterator
import math
from pathlib import Path
import re

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
import pytest

from disc_sim_ros.physics import frames, imu, theory
from disc_sim_ros.physics.kernels import equations
from disc_sim_ros.physics.kernels.equations import State, Velocity
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.trajectory import Trajectory, quantities
from disc_sim_ros.topics import Frames

PACKAGE = Path(__file__).parents[2] / 'disc_sim_ros'
ROUNDING = 1e-13  # of velocities of 30 m/s and accelerations of 300 m/s^2, relative


def states(count: int = 300) -> np.ndarray:
    """Return random states with unit quaternions, and the release of a level throw."""
    rng = np.random.default_rng(11)
    rows = rng.normal(size=(count, 14)) * 10.0
    rows[:, 6:10] /= np.linalg.norm(rows[:, 6:10], axis=1, keepdims=True)
    return np.vstack([rows, Launch(pitch=0.0).state()])


STATES = states()
EACH = [State(*row) for row in STATES.tolist()]


# ---- the forms agree ----


def test_the_turn_by_hand():
    """5 m forward, 3 m right, 2 m down is x 5, y -3, z -2."""
    assert frames.flip_yz((5.0, 3.0, 2.0)) == (5.0, -3.0, -2.0)
    assert frames.map_from_paper([5.0, 3.0, 2.0]).tolist() == [5.0, -3.0, -2.0]
    assert frames.flip(2.0) == -2.0


@pytest.mark.parametrize('value', [0.0, -0.0])
def test_scalars_have_no_minus_zero(value):
    turned = [frames.flip(value), *frames.flip_yz((0.0, value, value))]
    assert [math.copysign(1.0, x) for x in turned] == [1.0] * 4


def test_scalar_and_array_forms_are_one_turn_and_its_own_inverse():
    vectors = STATES[:, :3]
    turned = frames.map_from_paper(vectors)
    assert_array_equal(turned, [frames.flip_yz(v) for v in vectors.tolist()])
    assert_array_equal(turned[:, 1:], frames.flip(vectors[:, 1:]))
    assert_array_equal(frames.paper_from_map(turned), vectors)
    assert_array_equal(frames.flip(frames.flip(vectors)), vectors)


def test_quaternions_turn_like_their_vector_part():
    e = STATES[:, 6:10]
    xyzw = frames.message_quaternion(e)
    assert_array_equal(xyzw[:, :3], frames.map_from_paper(e[:, 1:]))
    assert_array_equal(xyzw[:, 3], e[:, 0])
    assert_array_equal(frames.paper_quaternion(xyzw), e)


def test_odometry_has_the_turned_vectors():
    numbers = np.array([frames.odometry(s) for s in EACH])
    e = STATES[:, 6:10]
    in_disc = np.einsum('nji,nj->ni', frames.rotation_matrix(e), STATES[:, 3:6])
    assert_array_equal(numbers[:, :3], frames.map_from_paper(STATES[:, :3]))
    assert_array_equal(numbers[:, 3:7], frames.message_quaternion(e))
    assert_allclose(numbers[:, 7:10], frames.map_from_paper(in_disc), atol=30 * ROUNDING)
    assert_array_equal(numbers[:, 10:], frames.map_from_paper(STATES[:, 10:13]))
    assert_array_equal(numbers[:, :7], [frames.pose(s) for s in EACH])


def test_odometry_of_many_states_has_the_bits_of_each():
    each = np.array([frames.odometry(s) for s in EACH])
    assert frames.odometry_array(STATES).tobytes() == each.tobytes()
    assert frames.odometry_array(STATES[0]).tobytes() == each[:1].tobytes()


def test_states_are_the_inverse_of_odometry():
    back = frames.states_from_odometry(frames.odometry_array(STATES))
    assert_allclose(back[:, :13], STATES[:, :13], atol=30 * ROUNDING)
    assert not back[:, 13].any()


def test_the_joint_turns_against_the_spin_angle():
    for s in EACH:
        angle, rate = frames.spin_joint(s)
        assert -math.pi <= angle <= math.pi
        assert math.remainder(angle - frames.flip(s.sigma), math.tau) == pytest.approx(0.0)
        assert rate == frames.flip(s.r)
        z, w = frames.spin_transform(s)
        assert (z, w) == (math.sin(angle / 2), math.cos(angle / 2))


def test_moments_are_given_in_the_three_frames_of_the_disc():
    axes = frames.moment_axes(Frames.prefixed('red/'))
    assert axes == {
        'red/disc': equations.DISC,
        'red/disc_body': equations.DISC_BODY,
        'red/disc_air': equations.DISC_AIR,
    }


def test_the_imu_reads_the_turned_vectors():
    """`imu.reading` writes the signs out; here the paper's axes are kept up to the last line."""
    rng = np.random.default_rng(5)
    for s, (acceleration, change, offset) in zip(
        EACH, rng.normal(size=(len(EACH), 3, 3)), strict=True
    ):
        to_earth = frames.rotation_matrix(s[6:10])
        w = np.array((s.p, s.q, s.r))
        despun = np.array((s.p, s.q, 0.0))
        angular = change + np.cross(despun, w)
        c, si = math.cos(s.sigma), math.sin(s.sigma)
        plastic = np.array(((c, si, 0.0), (-si, c, 0.0), (0.0, 0.0, 1.0)))  # from despun axes 2
        arm = plastic.T @ frames.paper_from_map(offset)
        force = to_earth.T @ (acceleration - (0.0, 0.0, 9.81))
        force += np.cross(angular, arm) + np.cross(w, np.cross(w, arm))
        expected = np.concatenate([frames.map_from_paper(plastic @ x) for x in (w, force)])
        reading = imu.reading(s, tuple(acceleration), tuple(change), tuple(offset), 9.81)
        assert_allclose(reading, expected, atol=1e4 * ROUNDING)


# ---- the angle of attack ----


def test_the_angle_of_attack_is_one_in_floats_arrays_and_the_equations():
    wind = Velocity(2.0, -3.0, 0.5)
    rows = np.hstack([np.zeros((len(EACH), 1)), STATES, np.tile(wind, (len(EACH), 1))])
    of_arrays = Trajectory(rows, 0.27).alpha
    assert np.ptp(of_arrays) > 2.0
    for s, alpha in zip(EACH, of_arrays.tolist(), strict=True):
        flow = equations.flow(s, wind)
        # 3e-16 of the polynomial in the compiled equations, and rounding of u, v and w.
        assert flow.alpha == pytest.approx(alpha, abs=1e-14)
        assert theory.angle_of_attack(flow.u, flow.v, flow.w) == pytest.approx(alpha, abs=1e-14)
        assert quantities(s, wind, 0.27).angle_of_attack == pytest.approx(alpha, abs=1e-14)


@pytest.mark.parametrize(
    ('uvw', 'degrees'),
    [
        ((10.0, 0.0, 0.0), 0.0),
        ((10.0, 0.0, 10.0), 45.0),  # air on the underside
        ((-10.0, 0.0, 10.0), 45.0),  # also backwards
        ((0.0, 10.0, -10.0), -45.0),
        ((0.0, 0.0, 5.0), 90.0),
        ((0.0, 0.0, 0.0), 0.0),
    ],
)
def test_the_angle_of_attack_by_hand(uvw, degrees):
    assert theory.angle_of_attack(*uvw) == pytest.approx(math.radians(degrees))
    arrays = [np.array([x, x]) for x in uvw]
    assert theory.angle_of_attack(*arrays).tolist() == pytest.approx([math.radians(degrees)] * 2)


# theory.py has the function and the kernels the compiled one; crosscheck.py is independent.
ANGLES = ('physics/theory.py', 'physics/kernels/', 'paper/crosscheck.py')
ANGLE = re.compile(r'\b(?:arctan2|atan2|arctangent)\(\s*(?:\w+\.)*w\b')


def test_no_other_module_has_the_angle_of_attack():
    places = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob('*.py')
        if ANGLE.search(path.read_text(encoding='utf-8'))
    }
    assert {place for place in places if not place.startswith(ANGLES)} == set()
    assert {home for home in ANGLES if not any(p.startswith(home) for p in places)} == set()


@pytest.mark.parametrize(
    'planted', ['math.atan2(w, math.hypot(u, v))', 'np.arctan2(a.w, u3)', 'atan2(\n    w, u3)']
)
def test_an_angle_of_attack_elsewhere_is_noticed(planted):
    assert ANGLE.search(planted)


# ---- no other module turns ----

# Components that differ in sign between the two kinds of axes.
TURNED = {
    'Y', 'Z', 'VY', 'VZ', 'V_Y', 'V_Z', 'apex_Z', 'height', 'y', 'z', 'vy', 'vz', 'q', 'r',
    'q_dot', 'r_dot', 'e2', 'e3', 'sigma', 'spin', 'psi', 'theta', 'yaw', 'pitch', 'heading',
    'drift',
}  # fmt: skip

# Turns that stay where they are: the file, the expression, and why.
EXCEPTIONS = {
    ('physics/launch.py', '-float(self.height)'): (
        'gives Z a minus zero at height 0, which is in the configuration of recorded flights'
    ),
    ('physics/imu.py', '0.0 - q'): 'in scalars, for the rate of the node; tested above',
    ('physics/imu.py', '0.0 - r'): 'the same',
    ('physics/imu.py', '0.0 - r_dot'): 'the same',
    ('physics/imu.py', '0.0 - math.sin(sigma)'): 'the same',
    ('paper/crosscheck.py', '-math.sin(pitch)'): 'an independent integrator shares no code',
    ('paper/crosscheck.py', '-math.sin(yaw)'): 'the same',
    ('paper/crosscheck.py', '-launch.height'): 'the same',
    ('envs/steering.py', '0.0 - z'): 'from the disc to a target on the ground, a difference',
    ('estimation/lift_coordinates.py', '-y'): 'a vector at right angles, no turn',
    ('estimation/prediction/lanes.py', '-y'): 'the same, compiled',
    (
        'estimation/prediction/lanes.py',
        '-Z',
    ): 'the climb of a velocity, an angle about no axis of a frame',
    (
        'estimation/prediction/lanes.py',
        '-math.asin(min(max((b * X - a * Y) / level, -1.0), 1.0))',
    ): 'the bank of an axis about its path, in one system',
    ('estimation/local.py', '-Y'): 'the shortest rotation of one vector to another',
    (
        'estimation/prediction/throw_fit.py',
        '-s.VY',
    ): 'how a landing moves with its height, in one system',
    ('estimation/prediction/prior.py', '-self.spin.mean'): 'the other hand, in one system',
    ('ros/recorder/diagnostics.py', '-r.before'): 'a count of messages, in descending order',
}
# physics/frames.py is the home of the turn; what numba compiles cannot import it.
HOMES = ('physics/frames.py', 'physics/kernels/')


def turns(source: str) -> Iterator[str]:
    """Yield the expressions of a module that change the sign of a component that turns.

    These are: 0 minus anything, and -1 times anything; minus a name, an attribute or an element
    with constant index above 0, also within a call; three signs, not all the same.
    """
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.BinOp):
            if isinstance(node.op, ast.Sub) and _is_number(node.left, 0):
                yield ast.unparse(node)
            if isinstance(node.op, ast.Mult) and (
                _is_number(node.left, -1) or _is_number(node.right, -1)
            ):
                yield ast.unparse(node)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            if any(map(_turns, _within(node.operand))):
                yield ast.unparse(node)
        elif isinstance(node, ast.Tuple | ast.List) and len(node.elts) == 3:
            signs = [sign for e in node.elts for sign in (-1, 1) if _is_number(e, sign)]
            if sorted(signs) in ([-1, -1, 1], [-1, 1, 1]):
                yield ast.unparse(node)


def _within(node: ast.AST) -> Iterator[ast.AST]:
    """Yield a node and what is in it, but not what only a length is taken of."""
    if not (isinstance(node, ast.Call) and getattr(node.func, 'id', '') == 'len'):
        yield node
        for child in ast.iter_child_nodes(node):
            yield from _within(child)


def _turns(node: ast.AST) -> bool:
    if isinstance(node, ast.Subscript):
        last = node.slice.elts[-1] if isinstance(node.slice, ast.Tuple) else node.slice
        return isinstance(last, ast.Constant) and isinstance(last.value, int) and last.value > 0
    name = node.id if isinstance(node, ast.Name) else getattr(node, 'attr', None)
    return name in TURNED


def _is_number(node: ast.AST, value: float) -> bool:
    try:
        number = ast.literal_eval(node)
    except ValueError:
        return False
    return isinstance(number, int | float) and number == value


def test_no_other_module_turns_axes():
    expressions = {
        (path.relative_to(PACKAGE).as_posix(), expression)
        for path in PACKAGE.rglob('*.py')
        if not path.relative_to(PACKAGE).as_posix().startswith(HOMES)
        for expression in turns(path.read_text(encoding='utf-8'))
    }
    assert expressions - EXCEPTIONS.keys() == set(), 'use disc_sim_ros.physics.frames'
    assert EXCEPTIONS.keys() - expressions == set(), 'exceptions without a case'


@pytest.mark.parametrize(
    'planted',
    [
        'x, y, z = s.X, 0.0 - s.Y, 0.0 - s.Z',
        'climb = math.atan2(-s.VZ, speed)',
        'height = -float(state[2])',
        'spin = -numbers[max(row - 1, 0), 12]',
        'in_map = position * (1.0, -1.0, -1.0)',
        'in_map = position * np.array([1, -1, -1])',
        'left = -1.0 * right',
        'heading = -math.degrees(yaw)',
        'xyzw = e[..., 1], -e[..., 2], -e[..., 3], e[..., 0]',
    ],
)
def test_a_turn_elsewhere_is_noticed(planted):
    assert list(turns(planted))


@pytest.mark.parametrize(
    'innocent',
    [
        'low, high = -limit, limit',
        'q_dot = p * r - q',
        'last = rows[-1]',
        'decimals = -len(parts[2])',
        'chunks = -(-size // batch)',
        'signs = (1, 1, 1)',
        'drag = -C.Drag * a.u',
    ],
)
def test_other_signs_are_no_turn(innocent):
    assert list(turns(innocent)) == []
