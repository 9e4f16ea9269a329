"""A motion in the simulated world: what came of it."""
