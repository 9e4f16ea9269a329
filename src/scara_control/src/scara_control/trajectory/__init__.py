"""Trajectories given by others: checked, timed, executed as streamed set points."""
