"""Scenes of a whole cell in virtual time: what is done, and what the ground truth says of it."""
