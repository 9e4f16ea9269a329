"""Runs the article's experiments and reports how well the pair moved as one."""
