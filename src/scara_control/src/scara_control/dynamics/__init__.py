"""What moving the arm asks of its joints, and what they may be asked for. Pure."""
