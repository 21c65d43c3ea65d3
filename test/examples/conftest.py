"""The examples talk to real simulators, as the tests of the nodes do."""

from nodes.conftest import ros, ros_context, ros_environment

__all__ = ['ros', 'ros_context', 'ros_environment']
