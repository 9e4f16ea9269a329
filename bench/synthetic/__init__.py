"""Invented cells, for practice, tests and measurements."""
