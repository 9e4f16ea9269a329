"""Faults on purpose: damage to data, a cell that can be broken, and what is measured on it."""
