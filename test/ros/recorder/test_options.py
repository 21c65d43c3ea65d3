"""Parameters of recorder_node and its selection of topics, without ROS."""

from pathlib import Path
import re

import pytest
import yaml

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.ros.recorder.options import RECORDER_TABLE, Selection, recorder_config
import parameter_pages


@pytest.mark.parametrize(
    ('values', 'taken', 'left'),
    [
        ({}, ['/odom', '/red/odom'], ['/_hidden', '/red/_hidden/x']),
        ({'topics': 'odom /pose'}, ['/red/odom', '/pose'], ['/odom', '/red/pose']),
        ({'topics': ['odom', '/_x']}, ['/red/odom', '/_x'], ['/pose']),
        ({'regex': '/red/.*'}, ['/red/odom'], ['/odom', '/blue/red/odom', '/red/_x']),
        ({'topics': '/pose', 'regex': '/o.*'}, ['/pose', '/odom'], ['/imu']),
        ({'exclude': '/rosout|/o.*'}, ['/pose'], ['/rosout', '/odom']),
        ({'topics': '/odom', 'exclude': '/odom'}, [], ['/odom', '/pose']),
    ],
)
def test_topics_are_chosen_as_rosbag2_does(values, taken, left):
    selection = recorder_config(values, '/red').selection
    assert [name for name in [*taken, *left] if selection.takes(name)] == taken


def test_defaults_are_allowed_and_mean_no_limits():
    config = recorder_config({entry.name: entry.default for entry in RECORDER_TABLE})
    assert (config.max_size, config.max_duration, config.flush_period) == (None, None, 0.5)
    assert re.fullmatch(r'bags/disc_\d{4}-\d\d-\d\d_\d\d-\d\d-\d\d', str(config.bag))
    assert config.selection == Selection()
    assert recorder_config({'max_size_mib': 3}).max_size == 3 * 2**20


@pytest.mark.parametrize(
    'values',
    [
        {'topics': 'a//b'},
        {'exclude': '['},
        {'flush_period': 0.0},
        {'max_size_mib': -1},
        {'bga': ''},
    ],
)
def test_a_bad_value_is_refused_with_its_name(values):
    with pytest.raises(ConfigError, match=next(iter(values))):
        recorder_config(values)


def test_everything_is_selected_unless_topics_or_a_regex_are_given():
    assert recorder_config({'exclude': '/rosout'}).selection.everything
    assert not recorder_config({'topics': '/odom'}).selection.everything
    assert not recorder_config({'regex': '/.*'}).selection.everything


@pytest.mark.parametrize(
    ('page', 'file'), [('recorder', 'docs/recorder.md'), ('recorder_yaml', 'config/recorder.yaml')]
)
def test_pages_are_made_of_the_table(page, file):
    text = (Path(__file__).parents[3] / file).read_text(encoding='utf-8')
    command = f'python tools/parameter_pages.py {page} > {file}'
    assert text == parameter_pages.PAGES[page](), f'run: {command}'


def test_the_file_holds_every_parameter_with_its_default():
    document = yaml.safe_load(parameter_pages.recorder_yaml_file())
    expected = {entry.name: entry.default for entry in RECORDER_TABLE}
    assert document == {'/**': {'ros__parameters': expected}}
