"""What touches the world without being ROS wiring: bags, figures, pages, the pendant."""
