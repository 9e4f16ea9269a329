"""What can be seen of the cells that run."""
