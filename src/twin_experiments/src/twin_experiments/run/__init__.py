"""Experiments are run: on both robots, and recorded."""
