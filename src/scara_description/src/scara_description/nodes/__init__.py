"""Executables of scara_description."""
