"""What is not exactly known of a cell, and what may come of a motion because of it. Pure."""
