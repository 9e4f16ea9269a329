"""The node and the command line."""
