"""The robot's pendant: in the terminal and as a page."""
