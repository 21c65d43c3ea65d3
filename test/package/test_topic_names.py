"""Names of topics, frames and types of messages are written once, in topics.py."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from disc_sim_ros import topics
from disc_sim_ros.topics import Frames

PACKAGE = Path(__file__).parents[2] / 'disc_sim_ros'
# Words with other uses: quantities, commands, flags, labels of plots.
ORDINARY = {
    'pose', 'transform', 'imu', 'airspeed', 'angle_of_attack', 'absolute_attitude',
    'advance_ratio', 'spin_rate', 'path', 'markers', 'configuration', 'release', 'throw', 'wind',
    'spin', 'map', 'disc',
}  # fmt: skip


def constants(holder: object) -> set[str]:
    """Return the strings in the upper-case names of a module or class."""
    values = vars(holder).items()
    return {value for name, value in values if name.isupper() and isinstance(value, str)}


NAMES = (
    constants(topics)
    | constants(topics.MessageType)
    | constants(topics.NodeTopic)
    | {Frames().map, Frames().disc, Frames().disc_body, Frames().disc_air}
) - ORDINARY


def retyped(source: str) -> Iterator[str]:
    """Yield the names in a module that stand in topics.py, with or without a slash before them."""
    for node in ast.walk(ast.parse(source)):
        text = node.value if isinstance(node, ast.Constant) else None
        if isinstance(text, str) and {text, text.removeprefix('/')} & NAMES:
            yield text


def test_no_module_but_topics_has_such_a_name():
    assert len(NAMES) > 20
    places = {
        path.relative_to(PACKAGE).as_posix(): names
        for path in PACKAGE.rglob('*.py')
        if path != PACKAGE / 'topics.py'
        and (names := list(retyped(path.read_text(encoding='utf-8'))))
    }
    assert places == {}


@pytest.mark.parametrize(
    'planted',
    [
        "TOPICS = ('applied_wind',)",
        "if name == '/odom': pass",
        "frame = prefix + 'disc_air'",
        "kind = 'nav_msgs/msg/Odometry'",
        "skip = {'/parameter_events'}",
    ],
)
def test_a_name_elsewhere_is_noticed(planted):
    assert list(retyped(planted))
