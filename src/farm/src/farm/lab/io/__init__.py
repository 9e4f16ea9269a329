"""Processes and files of the lab."""
