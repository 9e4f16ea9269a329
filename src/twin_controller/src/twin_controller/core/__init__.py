"""The twin controller's core: data in, decisions and actions out; no ROS, no I/O, no clock."""
