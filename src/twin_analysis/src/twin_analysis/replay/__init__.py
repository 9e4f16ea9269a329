"""A recorded run is played again: to the twin, to the controller's core."""
