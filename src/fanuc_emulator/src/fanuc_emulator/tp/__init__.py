"""The interpreter of the robot's own programs: it executes the text that a person typed."""
