"""What people work with beside jogging: programs, the robot itself, the day's work."""
