"""The node and its ROS side."""
