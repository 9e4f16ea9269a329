"""What link and desk both do with the bus."""
