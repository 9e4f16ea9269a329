"""ROS services, called on a connection of our own."""
