"""For all tests: ROS messages check the types of what is assigned to them."""

import os

os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'  # read when a message is first imported
