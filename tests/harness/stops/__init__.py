"""What STOP, ESTOP and PAUSE do on a robot, by how it was set up; in virtual time."""
