"""Invented cells on the bus."""
