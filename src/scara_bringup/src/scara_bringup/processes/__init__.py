"""Processes of the cell: started, watched, ended; ports, log files, the ROS master."""
