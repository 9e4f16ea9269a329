"""Fit the twin to the robot: which numbers may change, how good they are, what is proposed."""
