"""The physics engine as a model of the arm."""
