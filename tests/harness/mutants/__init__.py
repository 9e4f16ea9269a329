"""Mutants: small faults made in the sources, to see whether a test notices each of them."""
