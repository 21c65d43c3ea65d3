"""`python -m disc_sim_ros.ros.live` runs live_view."""

import sys

from disc_sim_ros.ros.signals import exit_on_signal

exit_on_signal()  # also while Python loads ROS, which takes a second

from disc_sim_ros.ros.live.node import main  # noqa: E402

sys.exit(main())
