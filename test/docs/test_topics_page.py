"""docs/topics.md names the topics, services, events and frames of sim_node, and no others."""

from collections.abc import Iterator
import dataclasses
from pathlib import Path
import re

import pytest

pytest.importorskip('rclpy')

from disc_sim_ros import topics
from disc_sim_ros.physics.flight_config import EventKey, Landing
from disc_sim_ros.quantities import CONTROL, CONTROL_MOMENT, LAUNCH, MEAN_WIND, POSITION
from disc_sim_ros.ros import qos
from disc_sim_ros.ros.sim import publishers
from disc_sim_ros.topics import FlightEvent, Frames

ROOT = Path(__file__).parents[2]
NODES = ROOT / 'disc_sim_ros/ros'
PAGE = (ROOT / 'docs/topics.md').read_text(encoding='utf-8')
TAKEN = {topics.CMD_MOMENT, topics.CMD_COEFFICIENTS, topics.WIND, topics.THROW}


def rows(heading: str) -> Iterator[list[str]]:
    """Yield the cells of the tables under a heading of any level, up to the next heading."""
    section = re.split(rf'^#+ {heading}$', PAGE, flags=re.MULTILINE)[1]
    section = re.split(r'^#+ ', section, flags=re.MULTILINE)[0]
    for line in section.splitlines():
        if line.startswith('| `'):
            yield [cell.strip() for cell in line.strip('|').split('|')]


def named(heading: str) -> list[str]:
    return [row[0].strip('`') for row in rows(heading)]


def source(name: str) -> str:
    return (NODES / f'{name}.py').read_text(encoding='utf-8')


def test_the_page_has_every_topic_and_no_other():
    constants = {
        value for name, value in vars(topics).items() if name.isupper() and isinstance(value, str)
    }
    page = named('Published') + named('Taken')
    assert len(page) == len(set(page))
    assert set(page) == constants - {topics.SPIN_JOINT}
    assert set(named('Taken')) == TAKEN


def test_types_are_those_of_the_code(types_of_topics):
    stated = {row[0].strip('`'): row[1].partition('/')[2] for row in rows('Published')}
    stated |= {row[0].strip('`'): row[1].partition('/')[2] for row in rows('Taken')}
    missing = {topics.TF} if publishers.TFMessage is None else set()
    assert {name: stated[name] for name in stated.keys() - missing} == types_of_topics
    assert stated[topics.TF] == 'TFMessage'


@pytest.fixture
def types_of_topics() -> dict[str, str]:
    """Return the types of all topics: a stand-in for a node records what is created."""
    from diagnostic_msgs.msg import DiagnosticArray

    from disc_sim_ros.ros.sim.commands import Commands
    from disc_sim_ros.ros.sinks import PublisherSinkFactory

    class Recorder:
        """Records types in place of a node: the test of a page needs no network."""

        def __init__(self):
            self.types = {topics.DIAGNOSTICS: DiagnosticArray.__name__}  # created by the node

        def create_publisher(self, kind, name, *_, **__):
            self.types[name] = kind.__name__
            return type('Publisher', (), {'publish': None})

        def create_subscription(self, kind, name, *_, **__):
            self.types[name] = kind.__name__

        def get_fully_qualified_name(self):
            return '/sim_node'

        def resolve_topic_name(self, name):
            return f'/{name}'

    recorder = Recorder()
    publishers.Publishers(PublisherSinkFactory(recorder), Frames(), with_clock=True)
    Commands(recorder, Frames())
    return recorder.types


def test_latched_topics_are_marked():
    latched = set(re.findall(r'topics\.(\w+), qos\.LATCHED_QOS', source('sim/publishers')))
    stated = {row[0].strip('`') for row in rows('Published') if 'latched' in row[-1]}
    assert stated == {getattr(topics, name) for name in latched}
    assert len(stated) == 5


def test_the_page_has_every_service_and_no_other():
    made = re.findall(r"create_service\((\w+), '([^']+)'", source('sim/services'))
    stated = {row[0].strip('`'): row[1].partition('/')[2] for row in rows('Services')}
    assert stated == {name: kind for kind, name in made}


def test_the_page_has_every_event_and_no_other():
    published = re.findall(r'Event\(\s*FlightEvent\.(\w+)', source('sim/events'))
    assert set(published) == set(FlightEvent.__members__)
    assert sorted(named('Events')) == sorted(FlightEvent)


def test_the_page_has_every_value_of_an_event():
    events = re.split('^### Events$', PAGE, flags=re.MULTILINE)[1].partition('\n## ')[0]
    stated = set(re.findall(r'`(\w+)`', events))
    keys = {value for name, value in vars(EventKey).items() if name.isupper()}
    assert {*keys, *Landing._fields} <= stated


def test_the_page_has_every_frame_and_no_other():
    assert named('Frames') == [field.default for field in dataclasses.fields(Frames)]


def test_limits_are_those_of_the_code():
    taken = {row[0].strip('`'): row[2] for row in rows('Taken')}
    moment, coefficient = CONTROL_MOMENT['control_M'], CONTROL['control_CM']
    wind, speed, rate = MEAN_WIND['wind_x'], LAUNCH['speed'], LAUNCH['spin']
    assert f'up to {moment.highest:g} {moment.unit}' in taken[topics.CMD_MOMENT]
    assert f'up to {coefficient.highest:g}' in taken[topics.CMD_COEFFICIENTS]
    assert f'up to {wind.highest:g} {wind.unit}' in taken[topics.WIND]
    assert f'up to {POSITION.highest / 1000:g} km' in taken[topics.THROW]
    assert f'up to {speed.highest:g} {speed.unit}' in taken[topics.THROW]
    assert f'up to {rate.highest:g} {rate.unit}' in taken[topics.THROW]
    assert f'p, q up to {LAUNCH["roll_rate"].highest:g} {rate.unit}' in taken[topics.THROW]


def test_numbers_in_the_text_are_those_of_the_code():
    from disc_sim_ros.ros.sim import commands, markers, realtime

    assert f'the last {publishers.LONGEST_PATH}' in PAGE
    assert f'the disc {markers.ENLARGEMENT:g} times enlarged' in PAGE
    assert f'lines every {markers.FIELD_SPACING:g} m' in PAGE
    assert f'most {commands.MOST_WAITING} of a topic' in PAGE
    assert f'up to {realtime.CATCH_UP:g} s of wall time' in PAGE
    assert f'every {qos.CLOCK_PERIOD * 1000:g} ms of wall time' in PAGE
    assert f'keep the last {qos.STATE_QOS.depth} messages' in PAGE
    assert f'reliable and keep the last {qos.COMMAND_QOS.depth} messages.' in PAGE
