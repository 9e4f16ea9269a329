"""Kinematics, PID and motion of the SCARA and their nodes."""
