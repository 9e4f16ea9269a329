"""What can be seen of the cells that run: who they are, and what their processes use."""
