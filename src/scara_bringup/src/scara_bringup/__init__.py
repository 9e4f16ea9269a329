"""Starts and stops a whole cell from one command."""
