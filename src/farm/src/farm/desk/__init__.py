"""The room without ROS: who is there, what happened, and the answers to commands."""
