"""Recorded flights: a bag of version 0.1.0, and what topics and types a bag of sim_node has."""

from pathlib import Path

import pytest

from disc_sim_ros import __version__, topics
from disc_sim_ros.analysis import bag_analysis, recording, resimulate
from disc_sim_ros.analysis.flights import flights
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.physics import flight_config
from disc_sim_ros.topics import FlightEvent, Frames

# 20 Hz of a steered flight in gusts, which lands, is thrown again and reset, with frame_prefix
# red/; made by steered_bag of bags.py with the code of version 0.1.0.
OLD = Path(__file__).parents[1] / 'data' / 'recorded_by_0_1_0'


@pytest.fixture(scope='module')
def old() -> recording.Disc:
    (disc,) = recording.discs(open_bag(OLD))
    return disc


def test_all_of_an_old_bag_is_read(old):
    assert (old.name, old.namespace, len(old.motion)) == ('red', '', 38)
    assert old.topics == set(topics.FLIGHT_TOPICS)
    assert [e.name for e in old.events] == [
        FlightEvent.THROWN,
        *[FlightEvent.COMMAND_EXPIRED] * 2,
        FlightEvent.LANDED,
        FlightEvent.THROWN,
        FlightEvent.RESET,
    ]
    assert {c.topic for c in old.changes} == set(topics.APPLIED)
    assert [f.ended for f in flights(old)] == [FlightEvent.LANDED, FlightEvent.RESET]


def test_flights_of_an_old_bag_are_flown_again(old):
    for flight, count in zip(flights(old), (30, 4), strict=True):
        again = resimulate.fly_again(flight)
        assert again.config.version == '0.1.0'
        verdict = resimulate.compare(flight, again)
        assert verdict.compared == count
        # To the last bit where it was recorded; other processors may round sin and cos otherwise.
        assert max(verdict.largest.values()) < 1e-9
        assert [d for d in verdict.doubts if 'version 0.1.0 flew it' not in d] == []
        assert bool(verdict.doubts) == (__version__ != '0.1.0')
        landed = flight.ended == FlightEvent.LANDED
        assert ('landed.range_m' in verdict.largest) == landed
        assert (bag_analysis.analyse(flight).landing is not None) == landed


def test_the_configuration_of_an_old_bag_would_be_written_the_same(old):
    texts = [m.value.data for m in open_bag(OLD).messages(['/configuration'])]
    assert len(texts) == len(old.releases) == 2
    for text in texts:
        config = flight_config.from_document(flight_config.document_of(text))
        assert flight_config.configuration_text(config) == text


def test_types_are_those_of_sim_node(tmp_path):
    pytest.importorskip('rclpy')
    from analysis.bags import steered_bag

    bag = open_bag(steered_bag(tmp_path / 'bag', publish_rate=10.0, physics_rate=1000.0))
    types = {info.topic.name: info.topic.type for info in bag.topics}
    for name, kind in topics.FLIGHT_TOPICS.items():
        assert types[f'/{name}'] == kind
    assert types[f'/{topics.ODOM}'] == topics.MessageType.ODOMETRY
    assert types[f'/{topics.POSE}'] == topics.MessageType.POSE


def test_parameters_of_the_wind_profile_are_those_of_sim_node():
    pytest.importorskip('rclpy')
    from disc_sim_ros.ros.sim.config import configuration

    before = configuration({}).setup.wind
    for name, value in zip(topics.WIND_PROFILE, (0.5, 20.0), strict=True):
        wind = configuration({name: value}).setup.wind
        assert getattr(wind, name.removeprefix('wind.')) == value
        assert wind != before


@pytest.mark.parametrize('prefix', ['', 'red/', 'a/b/', 'disc'])
def test_frames_of_a_recorded_disc_are_those_of_its_prefix(prefix):
    frames = Frames.prefixed(prefix)
    assert Frames.of_disc(frames.disc) == frames


def test_losses_are_those_of_the_recorder_and_of_others():
    noted = {f'{loss} /odom': '3' for loss in topics.Loss} | {'drops': '1'}
    rest = {'recorder': '/recorder_node', 'dropped /pose': '0', 'lost /tf': ''}
    assert bag_analysis.losses(noted | rest) == list(noted.items())


def test_a_reset_without_time_between_ends_the_flight_before(tmp_path):
    """While simulated time stands still, reset and throw have one stamp; their order counts."""
    pytest.importorskip('rclpy')
    from analysis.bags import Made
    from disc_sim_ros.bags.writer import BagWriter

    with BagWriter(tmp_path / 'bag') as writer:
        made = Made(writer, publish_rate=10.0, physics_rate=1000.0)
        made.go(0.5)
        made.simulation.reset(rearm=True)
        assert made.simulation.throw_due
        made.simulation.publish()
        made.simulation.publish_step()
        made.go(0.5)
    (disc,) = recording.discs(open_bag(tmp_path / 'bag'))
    first, second = flights(disc)
    assert first.ended == FlightEvent.RESET
    assert second.ended == recording.END_OF_BAG
    assert second.start == first.start + 400_000_000  # the first is thrown at the first message
    verdicts = [resimulate.compare(f, resimulate.fly_again(f)) for f in (first, second)]
    assert [(v.compared, v.identical) for v in verdicts] == [(4, 4), (6, 6)]
