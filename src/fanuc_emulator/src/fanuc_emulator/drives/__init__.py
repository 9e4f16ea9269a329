"""The axes of the robot, what moves each, and the paths that they follow together."""
