"""The robot's stand-in without its wire, opposite the twin controller's core."""
