"""The ROS nodes: what paces, publishes and takes; the physics itself is in `core`."""
