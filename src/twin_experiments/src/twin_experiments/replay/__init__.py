"""A recording played again: through the controller's core, or in front of a live twin."""
