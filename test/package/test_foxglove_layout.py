"""The Foxglove layout shows existing topics, and a flight fits into its views."""

from collections.abc import Iterator
import json
import math
from pathlib import Path
import re
from typing import get_type_hints
import xml.etree.ElementTree as ET

import numpy as np
import pytest

pytest.importorskip('rclpy')

from nav_msgs.msg import Path as PathMessage
from visualization_msgs.msg import MarkerArray

from disc_sim_ros import topics
from disc_sim_ros.physics import frames as paper_frames
from disc_sim_ros.physics.flight import fly
from disc_sim_ros.ros.predictor import outputs
from disc_sim_ros.ros.sim.config import configuration
from disc_sim_ros.ros.sim.publishers import Publishers
from disc_sim_ros.topics import Frames

ROOT = Path(__file__).parents[2]
LAYOUT = json.loads((ROOT / 'config/foxglove_layout.json').read_text(encoding='utf-8'))
PANELS = LAYOUT['configById']
PAGE = (ROOT / 'docs/foxglove.md').read_text(encoding='utf-8')
FIELD, CLOSE = PANELS['3D!field'], PANELS['3D!disc']
WIDEST, NARROWEST = (
    4.5,
    2.6,
)  # width / height of the field, without and with a side bar
PREDICTED = json.loads((ROOT / 'config/predictor_layout.json').read_text(encoding='utf-8'))
# Of the views of the predictor, without and with a side bar.
PREDICTED_WIDTHS = {'3D!field': (1.83, 1.5), '3D!above': (1.12, 0.93)}
CLOSE_UP = 0.7  # width / height of the close-up, with a side bar
NUMBER = {'double', 'float', 'int32', 'uint32', 'int64'}
MODIFIERS = {'.@rad2deg', '.@sqrt'}


# ---- panels ----


def leaves(tree: dict | str) -> Iterator[str]:
    """Yield the panels of a tree of splits."""
    if isinstance(tree, str):
        yield tree
        return
    assert tree['direction'] in {'row', 'column'}
    assert 0 < tree['splitPercentage'] < 100
    assert set(tree) == {'direction', 'first', 'second', 'splitPercentage'}
    yield from leaves(tree['first'])
    yield from leaves(tree['second'])


def of_kind(kind: str) -> dict[str, dict]:
    return {name: panel for name, panel in PANELS.items() if name.startswith(f'{kind}!')}


def test_every_panel_is_placed_once():
    placed = list(leaves(LAYOUT['layout']))
    assert len(placed) == len(set(placed))
    assert set(placed) == set(PANELS)
    assert {name.partition('!')[0] for name in placed} == {'3D', 'Plot', 'Gauge'}
    assert LAYOUT['playbackConfig'] == {'speed': 1}
    assert LAYOUT['globalVariables'] == LAYOUT['userNodes'] == {}


def test_the_page_explains_the_title_of_every_panel():
    for panel in PANELS.values():
        title, _, _ = panel['foxglovePanelTitle'].partition(' [')
        assert title.partition(',')[0].lower() in PAGE.lower()


def test_colours_are_valid():
    colours = re.findall(r'"(#[^"]*)"', json.dumps(PANELS))
    assert len(colours) > 8
    assert [c for c in colours if not re.fullmatch('#([0-9a-fA-F]{2}){3,4}', c)] == []


# ---- topics and fields ----


class TypesOfTopics:
    """A factory of sinks that keeps the types of the topics: no network is needed."""

    node_name = 'sim_node'

    def __init__(self):
        self.of = {}

    def sink(self, message_type, name, qos, template=None):
        self.of[name if name.startswith('/') else f'/{name}'] = message_type
        return type('Sink', (), {'publish': None})()


@pytest.fixture(scope='module')
def kinds() -> dict[str, type]:
    types = TypesOfTopics()
    Publishers(types, Frames(), with_clock=True)
    return types.of


def paths() -> list[str]:
    plots = [path['value'] for panel in of_kind('Plot').values() for path in panel['paths']]
    return plots + [panel['path'] for panel in of_kind('Gauge').values()]


def slots(kind: type, names: list[str]) -> str:
    """Return the type of a nested field, or of an element of an array, of a message type."""
    for name in names[:-1]:
        kind = type(getattr(kind(), name))
    last, _, index = names[-1].partition('[')
    declared = kind.get_fields_and_field_types()[last]
    if not index:
        return declared
    element, _, size = declared.partition('[')
    assert 0 <= int(index.rstrip(']')) < int(size.rstrip(']'))
    return element


