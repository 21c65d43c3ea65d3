"""Motion from the bytes of messages, and its checks, which need no simulator."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
import pytest
from scipy.spatial.transform import Rotation

from analysis import foreign
from analysis.foreign import GRAVITY, SECOND, START, STORE, Parabola
from disc_sim_ros.analysis import checks
from disc_sim_ros.analysis.flights import flights, velocities
from disc_sim_ros.analysis.odometry import ODOMETRY, POSE, motions
from disc_sim_ros.analysis.recording import Disc
from disc_sim_ros.bags.reader import RawMessage
from disc_sim_ros.errors import BagError
from disc_sim_ros.physics import frames as paper_frames


def raw(messages, topic='/odom', *, little_endian=True):
    return [
        RawMessage(
            topic,
            at,
            at,
            bytes(STORE.serialize_cdr(m, m.__msgtype__, little_endian=little_endian)),
        )
        for at, m in messages
    ]


@pytest.mark.parametrize('little_endian', [True, False])
@pytest.mark.parametrize('frames', [('map', 'disc'), ('m', ''), ('odometry', 'red/disc')])
def test_numbers_are_read_at_any_offset_and_in_both_byte_orders(frames, little_endian):
    rng = np.random.default_rng(1)
    numbers = rng.normal(size=(5, 13))
    messages = [
        (
            START + i,
            foreign.odometry(
                START + 3 * i, row[:3], row[3:7], row[7:10], row[10:], frame=frames[0],
                child=frames[1],
            ),
        )
        for i, row in enumerate(numbers)
    ]  # fmt: skip
    (motion,) = motions(raw(messages, little_endian=little_endian), ODOMETRY)
    assert (motion.frame, motion.child) == frames
    assert_array_equal(motion.numbers, numbers)
    assert_array_equal(motion.stamps, START + 3 * np.arange(5))
    assert_array_equal(motion.log, START + np.arange(5))


def test_each_child_frame_and_type_is_a_motion_of_its_own():
    parabola = Parabola()
    both = [*parabola.odometry(child='red/disc'), *parabola.odometry(child='blue/disc')]
    bodies = motions(raw(both), ODOMETRY)
    assert [m.child for m in bodies] == ['red/disc', 'blue/disc']
    assert_array_equal(bodies[0].numbers, bodies[1].numbers)
    (poses,) = motions(raw(parabola.poses(), '/pose'), POSE)
    assert not poses.has_twist
    assert_array_equal(poses.position, parabola.position)


@pytest.mark.parametrize(
    'change', [lambda d: d[:40], lambda d: b'\x00\x03' + d[2:], lambda d: b'']
)
def test_bytes_of_another_kind_are_refused(change):
    (good, *_) = raw(Parabola().odometry())
    with pytest.raises(BagError, match=r'^/odom: '):
        motions([good._replace(data=change(good.data))], ODOMETRY)


def test_states_have_the_velocity_over_the_ground():
    parabola = Parabola()
    (motion,) = motions(raw(parabola.odometry()), ODOMETRY)
    states = paper_frames.states_from_odometry(motion.numbers)
    # Turned into the body and back: rounding of numbers of 12 m/s.
    assert_allclose(states[:, 3:6], paper_frames.paper_from_map(parabola.velocity), atol=1e-13)
    assert_allclose(states[:, 12], parabola.spin, rtol=1e-15)


def test_a_parabola_is_measured_from_its_poses_alone():
    parabola = Parabola()
    (motion,) = motions(raw(parabola.poses(), '/pose'), POSE)
    # Central differences of a parabola are exact but for rounding: 1e-16 * 15 m / 0.01 s.
    assert_allclose(velocities(motion), parabola.velocity, atol=1e-11)
    twisted = checks.with_twist(motion)
    # START is of today: stamps are whole nanoseconds, 1e-7 of the time between two.
    assert_allclose(twisted.numbers[:, 10:], [[0, 0, -parabola.spin]] * len(motion), atol=1e-5)
    time, place = checks.ground_crossing(motion)
    # Linear between two messages: g dt^2 / 8 / (speed of descent 8.6 m/s).
    assert time == pytest.approx(parabola.time, abs=GRAVITY * 1e-4 / 8 / 8)
    assert_allclose(place[:2], parabola.landing, atol=2e-4)


def test_checks_name_what_is_wrong():
    parabola = Parabola()

    def failed(**changes):
        (motion,) = motions(raw(parabola.odometry(**changes)), ODOMETRY)
        return {c.name: c.text for c in checks.checks(motion) if not c.passed}

    assert failed() == {}
    assert 'given in map' in failed(in_map=True)['velocity']
    assert set(failed(norm=1.01)) == {'quaternion_norm'}
    twice = parabola.odometry()
    twice.insert(5, twice[4])
    (motion,) = motions(raw(twice), ODOMETRY)
    assert [c.name for c in checks.checks(motion) if not c.passed] == ['stamps']
    stamps = checks.stamps_of(motions(raw(parabola.odometry(skip=(7, 8, 20))), ODOMETRY)[0])
    assert (stamps.missing, stamps.repeated, stamps.even) == (3, 0, False)
    assert stamps.rate == pytest.approx(100.0)
    assert stamps.longest == pytest.approx(0.03)


def test_flights_without_throws_end_with_rest_gaps_and_jumps():
    parabola = Parabola()

    def rest(start, place):
        turn = Rotation.identity().as_quat()
        return [
            (at, foreign.odometry(at, place, turn, (0, 0, 0), (0, 0, 0)))
            for at in range(start, start + SECOND, SECOND // 100)
        ]

    length = len(parabola.t) * SECOND // 100
    first = START + SECOND
    second = first + length + SECOND
    third = second + length + 5 * SECOND  # a gap
    fourth = third + length  # without a pause, from elsewhere
    messages = [
        *rest(START, (0, 0, 2)),
        *parabola.odometry(first),
        *rest(first + length, parabola.position[-1]),
        *parabola.odometry(second),
        *parabola.odometry(third),
        *parabola.odometry(fourth),
    ]
    (motion,) = motions(raw(messages), ODOMETRY)
    flown = flights(Disc(motion))
    assert [flight.ended for flight in flown] == ['rest', 'gap', 'jump', 'end of the bag']
    assert [flight.start for flight in flown] == [first, second, third, fourth]
