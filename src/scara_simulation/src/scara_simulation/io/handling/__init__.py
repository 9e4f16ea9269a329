"""The parts as bodies of the physics engine."""
