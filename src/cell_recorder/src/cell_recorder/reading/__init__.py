"""Reads bags without ROS, also those that were not finished."""
