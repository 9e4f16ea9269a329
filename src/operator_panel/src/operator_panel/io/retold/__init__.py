"""Recordings that a page looks back to: read by a program of its own, kept while somebody looks."""
