"""The simulated cell in process: no clock, no ROS."""
