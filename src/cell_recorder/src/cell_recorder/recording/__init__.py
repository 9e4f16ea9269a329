"""A run is recorded to a bag in its folder."""
