"""ROS wiring that all nodes share."""
