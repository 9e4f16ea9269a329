"""Bags of a cell: what is recorded, into which file, and when a recording ends."""
