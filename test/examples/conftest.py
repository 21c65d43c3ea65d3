"""The examples connect to real simulators, as the tests of the nodes do."""

from ros.conftest import ros, ros_context, ros_environment

__all__ = ['ros', 'ros_context', 'ros_environment']