def test_plots_and_gauges_show_numbers_of_existing_topics(kinds):
    for path in paths():
        plain, modifier, _ = path.partition('.@')
        assert not modifier or path[len(plain) :] in MODIFIERS
        topic, *names = plain.split('.')
        assert slots(kinds[topic], names) in NUMBER


def test_plots_show_height_airspeed_angle_of_attack_and_spin():
    shown = {path.partition('.')[0].lstrip('/') for path in paths()}
    assert shown == {topics.POSE, topics.AIRSPEED, topics.ANGLE_OF_ATTACK, topics.SPIN_RATE}


def test_plots_show_the_whole_bag_on_one_time_axis():
    for plot in of_kind('Plot').values():
        assert plot['isSynced']
        assert plot['xAxisVal'] == 'timestamp'
        assert all(path['enabled'] for path in plot['paths'])
        assert {path['timestampMethod'] for path in plot['paths']} == {'receiveTime'}
        assert not {'minXValue', 'maxXValue', 'followingViewWidth'} & set(plot)


@pytest.fixture(scope='module')
def flight():
    """Return the flight of Fig. 5, with a sample at each message."""
    config = configuration({})
    return fly(config.launch, config.setup, sample_rate=config.publish_rate)


def test_gauges_cover_the_values_of_the_flight(flight):
    t = flight.trajectory
    values_of = {'/airspeed.data': t.airspeed, '/angle_of_attack.data': t.alpha}
    for gauge in of_kind('Gauge').values():
        values = values_of[gauge['path']]
        assert gauge['minValue'] < gauge['maxValue']
        assert gauge['minValue'] <= values.min()
        assert values.max() <= gauge['maxValue']
        assert np.ptp(values) > 0.1 * (gauge['maxValue'] - gauge['minValue'])  # the needle moves


# ---- views ----


def visible(panel: dict) -> set[str]:
    return {topic for topic, settings in panel['topics'].items() if settings['visible']}


def test_views_show_their_topics(kinds):
    assert visible(FIELD) == {f'/{topics.FIELD_MARKERS}', f'/{topics.PATH}'}
    assert visible(CLOSE) == {f'/{topics.MARKERS}'}
    for panel in of_kind('3D').values():
        assert set(panel['topics']) <= set(kinds)
        assert {kinds[topic] for topic in visible(panel)} <= {MarkerArray, PathMessage}
        frames = {f'frame:{name}' for name in ('map', 'disc', 'disc_body')}
        assert set(panel['transforms']) == frames


def test_views_follow_existing_frames():
    frames = Frames()
    assert (FIELD['followTf'], CLOSE['followTf']) == (frames.map, frames.disc)
    for panel in of_kind('3D').values():
        assert panel['followMode'] == 'follow-pose'
        assert {layer['frameId'] for layer in panel['layers'].values()} == {frames.map}


def on_screen(panel: dict, points: np.ndarray, aspect: float) -> np.ndarray:
    """Return points, shape (n, 3), in a view: right and up, shape (n, 2); its edges are at 1.

    The camera of the viewer goes round its target: `phi` down from the zenith, and at a
    `thetaOffset` of 0 it looks along y.
    """
    camera = panel['cameraState']
    phi, theta = np.radians([camera['phi'], camera['thetaOffset']])
    right = np.array([math.cos(theta), -math.sin(theta), 0.0])
    level = np.array([-math.sin(theta), -math.cos(theta), 0.0])
    back = math.sin(phi) * level + math.cos(phi) * np.array([0.0, 0.0, 1.0])
    relative = points - (np.array(camera['targetOffset']) + camera['distance'] * back)
    depth = -relative @ back
    assert depth.min() > camera['near']
    assert depth.max() < camera['far']
    half = depth * math.tan(0.5 * math.radians(camera['fovy']))
    return np.stack(
        (relative @ right / (half * aspect), relative @ np.cross(back, right) / half), axis=1
    )


@pytest.mark.parametrize('aspect', [WIDEST, NARROWEST])
def test_the_field_shows_the_flight_from_release_to_landing(flight, aspect):
    t = flight.trajectory
    flown = np.vstack((paper_frames.map_from_paper(t.position), flight.position))
    screen = on_screen(FIELD, flown, aspect)
    assert np.abs(screen).max() < 0.95
    assert np.ptp(screen[:, 0]) > 0.8  # of 2: the flight is not in a corner
    assert (np.diff(screen[:, 0]) > 0).all()  # to the right


