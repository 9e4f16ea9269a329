"""Set points from outside: the newest one, and those ahead of their time."""
