"""The gripper and the parts of the stand-in robot: where they are by their own, simple rules."""
