"""`python -m disc_sim_ros.ros.predictor`."""

import sys

from disc_sim_ros.ros.predictor.node import main

sys.exit(main())
