"""How the joints are moved: joint moves, streamed set points, jogging, trimming. No ROS in here."""
