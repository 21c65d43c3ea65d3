"""Metrics, reports and plots of flights, from a simulation or a bag. No ROS."""
