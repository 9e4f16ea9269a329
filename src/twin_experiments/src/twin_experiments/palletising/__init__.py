"""What became of the parts: placed, how well, how fast, what went wrong. Pure."""
