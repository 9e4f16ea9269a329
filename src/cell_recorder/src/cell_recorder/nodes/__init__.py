"""ROS nodes: parameters, wiring, spin."""
