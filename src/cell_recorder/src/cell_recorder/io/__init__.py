"""What touches the world without being ROS wiring: bag files."""
