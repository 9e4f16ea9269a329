"""Recordings held against each other: real against twin, run against run, repeat against repeat."""
