"""Read what became of the parts from a bag."""
