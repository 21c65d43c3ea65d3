"""The URDF and the RViz configuration agree with the messages and with the catalogue."""

import math
import xml.etree.ElementTree as ET

import pytest
import yaml

pytest.importorskip('rclpy')

from disc_sim_ros import topics
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.sim import markers
from disc_sim_ros.topics import Frames
from package.sources import ROOT

FRAMES = Frames()


# ---- URDF ----


@pytest.fixture(scope='module')
def urdf() -> ET.Element:
    return ET.parse(ROOT / 'urdf/disc.urdf').getroot()


def numbers(text: str) -> list[float]:
    return [float(number) for number in text.split()]


def test_links_and_joint_have_the_names_of_the_messages(urdf):
    assert [link.get('name') for link in urdf.iter('link')] == [FRAMES.disc, FRAMES.disc_body]
    (joint,) = urdf.iter('joint')
    assert joint.get('name') == topics.SPIN_JOINT
    assert joint.get('type') == 'continuous'
    assert joint.find('parent').get('link') == FRAMES.disc
    assert joint.find('child').get('link') == FRAMES.disc_body


def test_the_joint_rotates_as_the_transform_does(urdf):
    (joint,) = urdf.iter('joint')
    axis = numbers(joint.find('axis').get('xyz'))
    assert numbers(joint.find('origin').get('xyz')) == [0.0, 0.0, 0.0]
    assert numbers(joint.find('origin').get('rpy')) == [0.0, 0.0, 0.0]
    state = Launch(spin=30.0).state()._replace(sigma=2.0)
    angle, rate = messages.spin_joint(state)
    assert rate == -30.0
    assert [math.sin(angle / 2) * x for x in axis] == [
        0.0,
        0.0,
        pytest.approx(messages.spin_transform(state)[0]),
    ]
    assert math.cos(angle / 2) == pytest.approx(messages.spin_transform(state)[1])


def test_mass_inertia_and_size_are_those_of_the_catalogue(urdf):
    disc = disc_file.load_disc('frisbee')
    (inertial,) = urdf.iter('inertial')
    assert inertial.find('mass').get('value') == f'{disc.mass:g}'
    moments = {key: float(value) for key, value in inertial.find('inertia').items()}
    x, z = disc.inertia_diametral, disc.inertia_axial
    assert moments == {'ixx': x, 'ixy': 0, 'ixz': 0, 'iyy': x, 'iyz': 0, 'izz': z}
    assert 0.0 < z <= 2.0 * x
    (cylinder,) = urdf.iter('cylinder')
    assert float(cylinder.get('radius')) == pytest.approx(disc.diameter / 2)
    assert float(cylinder.get('length')) == pytest.approx(markers.RIM_HEIGHT * disc.diameter)


def test_the_mark_is_visible_and_within_the_disc(urdf):
    mark = next(visual for visual in urdf.iter('visual') if visual.get('name') == 'mark')
    (cylinder,) = urdf.iter('cylinder')
    x, y, z = numbers(mark.find('origin').get('xyz'))
    length, width, height = numbers(next(mark.iter('box')).get('size'))
    assert (y, z) == (0.0, 0.0)
    assert x - length / 2 == 0.0
    assert math.hypot(x + length / 2, width / 2) < float(cylinder.get('radius'))
    assert height > float(cylinder.get('length'))


# ---- RViz ----


@pytest.fixture(scope='module')
def rviz() -> dict:
    return yaml.safe_load((ROOT / 'rviz/disc.rviz').read_text(encoding='utf-8'))


def displays(rviz: dict) -> dict[str, dict]:
    return {display['Name']: display for display in rviz['Visualization Manager']['Displays']}


def test_displays_show_existing_topics_with_their_quality_of_service(rviz):
    shown = displays(rviz)
    expected = {
        'Path': topics.PATH,
        'Disc': topics.MARKERS,
        'Field': topics.FIELD_MARKERS,
        'Pose': topics.POSE,
        'Odometry': topics.ODOM,
    }
    assert {name: shown[name]['Topic']['Value'] for name in expected} == expected
    assert {name for name, display in shown.items() if 'Topic' in display} == set(expected)
    for name in expected:
        latched = name in {'Disc', 'Field'}
        durability = 'Transient Local' if latched else 'Volatile'
        assert shown[name]['Topic']['Durability Policy'] == durability
        assert shown[name]['Topic']['Reliability Policy'] == 'Reliable'
    assert shown['RobotModel']['Description Topic']['Durability Policy'] == 'Transient Local'


def test_displays_that_need_no_other_node_are_enabled(rviz):
    enabled = {name for name, display in displays(rviz).items() if display['Enabled']}
    assert enabled == {'Ground, 1 m', 'TF', 'Path', 'Disc', 'Field', 'Pose'}
    for display in displays(rviz).values():
        assert display['Enabled'] is display['Value']


def test_the_view_shows_the_ground_and_can_follow_the_disc(rviz):
    manager = rviz['Visualization Manager']
    assert manager['Global Options']['Fixed Frame'] == FRAMES.map
    assert manager['Views']['Current']['Target Frame'] == '<Fixed Frame>'
    saved = {view['Name']: view for view in manager['Views']['Saved']}
    follower = saved['Follow the disc']
    assert follower['Class'] == 'rviz_default_plugins/ThirdPersonFollower'
    assert follower['Target Frame'] == FRAMES.disc


def test_the_first_view_shows_a_flight_of_30_m(rviz):
    view = rviz['Visualization Manager']['Views']['Current']
    for x, y, z in ((0, 0, 0), (30, 0, 0), (15, 0, 5), (25, -5, 0), (25, 5, 0)):
        right, up, away = from_camera(view, (x, y, z))
        reach = away * math.tan(view['Field of View'] / 2)  # from the middle to the upper edge
        assert abs(up) < reach
        assert abs(right) < 4 / 3 * reach  # of a window that is 4 wide and 3 high


def from_camera(view: dict, point: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return the distances of a point to the right, above and away in an orbit view."""
    yaw, pitch, distance = view['Yaw'], view['Pitch'], view['Distance']
    towards_camera = (
        math.cos(yaw) * math.cos(pitch),
        math.sin(yaw) * math.cos(pitch),
        math.sin(pitch),
    )
    right = (-math.sin(yaw), math.cos(yaw), 0.0)
    up = (-math.cos(yaw) * math.sin(pitch), -math.sin(yaw) * math.sin(pitch), math.cos(pitch))
    focus = view['Focal Point']
    at = [p - focus[axis] for p, axis in zip(point, 'XYZ', strict=True)]

    def along(axis: tuple[float, float, float]) -> float:
        return sum(a * b for a, b in zip(at, axis, strict=True))

    return along(right), along(up), distance - along(towards_camera)