@pytest.mark.parametrize('aspect', [1.0, CLOSE_UP])
def test_the_disc_fills_the_close_up(aspect):
    turn = np.linspace(0.0, 2 * math.pi, 100)
    radius = 0.5 * configuration({}).setup.disc.diameter
    rim = radius * np.stack((np.cos(turn), np.sin(turn), 0.0 * turn), axis=1)
    screen = on_screen(CLOSE, rim, aspect)
    assert np.abs(screen).max() < 1.0
    assert np.ptp(screen[:, 0]) > 1.0  # half the width


def test_plotjuggler_shows_numbers_of_existing_topics(kinds):
    """PlotJuggler names a curve by its topic and fields with slashes."""
    root = ET.parse(ROOT / 'config/plotjuggler_layout.xml').getroot()
    curves = list(root.iter('curve'))
    names = [curve.get(key) for curve in curves for key in ('curve_x', 'curve_y')]
    names += [curve.get('name') for curve in curves if curve.get('curve_x') is None]
    names = [name for name in names if name]
    assert len(names) == 2 * 2 + 4
    for name in names:
        _, topic, *fields = name.split('/')
        assert slots(kinds[f'/{topic}'], fields) in NUMBER


# ---- predictor ----


@pytest.fixture(scope='module')
def predictor_kinds(kinds) -> dict[str, type]:
    """Return the types of the topics of the simulator and of those that the layout shows."""
    made = {
        topics.PredictorTopic.LANDING: outputs.landing,
        topics.PredictorTopic.ELLIPSE: outputs.ellipses,
        topics.PredictorTopic.PATH: outputs.path,
        topics.PredictorTopic.ESTIMATE: outputs.estimate,
    }
    return kinds | {f'/{name}': get_type_hints(make)['return'] for name, make in made.items()}


def test_the_layout_of_the_predictor_shows_path_landing_and_ellipse(predictor_kinds):
    panels = PREDICTED['configById']
    assert set(leaves(PREDICTED['layout'])) == set(panels)
    expected = {
        f'/{name}'
        for name in (
            topics.FIELD_MARKERS,
            topics.PATH,
            topics.PredictorTopic.PATH,
            topics.PredictorTopic.ELLIPSE,
        )
    }
    for name in PREDICTED_WIDTHS:
        assert visible(panels[name]) == expected
        shown_types = {predictor_kinds[topic] for topic in visible(panels[name])}
        assert shown_types == {MarkerArray, PathMessage}


def test_the_plots_of_the_predictor_show_numbers_of_existing_topics(predictor_kinds):
    plots = [p for name, p in PREDICTED['configById'].items() if name.startswith('Plot!')]
    values = [path['value'] for plot in plots for path in plot['paths']]
    assert len(values) == 6
    for value in values:
        plain, modifier, _ = value.partition('.@')
        assert not modifier or value[len(plain) :] in MODIFIERS
        topic, *names = plain.split('.')
        assert slots(predictor_kinds[topic], names) in NUMBER
    # x and y of the covariance are the places 0 and 7 of 6 x 6 numbers, row by row.
    assert sum('covariance[0]' in v or 'covariance[7]' in v for v in values) == 2


@pytest.mark.parametrize('name', PREDICTED_WIDTHS)
def test_the_views_of_the_predictor_show_the_whole_flight(flight, name):
    flown = paper_frames.map_from_paper(flight.trajectory.position)
    for aspect in PREDICTED_WIDTHS[name]:
        screen = on_screen(PREDICTED['configById'][name], flown, aspect)
        assert np.abs(screen).max() < 0.97
        assert np.ptp(screen[:, 0]) > 0.8
        assert (np.diff(screen[:, 0]) > 0).all()  # to the right


# ---- page ----


def test_both_viewers_know_the_titles():
    """Lichtblick has a name of its own for titles, and ignores the conversion to degrees."""
    for layout in (LAYOUT, PREDICTED):
        for panel in layout['configById'].values():
            title = panel['foxglovePanelTitle']
            assert panel['lichtblickPanelTitle'] == title.replace('[deg]', '[rad]')


def test_the_page_says_how_to_open_it():
    for word in (
        'config/foxglove_layout.json',
        'config/predictor_layout.json',
        'Lichtblick',
        'Foxglove',
        'tools/viewer/open.mjs',
    ):
        assert word in PAGE
    assert (ROOT / 'tools/viewer/open.mjs').exists()
    assert all(f'`{topic[1:]}`' in PAGE for panel in (FIELD, CLOSE) for topic in visible(panel))
