"""Teach: a program of the robot is made on the page, line by line."""
