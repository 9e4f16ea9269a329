"""Whole cells that are started, disturbed and watched from outside."""
