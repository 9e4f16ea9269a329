"""Making steps on the simulator's own world in process, and drawing them."""
