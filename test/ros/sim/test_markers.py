"""The markers: the disc, and the field of a flight from its release to its landing."""

import math

import pytest

pytest.importorskip('rclpy')

from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from disc_sim_ros import topics
from disc_sim_ros.physics.flight import fly
from disc_sim_ros.ros.sim.commands import Commands
from disc_sim_ros.ros.sim.config import configuration
from disc_sim_ros.ros.sim.markers import (
    ENLARGEMENT,
    FIELD_AHEAD,
    FIELD_SPACING,
    disc_markers,
    field_markers,
)
from disc_sim_ros.ros.sim.publishers import Publishers
from disc_sim_ros.ros.sim.simulation import Simulation
from disc_sim_ros.topics import Frames

FRAMES = Frames.prefixed('red/')
DIAMETER = 0.275
LARGEST = 100_000  # bytes of a latched message, which each new subscription gets


def by_namespace(message: MarkerArray) -> dict[str, list[Marker]]:
    markers: dict[str, list[Marker]] = {}
    for marker in message.markers:
        markers.setdefault(marker.ns, []).append(marker)
    return markers


def radius(marker: Marker) -> float:
    return max(math.hypot(p.x, p.y) for p in marker.points)


def test_the_disc_of_the_field_is_an_enlargement_of_the_disc():
    (true_size,) = disc_markers(FRAMES.disc_body, DIAMETER).markers
    (enlarged,) = by_namespace(field_markers(FRAMES, DIAMETER, (0, 0, 0)))['disc_enlarged']
    assert radius(true_size) == pytest.approx(0.5 * DIAMETER)
    assert radius(enlarged) == pytest.approx(ENLARGEMENT * 0.5 * DIAMETER)
    assert enlarged.colors == true_size.colors
    assert enlarged.header.frame_id == true_size.header.frame_id == 'red/disc_body'


def test_lines_have_their_distances():
    markers = by_namespace(field_markers(FRAMES, DIAMETER, (0, 0, 0)))
    (lines,) = markers['lines']
    ends = zip(lines.points[::2], lines.points[1::2], strict=True)
    across = {start.x for start, end in ends if start.x == end.x}
    assert {x for x in across if x >= 0} == {text.pose.position.x for text in markers['distances']}
    assert [text.text for text in markers['distances']][:3] == ['0 m', '10 m', '20 m']
    assert max(across) == FIELD_AHEAD
    assert sorted(across)[1] - sorted(across)[0] == FIELD_SPACING
    assert len(lines.points) == len(lines.colors)


def test_every_marker_is_one_that_viewers_show():
    message = field_markers(FRAMES, DIAMETER, (1, 2, 3), (20, -3, 0), '20 m')
    shown = message.markers
    assert len({(marker.ns, marker.id) for marker in shown}) == len(shown)
    for marker in shown:
        assert marker.frame_locked
        assert marker.header.frame_id in {'map', 'red/disc_body'}
        assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == (0, 0)
        assert marker.pose.orientation.w == 1.0
        assert max(marker.scale.x, marker.scale.y, marker.scale.z) > 0.0
        assert marker.color.a == 1.0
    assert len(serialize_message(message)) < LARGEST


def test_a_new_flight_deletes_the_landing_of_the_last_one():
    before = by_namespace(field_markers(FRAMES, DIAMETER, (0, 0, 0), (20, -3, 0), '20 m'))
    after = by_namespace(field_markers(FRAMES, DIAMETER, (0, 0, 0)))
    for name in ('landing', 'result'):
        assert [marker.action for marker in before[name]] == [Marker.ADD]
        assert [marker.action for marker in after[name]] == [Marker.DELETE]
        assert [marker.id for marker in before[name]] == [marker.id for marker in after[name]]


class ListSinkFactory:
    """Makes sinks without a network, which keep what is published."""

    node_name = 'sim_node'

    def __init__(self):
        self.messages = {}

    def sink(self, message_type, name, qos, template=None):
        sink = type('ListSink', (), {'has_subscribers': False})()
        sink.publish = self.messages.setdefault(name, []).append
        sink.send = lambda *values: sink.publish(template.pack(*values))
        return sink


def received(published: bytes | MarkerArray) -> dict[str, list[Marker]]:
    """Return a message or its bytes as a subscriber gets it: its colours have 32 bits."""
    data = published if isinstance(published, bytes) else serialize_message(published)
    return by_namespace(deserialize_message(data, MarkerArray))


def test_a_flight_shows_its_disc_from_the_start_and_its_landing_at_the_end():
    factory = ListSinkFactory()
    config = configuration({})
    publishers = Publishers(factory, Frames(), with_clock=False)
    sim = Simulation(config, publishers, Commands(None, Frames()), 0, print)
    sim.publish_markers()
    sim.throw()
    while sim.flying:
        sim.advance(config.steps_per_publish)
    waiting, thrown, landed = map(received, factory.messages[topics.FIELD_MARKERS])
    assert len(factory.messages[topics.MARKERS]) == 2
    assert waiting['disc_enlarged'] == thrown['disc_enlarged'] == landed['disc_enlarged']
    flight = fly(config.launch, config.setup)
    (spot,), (text,) = landed['landing'], landed['result']
    assert [spot.pose.position.x, spot.pose.position.y] == pytest.approx(
        flight.position[:2].tolist(), abs=1e-9
    )
    assert text.text == f'{flight.range:.2f} m in {flight.time:.3f} s'
