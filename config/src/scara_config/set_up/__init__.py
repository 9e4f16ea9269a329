"""How a robot's controller is set up for the pair: one source for kit, doctor and stand-in."""
