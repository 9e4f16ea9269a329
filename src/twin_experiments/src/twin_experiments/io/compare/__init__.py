"""Comparisons: bags in, figures and page out."""
