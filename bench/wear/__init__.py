"""Robots that wear, in virtual time: the monitor, what others find, and the labelled runs."""
