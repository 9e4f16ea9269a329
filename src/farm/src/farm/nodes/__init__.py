"""The link as a ROS node."""
