"""The gateway's view of the ROS graph: topics, services, parameters, first messages."""
