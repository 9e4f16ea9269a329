"""Jogs: joints at given velocities, at once or with the real robot."""
