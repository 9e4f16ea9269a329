"""What touches the world without being ROS wiring: links and bag files."""
