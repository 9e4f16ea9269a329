"""What people work with beside moving by hand: programs, the robot itself, what was done today."""
