"""What touches the machine: processes, listening ports, the ROS master, files."""
