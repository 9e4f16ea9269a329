"""What every node does about the ROS graph itself."""
