"""Types of topics: their names come from the network and are not trusted."""

import sys

import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import Int64

from disc_sim_ros.ros.recorder.topic_recorder import message_type


def test_an_installed_type_is_returned():
    assert message_type('std_msgs/msg/Int64') is Int64


@pytest.mark.parametrize(
    'name',
    [
        'no_such_msgs/msg/Thing',
        'nav_msgs/msg/NoSuch',
        'nav_msgs/msg/msg',
        'nonsense',
        '/x/y',
        '../msg/X',
        'std_msgs/msg/Int64\n',
        'antigravity/msg/X',
        'wsgiref/simple_server/WSGIServer',
    ],
)
def test_a_name_that_is_not_of_an_installed_type_is_an_import_error(name):
    with pytest.raises(ImportError):
        message_type(name)
    assert 'wsgiref.simple_server' not in sys.modules  # names from the network run no code
