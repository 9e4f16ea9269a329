"""The robot's programs as files: their lines, and how they are read."""
