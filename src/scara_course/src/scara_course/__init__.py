"""Exercises with robot and twin that mark themselves."""
