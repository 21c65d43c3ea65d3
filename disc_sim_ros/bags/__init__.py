"""Bags as rosbag2 writes them: MCAP files, their metadata, reading and repair. No ROS needed."""
