"""What the page hears from the cell and asks it: topics, services, registers, camera, pendant."""
