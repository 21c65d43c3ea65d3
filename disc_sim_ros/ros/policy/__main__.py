"""`python -m disc_sim_ros.ros.policy` runs policy_node."""

import sys

from disc_sim_ros.ros.signals import exit_on_signal

exit_on_signal()  # also while Python loads ROS, which takes a second

from disc_sim_ros.ros.policy.node import main  # noqa: E402

sys.exit(main())
