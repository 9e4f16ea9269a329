"""What touches the world: the physics engine."""
