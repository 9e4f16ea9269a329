"""Reads the cell's files and bags."""
